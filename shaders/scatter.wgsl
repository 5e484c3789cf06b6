// Records that lie apart in a table, written in one go: one invocation per texel.
// src/renderer/resources/scatter.rs encodes it.

// The first texel of where each record goes.
@group(0) @binding(0) var<storage, read> places: array<u32>;
// The records, one after another.
@group(0) @binding(1) var<storage, read> texels: array<vec4u>;
@group(0) @binding(2) var tables: texture_storage_2d<rgba32uint, write>;

// Of a record.
override TEXELS: u32 = 1u;

const TABLE_WIDTH = 4096u;
// Workgroups in a row of the dispatch.
const ROW = 32768u;

@compute @workgroup_size(64)
fn scatter(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) place: u32) {
    let index = (workgroup.x + workgroup.y * ROW) * 64u + place;
    if index >= arrayLength(&texels) {
        return;
    }
    let texel = places[index / TEXELS] + index % TEXELS;
    textureStore(tables, vec2u(texel % TABLE_WIDTH, texel / TABLE_WIDTH), texels[index]);
}
