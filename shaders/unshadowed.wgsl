// Nothing stands between a light and a surface. shadows.wgsl takes this file's place where some light casts shadows,
// traced_shadows.wgsl where rays have found them.

// Before the lights of a surface. `dp_dx`, `dp_dy`: how `in.position` differs from pixel to pixel.
fn find_shadows(in: VertexOut, dp_dx: vec3f, dp_dy: vec3f) {}

// How much of a light is seen from the surface, 0 to 1; its number among the object's lights is `number`.
fn visibility(arriving: Arriving, bump: Bump, number: u32) -> f32 {
    return 1.0;
}
