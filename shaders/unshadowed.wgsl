// Nothing stands between a light and a surface. traced_shadows.wgsl takes this file's place where rays have found what
// does.

// Before the lights of a surface: `pixel`, of the target, shows the object in slot `slot`.
fn find_shadows(pixel: vec2f, slot: u32) {}

// What arrives of a light's colour, whose number among the object's lights is `number`.
fn with_shadow(color: vec3f, number: u32) -> vec3f {
    return color;
}
