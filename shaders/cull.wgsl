// Which objects a view draws: one compute pass per view, before its draws. src/renderer/culling.rs records it.
//
//   cull      one invocation per slot: is the object in view, and at which level of detail?
//   count     one workgroup per entry (a page as one draw sees it): which of its slots does the draw take?
//   scan      one workgroup: where in its draw's list does each entry begin?
//   scatter   one workgroup per entry: slots into the list of visible ones, in the order of pages and slots
//   finish    one invocation per draw: how many instances it has
//
// Every list comes out in the same order however the invocations run: nothing is appended by atomic counters.
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
}

struct CullBatch {
    // Bounding sphere of the mesh, object space.
    center: vec3f,
    radius: f32,
    // Of each level of detail, metres in object space, ascending.
    errors: array<f32, 8>,
}

struct CullDraw {
    level: u32,
    first_entry: u32,
    end_entry: u32,
    // Where its list of visible slots begins.
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
// Per entry: 64 bits for the slots it keeps, and their count, which `scan` replaces by the sum of all counts before.
@group(1) @binding(6) var<storage, read_write> kept: array<vec4u>;
@group(1) @binding(7) var<storage, read_write> visible: array<u32>;
@group(1) @binding(8) var<storage, read_write> arguments: array<DrawArguments>;
@group(1) @binding(9) var pyramid: texture_2d<f32>;

const PAGE_SLOTS = 64u;
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

// Which of EARLY and LATE is drawn.
override PHASE: u32 = 0x200u;

fn index_of(workgroup: vec3u) -> u32 {
    return workgroup.x + workgroup.y * ROW;
}

// The largest stretch of the matrix with those rows, bounded by Gershgorin's theorem on MᵀM; systems/bounds.rs has the
// twin. 0 in a slot that is not in use.
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

// The coarsest level whose error covers no more pixels than it may; systems/levels.rs has the twin.
fn level_of(bounds: Ball, batch: CullBatch) -> u32 {
    let distance = select(length(bounds.center - view.eye) - bounds.radius, 1.0, view.parallel == 1u);
    let allowed = cull_view.allowed_error * max(distance, 0.0);
    var level = 0u;
    for (var i = 1u; i < 8u; i++) {
        if batch.errors[i] * bounds.scale > allowed || distance <= 0.0 {
            break;
        }
        level = i;
    }
    return level;
}

@compute @workgroup_size(64)
fn cull(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    let index = index_of(workgroup);
    if index >= cull_view.page_count {
        return;
    }
    let page = pages[index];
    let slot = page.x * PAGE_SLOTS + place;
    let bounds = bounds_of(slot, batches[page.y]);
    let level = level_of(bounds, batches[page.y]);
    if bounds.scale <= 0.0 || !in_frustum(bounds.center, bounds.radius) {
        visibility[slot] = 0u;
    } else if cull_view.occlusion == 0u {
        visibility[slot] = level | IN_VIEW | EARLY | SEEN;
    } else {
        visibility[slot] = level | IN_VIEW | select(0u, EARLY, (visibility[slot] & SEEN) != 0u);
    }
}

// Whether everything in the box around a ball is behind what the pyramid holds.
fn is_hidden(bounds: Ball) -> bool {
    var low = vec2f(1.0);
    var high = vec2f(-1.0);
    var nearest = 0.0;
    // Room for rounding, as in the frustum's test.
    let radius = bounds.radius * 1.001 + 1e-6 * length(bounds.center);
    for (var i = 0u; i < 8u; i++) {
        let corner = vec3f(vec3u(i, i >> 1u, i >> 2u) & vec3u(1u)) * 2.0 - 1.0;
        let clip = view.clip_from_world * vec4f(bounds.center + corner * radius, 1.0);
        // In front of the near plane, or beside the eye.
        if clip.z >= clip.w || clip.w <= 0.0 {
            return false;
        }
        let ndc = clip.xyz / clip.w;
        low = min(low, ndc.xy);
        high = max(high, ndc.xy);
        nearest = max(nearest, ndc.z);
    }
    // A pixel more on each side: samples do not lie at the centres of pixels.
    let last = cull_view.size - 1.0;
    let first_pixel = clamp(vec2f(low.x, -high.y) * 0.5 * cull_view.size + 0.5 * cull_view.size - 1.0, vec2f(0.0), last);
    let last_pixel = clamp(vec2f(high.x, -low.y) * 0.5 * cull_view.size + 0.5 * cull_view.size + 1.0, vec2f(0.0), last);
    // The level at which two by two texels cover them.
    let extent = last_pixel - first_pixel;
    let level = u32(clamp(ceil(log2(max(max(extent.x, extent.y), 1.0))) - 1.0, 0.0, f32(cull_view.pyramid_levels - 1u)));
    let low_texel = vec2u(first_pixel) >> vec2u(level + 1u);
    let high_texel = vec2u(last_pixel) >> vec2u(level + 1u);
    var farthest = 1.0;
    for (var y = low_texel.y; y <= high_texel.y; y++) {
        for (var x = low_texel.x; x <= high_texel.x; x++) {
            farthest = min(farthest, textureLoad(pyramid, vec2u(x, y), level).r);
        }
    }
    return nearest * 1.00001 < farthest;
}

@compute @workgroup_size(64)
fn occlude(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    let index = index_of(workgroup);
    if index >= cull_view.page_count {
        return;
    }
    let page = pages[index];
    let slot = page.x * PAGE_SLOTS + place;
    let found = visibility[slot];
    if (found & IN_VIEW) != 0u && !is_hidden(bounds_of(slot, batches[page.y])) {
        visibility[slot] = found | SEEN | select(LATE, 0u, (found & EARLY) != 0u);
    }
}

fn takes(draw: CullDraw, found: u32) -> bool {
    return (found & PHASE) != 0u && (found & LEVEL_MASK) == draw.level;
}

var<workgroup> mask: array<atomic<u32>, 2>;

@compute @workgroup_size(64)
fn count(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    let index = index_of(workgroup);
    let entry = entries[min(index, cull_view.entry_count - 1u)];
    if takes(draws[entry.y], visibility[entry.x * PAGE_SLOTS + place]) {
        atomicOr(&mask[place / 32u], 1u << (place % 32u));
    }
    workgroupBarrier();
    if place == 0u && index < cull_view.entry_count {
        let low = atomicLoad(&mask[0]);
        let high = atomicLoad(&mask[1]);
        kept[index] = vec4u(low, high, countOneBits(low) + countOneBits(high), 0u);
    }
}

const SCANNERS = 256u;
var<workgroup> sums: array<u32, SCANNERS>;

@compute @workgroup_size(SCANNERS)
fn scan(@builtin(local_invocation_index) scanner: u32) {
    let share = (cull_view.entry_count + SCANNERS - 1u) / SCANNERS;
    let first = scanner * share;
    let end = min(first + share, cull_view.entry_count);
    var sum = 0u;
    for (var i = first; i < end; i++) {
        sum += kept[i].z;
    }
    sums[scanner] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var i = 0u; i < scanner; i++) {
        before += sums[i];
    }
    for (var i = first; i < end; i++) {
        let here = kept[i].z;
        kept[i].z = before;
        before += here;
    }
    if scanner == SCANNERS - 1u {
        kept[cull_view.entry_count].z = before;
    }
}

@compute @workgroup_size(64)
fn scatter(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    let index = index_of(workgroup);
    if index >= cull_view.entry_count {
        return;
    }
    let bits = kept[index];
    let word = select(bits.x, bits.y, place >= 32u);
    let bit = 1u << (place % 32u);
    if (word & bit) == 0u {
        return;
    }
    let entry = entries[index];
    let draw = draws[entry.y];
    let before = countOneBits(word & (bit - 1u)) + select(0u, countOneBits(bits.x), place >= 32u);
    let rank = bits.z - kept[draw.first_entry].z + before;
    visible[draw.first_visible + rank] = entry.x * PAGE_SLOTS + place;
}

@compute @workgroup_size(64)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    if id.x < cull_view.draw_count {
        let draw = draws[id.x];
        arguments[id.x].instance_count = kept[draw.end_entry].z - kept[draw.first_entry].z;
    }
}
