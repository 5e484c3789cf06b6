// Which objects a view draws: one compute pass per view, before its draws. src/renderer/culling/cull.rs encodes it.
//
//   cull          per slot: is the object in view, at which level of detail, and how far away?
//   count         per entry (a page as one draw sees it): of the slots that the draw takes, how many are in each slice
//                 of distance?
//   scan_blocks   one workgroup per block of these counts: each becomes the sum of those before it in the block
//   scan_totals   one workgroup: the blocks' sums become the sums of all blocks before
//   scatter       per entry: slots into the list of visible ones, slice by slice, in the order of pages and slots in
//                 a slice
//   finish        per draw: how many instances each of its arguments has, and which is the first
//
// After `cull`, a workgroup takes `TOGETHER` pages or entries: it looks which of them hold anything that is drawn, and
// does the rest of its work for these. Most pages are out of view, and most objects of a page at one level of detail.
//
// No branch hangs on uniforms alone: for such a one, Mesa's software driver makes a shader of its own for each value,
// and keeps what it made it from.
//
// Every list comes out in the same order however the invocations run: nothing is appended by atomic counters.
//
// What is near is drawn before what is far, so that fewer pixels are shaded that will be hidden: a counting sort by
// slices of distance, each √2 times as far as the one before.
//
// An object that lies between the places where pixels are sampled is not drawn (Wihlidal: "Optimizing the Graphics
// Pipeline with Compute", GDC 2016, of triangles): far away, most are.
//
// With occlusion, a view is drawn in two phases (Haar and Aaltonen: "GPU-Driven Rendering Pipelines", SIGGRAPH 2015):
// the early one draws what was seen in the frame before; `occlude` compares everything in view with the depth pyramid
// of that; the late one draws what appeared. So nothing that can be seen is missing, whatever moved.

struct Cull {
    // Of the view's frustum, world space, normals inward and of unit length; (0, 0, 0, 1) for a plane at infinity.
    planes: array<vec4f, 6>,
    page_count: u32,
    entry_count: u32,
    draw_count: u32,
    // 1: objects are drawn in two phases.
    occlusion: u32,
    // Pixels.
    size: vec2f,
    pyramid_levels: u32,
    // Metres that a level of detail may be off: where the projection is parallel; else, at a distance of one metre.
    allowed_error: f32,
    // Per pixel: 1 or 4.
    samples: u32,
    // How far the rasteriser may move a vertex, pixels.
    vertex_rounding: f32,
    // Where indirect draws must begin at the first instance: places in `visible` from a list of the early phase to that
    // of the late one. Else 0: the one follows the other at once.
    late_offset: u32,
    pad0: u32,
}

struct CullBatch {
    // Bounding sphere of the mesh, object space.
    center: vec3f,
    radius: f32,
    // Of the box around the mesh, from the same centre.
    half_extents: vec3f,
    pad0: u32,
    // The sphere that levels of detail are chosen by, object space.
    level_center: vec3f,
    level_radius: f32,
    // Of each level of detail, metres in object space, ascending.
    errors: array<f32, 8>,
}

struct CullDraw {
    level: u32,
    first_entry: u32,
    end_entry: u32,
    // Where its list of visible slots begins, in the early phase.
    first_visible: u32,
}

struct DrawArguments {
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(1) @binding(0) var<uniform> cull_view: Cull;
// Page and batch.
@group(1) @binding(1) var<storage, read> pages: array<vec2u>;
@group(1) @binding(2) var<storage, read> batches: array<CullBatch>;
// Page and draw, grouped by draw.
@group(1) @binding(3) var<storage, read> entries: array<vec2u>;
@group(1) @binding(4) var<storage, read> draws: array<CullDraw>;
// Per slot: what `cull` found.
@group(1) @binding(5) var<storage, read_write> visibility: array<u32>;
// Of each draw, its slices one after the other; of each slice, a count per entry, which `scan_blocks` replaces by the
// sum of those before it in its block. Behind all blocks, the sums of the blocks before each block, and behind these,
// how many slots each draw has in the early phase.
@group(1) @binding(6) var<storage, read_write> counts: array<u32>;
@group(1) @binding(7) var<storage, read_write> visible: array<u32>;
@group(1) @binding(8) var<storage, read_write> arguments: array<DrawArguments>;
@group(1) @binding(9) var pyramid: texture_2d<f32>;
// What the eye sees of a world with cells; systems/cells/sight.rs says how it is laid out.
@group(1) @binding(10) var<uniform> sight: array<vec4f, MOST_PLANES>;

const PAGE_SLOTS = 64u;
const MOST_PLANES = 1024u;
// Workgroups in a row of a dispatch; more than 65535 need rows.
const ROW = 32768u;

// Bits of `visibility`. The level of detail:
const LEVEL_MASK = 0xffu;
// In the frustum.
const IN_VIEW = 0x100u;
// Drawn in the early phase, or in the late one.
const EARLY = 0x200u;
const LATE = 0x400u;
// Seen when the view was last drawn.
const SEEN = 0x800u;
// The slice of distance, above this many bits.
const SLICE_SHIFT = 16u;

const SLICES = 32u;
// Of a slot that a draw does not take.
const NO_SLICE = 0xffffffffu;

// Pages or entries that a workgroup takes.
const TOGETHER = 8u;
// Invocations that look first whether one of them holds anything, each at so many slots.
const LOOKERS = PAGE_SLOTS / TOGETHER;
const SLOTS_EACH = PAGE_SLOTS / LOOKERS;

// Of the pages or entries at hand: a bit for each that holds anything. Workgroups begin with what others left in their
// variables (src/renderer/culling/cull.rs): for a whole array to be made zero before, compilers take long.
var<workgroup> busy: atomic<u32>;

// Which of EARLY and LATE is drawn.
override PHASE: u32 = 0x200u;

// Whether the world has cells.
override CELLS: bool = false;
// What ends a list of planes of `sight`: a cell, a window of a cell, one of outside, everything.
const END_OF_CELL: f32 = 1.0;
const END_OF_WINDOW: f32 = 2.0;
const END_OF_OUTSIDE: f32 = 3.0;
const END_OF_SIGHT: f32 = 4.0;

fn index_of(workgroup: vec3u) -> u32 {
    return workgroup.x + workgroup.y * ROW;
}

// The largest stretch of the matrix with those rows, bounded by Gershgorin's theorem on MᵀM; systems/space/bounds.rs
// has the twin. 0 in a slot that is not in use.
fn stretch(rows: array<vec4f, 3>) -> f32 {
    let x = vec3f(rows[0].x, rows[1].x, rows[2].x);
    let y = vec3f(rows[0].y, rows[1].y, rows[2].y);
    let z = vec3f(rows[0].z, rows[1].z, rows[2].z);
    let xy = abs(dot(x, y));
    let yz = abs(dot(y, z));
    let zx = abs(dot(z, x));
    return sqrt(max(dot(x, x) + xy + zx, max(dot(y, y) + xy + yz, dot(z, z) + yz + zx)));
}

fn in_frustum(center: vec3f, radius: f32) -> bool {
    // Room for rounding, which grows with the distance from the origin.
    let reach = -(radius * 1.001 + 1e-6 * length(center));
    var inside = true;
    for (var i = 0u; i < 6u; i++) {
        let plane = cull_view.planes[i];
        inside = inside && dot(plane.xyz, center) + plane.w >= reach;
    }
    return inside;
}

// Whether a window shows anything of the box around an object's mesh. The list of planes ends by what it holds and not
// by a number that is the same for all, as is said above.
fn is_in_sight(slot: u32, batch: CullBatch) -> bool {
    let rows = load_world_from_object(slot);
    let middle = vec4f(batch.center, 1.0);
    let center = vec3f(dot(rows[0], middle), dot(rows[1], middle), dot(rows[2], middle));
    let x = vec3f(rows[0].x, rows[1].x, rows[2].x) * batch.half_extents.x;
    let y = vec3f(rows[0].y, rows[1].y, rows[2].y) * batch.half_extents.y;
    let z = vec3f(rows[0].z, rows[1].z, rows[2].z) * batch.half_extents.z;
    let reaches = length(x) + length(y) + length(z);
    // Rasterizers move the edges of openings as well as those of objects beside where they are.
    let m = view.clip_from_eye;
    let per_metre = vec2f(length(vec3f(m[0].x, m[1].x, m[2].x)), length(vec3f(m[0].y, m[1].y, m[2].y)));
    let pixels = 0.5 * per_metre * cull_view.size;
    let moved = 2.0 * sqrt(2.0) * cull_view.vertex_rounding / min(pixels.x, pixels.y);
    // Room for rounding, which grows with the distance from the origin.
    let room = 1e-3 + 4e-6 * length(center) + 1e-3 * reaches + moved * (length(center - view.eye) + reaches);
    var within = true;
    var touched = true;
    var in_cell = false;
    var seen = false;
    for (var i = 0u; i < MOST_PLANES; i++) {
        let plane = sight[i];
        if dot(plane.xyz, plane.xyz) == 0.0 {
            if plane.w >= END_OF_SIGHT {
                break;
            }
            in_cell = in_cell || (plane.w == END_OF_CELL && within);
            seen = seen || (touched && (plane.w == END_OF_WINDOW || (plane.w == END_OF_OUTSIDE && !in_cell)));
            within = true;
            touched = true;
        } else {
            let distance = dot(plane.xyz, center) + plane.w;
            let reach = abs(dot(plane.xyz, x)) + abs(dot(plane.xyz, y)) + abs(dot(plane.xyz, z));
            within = within && distance - reach > room;
            touched = touched && distance + reach > -room;
        }
    }
    return seen;
}

struct Ball {
    center: vec3f,
    radius: f32,
    // How much larger than in object space; 0 in a slot that is not in use.
    scale: f32,
}

fn bounds_of(slot: u32, batch: CullBatch) -> Ball {
    let rows = load_world_from_object(slot);
    let center = vec4f(batch.center, 1.0);
    let scale = stretch(rows);
    return Ball(vec3f(dot(rows[0], center), dot(rows[1], center), dot(rows[2], center)), batch.radius * scale, scale);
}

// The coarsest level whose error covers no more pixels than it may; systems/assets/levels.rs has the twin.
fn level_of(slot: u32, scale: f32, batch: CullBatch) -> u32 {
    let rows = load_world_from_object(slot);
    let local = vec4f(batch.level_center, 1.0);
    let center = vec3f(dot(rows[0], local), dot(rows[1], local), dot(rows[2], local));
    let distance = select(length(center - view.eye) - batch.level_radius * scale, 1.0, view.parallel == 1u);
    let allowed = cull_view.allowed_error * max(distance, 0.0);
    var level = 0u;
    for (var i = 1u; i < 8u; i++) {
        if batch.errors[i] * scale > allowed || distance <= 0.0 {
            break;
        }
        level = i;
    }
    return level;
}

// The slice that holds what is so far away: half octaves from a quarter of a metre on.
fn slice_of(center: vec3f) -> u32 {
    let offset = center - view.eye;
    let distance = select(length(offset), -dot(offset, view.toward_eye), view.parallel == 1u);
    return u32(clamp(2.0 * log2(max(distance, 0.25)) + 4.0, 0.0, f32(SLICES - 1u)));
}

// What the box around an object's mesh covers of the picture.
struct Footprint {
    // Corners of the rectangle around it, pixels from the top left.
    low: vec2f,
    high: vec2f,
    // Reversed depth of what is nearest of it.
    nearest: f32,
    // Some of it is in front of the near plane or beside the eye: nothing else is known.
    unknown: bool,
    // The box in clip space: its middle, and half of its sides.
    middle: vec4f,
    sides: array<vec4f, 3>,
    // How far it may be off, pixels.
    room: vec2f,
    // The largest w of its corners.
    most_w: f32,
}

fn footprint_of(slot: u32, batch: CullBatch) -> Footprint {
    let rows = load_world_from_object(slot);
    let center = vec4f(batch.center, 1.0);
    let world = vec3f(dot(rows[0], center), dot(rows[1], center), dot(rows[2], center));
    // A little larger, as in the frustum's test.
    let half = batch.half_extents * 1.001;
    let farthest = half + abs(batch.center);
    let clip_from_world = view.clip_from_world;
    let middle = clip_from_world * vec4f(world, 1.0);
    let x = clip_from_world * vec4f(vec3f(rows[0].x, rows[1].x, rows[2].x) * half.x, 0.0);
    let y = clip_from_world * vec4f(vec3f(rows[0].y, rows[1].y, rows[2].y) * half.y, 0.0);
    let z = clip_from_world * vec4f(vec3f(rows[0].z, rows[1].z, rows[2].z) * half.z, 0.0);
    var low = vec2f(1e30);
    var high = vec2f(-1e30);
    var nearest = 0.0;
    var least_w = 1e30;
    var most_w = 0.0;
    var unknown = false;
    for (var i = 0u; i < 8u; i++) {
        let corner = vec3f(vec3u(i, i >> 1u, i >> 2u) & vec3u(1u)) * 2.0 - 1.0;
        let clip = middle + x * corner.x + y * corner.y + z * corner.z;
        unknown = unknown || clip.z >= clip.w || clip.w <= 0.0;
        let ndc = clip.xyz / clip.w;
        low = min(low, ndc.xy);
        high = max(high, ndc.xy);
        nearest = max(nearest, ndc.z);
        least_w = min(least_w, clip.w);
        most_w = max(most_w, clip.w);
    }
    // Room for rounding: metres, which grow with the distance from the origin, the mesh's own too, as they show in the
    // picture and its depths.
    let m = clip_from_world;
    let reach = length(rows[0].xyz * farthest) + length(rows[1].xyz * farthest) + length(rows[2].xyz * farthest);
    let rounding = 2e-6 * (length(world) + reach + length(view.eye)) / least_w;
    let per_metre = vec2f(length(vec3f(m[0].x, m[1].x, m[2].x)), length(vec3f(m[0].y, m[1].y, m[2].y)));
    let w_per_metre = length(vec3f(m[0].w, m[1].w, m[2].w));
    let aside = rounding * (per_metre + w_per_metre * max(abs(low), abs(high)));
    let nearer = rounding * (length(vec3f(m[0].z, m[1].z, m[2].z)) + w_per_metre * nearest);
    let room = aside * 0.5 * cull_view.size + cull_view.vertex_rounding;
    return Footprint(
        vec2f(low.x + 1.0, 1.0 - high.y) * 0.5 * cull_view.size - room,
        vec2f(high.x + 1.0, 1.0 - low.y) * 0.5 * cull_view.size + room,
        nearest + nearer,
        unknown,
        middle,
        array<vec4f, 3>(x, y, z),
        room,
        most_w,
    );
}

// How far a clip-space vector leads away from a point of the picture, pixels times w. Linear in the vector, and 0 for
// what lies behind that point: so a box is seen at the point if what this makes of it, a hexagon, holds the origin.
fn aside_of(clip: vec4f, ndc: vec2f) -> vec2f {
    return (clip.xy - ndc * clip.w) * 0.5 * cull_view.size;
}

fn cross_2d(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Whether the box is seen at a point of the picture, pixels from the top left, within the rectangle around it. If not,
// a line along one of the hexagon's sides lies between it and the origin.
fn is_seen_at(footprint: Footprint, point: vec2f) -> bool {
    let ndc = vec2f(point.x, -point.y) * 2.0 / cull_view.size + vec2f(-1.0, 1.0);
    let middle = aside_of(footprint.middle, ndc);
    let a = aside_of(footprint.sides[0], ndc);
    let b = aside_of(footprint.sides[1], ndc);
    let c = aside_of(footprint.sides[2], ndc);
    let room = footprint.room.yx * footprint.most_w;
    let a_b = abs(cross_2d(a, b));
    let b_c = abs(cross_2d(b, c));
    let c_a = abs(cross_2d(c, a));
    return abs(cross_2d(a, middle)) <= a_b + c_a + dot(abs(a), room)
        && abs(cross_2d(b, middle)) <= b_c + a_b + dot(abs(b), room)
        && abs(cross_2d(c, middle)) <= c_a + b_c + dot(abs(c), room);
}

// Where pixels are sampled, in eighths of a pixel from its top left, a hexadecimal digit for each: in the middle, where
// pictures of one sample have theirs, then as WebGPU ("Sample patterns") and Vulkan (standard sample locations) have
// four.
const SAMPLES_X = 0x51734u;
const SAMPLES_Y = 0x75314u;

// Pixels whose sample is in its rectangle at which to look for a box: larger ones hardly ever lie between all of them.
const MOST_POINTS = 4.0;

// Whether a box has any sample in it, or the middle of a pixel. One loop over all of them: Mesa's software driver goes
// through everything once, a loop's body too, whether it has to be or not.
fn is_sampled(footprint: Footprint) -> bool {
    var seen = footprint.unknown;
    var sample = 0u;
    var i = 0.0;
    while !seen && sample < select(1u, 5u, cull_view.samples > 1u) {
        let offset = vec2f((vec2u(SAMPLES_X, SAMPLES_Y) >> vec2u(4u * sample)) & vec2u(7u)) / 8.0;
        let first = max(ceil(footprint.low - offset), vec2f(0.0));
        let last = min(floor(footprint.high - offset), cull_view.size - 1.0);
        let points = max(last - first + 1.0, vec2f(0.0));
        let count = points.x * points.y;
        // In the middle of a place, as a division may be off a little.
        let row = floor((i + 0.5) / points.x);
        let point = first + offset + vec2f(i - row * points.x, row);
        seen = count > MOST_POINTS || (i < count && is_seen_at(footprint, point));
        i += 1.0;
        // Negated for what is not a number, which would have no end.
        if !(i < count) {
            sample += 1u;
            i = 0.0;
        }
    }
    return seen;
}

@compute @workgroup_size(PAGE_SLOTS)
fn cull(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    let index = index_of(workgroup);
    if index >= cull_view.page_count {
        return;
    }
    let page = pages[index];
    let slot = page.x * PAGE_SLOTS + place;
    let bounds = bounds_of(slot, batches[page.y]);
    // A mesh far from its own origin is where it is only nearly.
    let rounding = 1e-6 * bounds.scale * length(batches[page.y].center);
    if bounds.scale <= 0.0 || !in_frustum(bounds.center, bounds.radius + rounding)
        || !is_sampled(footprint_of(slot, batches[page.y])) || (CELLS && !is_in_sight(slot, batches[page.y])) {
        visibility[slot] = 0u;
        return;
    }
    let found = level_of(slot, bounds.scale, batches[page.y]) | IN_VIEW | (slice_of(bounds.center) << SLICE_SHIFT);
    let again = select(0u, EARLY, (visibility[slot] & SEEN) != 0u);
    visibility[slot] = found | select(again, EARLY | SEEN, cull_view.occlusion == 0u);
}

// Whether everything in a footprint is behind what the pyramid holds.
fn is_hidden(footprint: Footprint) -> bool {
    if footprint.unknown {
        return false;
    }
    let last = cull_view.size - 1.0;
    let first_pixel = vec2u(clamp(footprint.low, vec2f(0.0), last));
    let last_pixel = vec2u(clamp(footprint.high, vec2f(0.0), last));
    // The level at which two by two texels cover them.
    let extent = vec2f(last_pixel - first_pixel);
    let coarsest = f32(cull_view.pyramid_levels - 1u);
    let level = u32(clamp(ceil(log2(max(max(extent.x, extent.y), 1.0))) - 1.0, 0.0, coarsest));
    let low_texel = first_pixel >> vec2u(level + 1u);
    let high_texel = last_pixel >> vec2u(level + 1u);
    var farthest = 1.0;
    for (var y = low_texel.y; y <= high_texel.y; y++) {
        for (var x = low_texel.x; x <= high_texel.x; x++) {
            farthest = min(farthest, textureLoad(pyramid, vec2u(x, y), level).r);
        }
    }
    return footprint.nearest * 1.00001 < farthest;
}

@compute @workgroup_size(PAGE_SLOTS)
fn occlude(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    if place == 0u {
        atomicStore(&busy, 0u);
    }
    workgroupBarrier();
    let first = index_of(workgroup) * TOGETHER;
    let own = first + place / LOOKERS;
    if own < cull_view.page_count {
        let slot = pages[own].x * PAGE_SLOTS + place % LOOKERS * SLOTS_EACH;
        var found = 0u;
        for (var i = 0u; i < SLOTS_EACH; i++) {
            found |= visibility[slot + i];
        }
        if (found & IN_VIEW) != 0u {
            atomicOr(&busy, 1u << (place / LOOKERS));
        }
    }
    workgroupBarrier();
    for (var left = atomicLoad(&busy); left != 0u; left &= left - 1u) {
        let page = pages[first + firstTrailingBit(left)];
        let slot = page.x * PAGE_SLOTS + place;
        let found = visibility[slot];
        if (found & IN_VIEW) != 0u && !is_hidden(footprint_of(slot, batches[page.y])) {
            visibility[slot] = found | SEEN | select(LATE, 0u, (found & EARLY) != 0u);
        }
    }
}

// The slice of a slot, NO_SLICE if the draw does not take it.
fn taken_slice(draw: CullDraw, slot: u32) -> u32 {
    let found = visibility[slot];
    let taken = (found & PHASE) != 0u && (found & LEVEL_MASK) == draw.level;
    return select(NO_SLICE, found >> SLICE_SHIFT, taken);
}

// Where the count of an entry of a draw in a slice is.
fn count_index(draw: CullDraw, entry: u32, slice: u32) -> u32 {
    return draw.first_entry * SLICES + slice * (draw.end_entry - draw.first_entry) + entry - draw.first_entry;
}

// Of each entry at hand and each slice, 64 bits for the slots that it holds.
var<workgroup> members: array<atomic<u32>, 2u * SLICES * TOGETHER>;

// Notes a slot in its slice. (Not by adding up: which bits are set does not depend on which comes first.)
fn enter(number: u32, slice: u32, place: u32) {
    if slice != NO_SLICE {
        atomicOr(&members[2u * (number * SLICES + slice) + place / 32u], 1u << (place % 32u));
    }
}

fn members_of(number: u32, slice: u32) -> vec2u {
    let first = 2u * (number * SLICES + slice);
    return vec2u(atomicLoad(&members[first]), atomicLoad(&members[first + 1u]));
}

// How many slots of a slice lie before a place of the page.
fn members_before(number: u32, slice: u32, place: u32) -> u32 {
    let both = members_of(number, slice);
    let before = (1u << (place % 32u)) - 1u;
    return select(countOneBits(both.x) + countOneBits(both.y & before), countOneBits(both.x & before), place < 32u);
}

// Finds which entries from one on hold slots that are drawn, and notes these in their slices. A barrier must follow.
fn enter_all(first: u32, place: u32) {
    if place == 0u {
        atomicStore(&busy, 0u);
    }
    for (var i = place; i < 2u * SLICES * TOGETHER; i += PAGE_SLOTS) {
        atomicStore(&members[i], 0u);
    }
    workgroupBarrier();
    let own = first + place / LOOKERS;
    if own < cull_view.entry_count {
        let entry = entries[own];
        let draw = draws[entry.y];
        let slot = entry.x * PAGE_SLOTS + place % LOOKERS * SLOTS_EACH;
        var any = false;
        for (var i = 0u; i < SLOTS_EACH; i++) {
            any = any || taken_slice(draw, slot + i) != NO_SLICE;
        }
        if any {
            atomicOr(&busy, 1u << (place / LOOKERS));
        }
    }
    workgroupBarrier();
    for (var left = atomicLoad(&busy); left != 0u; left &= left - 1u) {
        let number = firstTrailingBit(left);
        let entry = entries[first + number];
        enter(number, taken_slice(draws[entry.y], entry.x * PAGE_SLOTS + place), place);
    }
}

@compute @workgroup_size(PAGE_SLOTS)
fn count(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    let first = index_of(workgroup) * TOGETHER;
    enter_all(first, place);
    workgroupBarrier();
    // Of entries that hold nothing, too.
    for (var i = place; i < TOGETHER * SLICES; i += PAGE_SLOTS) {
        let index = first + i / SLICES;
        if index < cull_view.entry_count {
            let both = countOneBits(members_of(i / SLICES, i % SLICES));
            counts[count_index(draws[entries[index].y], index, i % SLICES)] = both.x + both.y;
        }
    }
}

const SCANNERS = 64u;
// Counts that a scanner adds up.
const SHARE = 16u;
const BLOCK = SCANNERS * SHARE;

fn count_of_counts() -> u32 {
    return cull_view.entry_count * SLICES;
}

// One more than the counts need: the sum of all is asked for, too.
fn blocks() -> u32 {
    return count_of_counts() / BLOCK + 1u;
}

var<workgroup> sums: array<u32, SCANNERS>;

// What the scanners before this one added up, when each brings its own sum.
fn sum_of_others(scanner: u32, sum: u32) -> u32 {
    sums[scanner] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var i = 0u; i < scanner; i++) {
        before += sums[i];
    }
    return before;
}

@compute @workgroup_size(SCANNERS)
fn scan_blocks(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) scanner: u32) {
    let block = index_of(workgroup);
    let end = count_of_counts();
    let first = block * BLOCK + scanner * SHARE;
    var sum = 0u;
    for (var i = first; i < min(first + SHARE, end); i++) {
        sum += counts[i];
    }
    var before = sum_of_others(scanner, sum);
    if block >= blocks() {
        return;
    }
    if scanner == SCANNERS - 1u {
        counts[blocks() * BLOCK + block] = before + sum;
    }
    for (var i = first; i < first + SHARE; i++) {
        let here = select(0u, counts[i], i < end);
        counts[i] = before;
        before += here;
    }
}

@compute @workgroup_size(SCANNERS)
fn scan_totals(@builtin(local_invocation_index) scanner: u32) {
    let share = (blocks() + SCANNERS - 1u) / SCANNERS;
    let first = blocks() * BLOCK + scanner * share;
    let end = min(first + share, blocks() * (BLOCK + 1u));
    var sum = 0u;
    for (var i = first; i < end; i++) {
        sum += counts[i];
    }
    var before = sum_of_others(scanner, sum);
    for (var i = first; i < end; i++) {
        let here = counts[i];
        counts[i] = before;
        before += here;
    }
}

// Where the number of slots that a draw has in the early phase is noted.
fn early_index(draw: u32) -> u32 {
    return blocks() * (BLOCK + 1u) + draw;
}

// Where the list of a draw begins in `visible`.
fn list_start(draw: u32) -> u32 {
    let behind_early = select(cull_view.late_offset, counts[early_index(draw)], cull_view.late_offset == 0u);
    return draws[draw].first_visible + select(0u, behind_early, PHASE == LATE);
}

// The sum of all counts before one, after the scans.
fn sum_before(index: u32) -> u32 {
    return counts[index] + counts[blocks() * BLOCK + index / BLOCK];
}

@compute @workgroup_size(PAGE_SLOTS)
fn scatter(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    let first = index_of(workgroup) * TOGETHER;
    enter_all(first, place);
    workgroupBarrier();
    for (var left = atomicLoad(&busy); left != 0u; left &= left - 1u) {
        let number = firstTrailingBit(left);
        let entry = entries[first + number];
        let draw = draws[entry.y];
        let slot = entry.x * PAGE_SLOTS + place;
        let slice = taken_slice(draw, slot);
        if slice != NO_SLICE {
            let rank = sum_before(count_index(draw, first + number, slice)) - sum_before(draw.first_entry * SLICES);
            let drawn = slot | select(0u, COARSE, draw.level > 0u);
            visible[list_start(entry.y) + rank + members_before(number, slice, place)] = drawn;
        }
    }
}

@compute @workgroup_size(64)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    if id.x < cull_view.draw_count {
        let draw = draws[id.x];
        let first = list_start(id.x);
        let instances = sum_before(draw.end_entry * SLICES) - sum_before(draw.first_entry * SLICES);
        let early = counts[early_index(id.x)];
        counts[early_index(id.x)] = select(instances, early, PHASE == LATE);
        arguments[id.x].instance_count = instances;
        arguments[id.x].first_instance = select(0u, first, cull_view.late_offset == 0u);
    }
}
