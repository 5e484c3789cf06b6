//! The shader sources, joined. WGSL has no imports; each module is types, then what it needs, in one string.

macro_rules! shader {
    ($($file:literal),+) => { concat!($(include_str!(concat!("../../shaders/", $file)), "\n"),+) };
}

/// Objects: colour, and the outputs beside it.
pub const FORWARD: &str = shader!(
    "types.wgsl",
    "tone.wgsl",
    "sky.wgsl",
    "bump.wgsl",
    "bumped.wgsl",
    "height_field.wgsl",
    "emboss.wgsl",
    "dot3.wgsl",
    "environment_bump.wgsl",
    "lighting.wgsl",
    "debug.wgsl",
    "forward.wgsl"
);

/// The sky behind everything.
pub const SKY: &str = shader!("types.wgsl", "tone.wgsl", "sky.wgsl", "sky_pass.wgsl");

/// What a view draws.
pub const CULL: &str = shader!("types.wgsl", "cull.wgsl");

/// The farthest depths, for finding what is hidden.
pub const PYRAMID: &str = shader!("pyramid.wgsl");

/// Records into a table.
pub const SCATTER: &str = shader!("scatter.wgsl");

/// HDR to screen.
pub const TONE_MAP: &str = shader!("tone.wgsl", "tonemap.wgsl");

/// Every module with its name, for the tests that validate them.
pub const ALL: [(&str, &str); 6] = [
    ("forward", FORWARD),
    ("sky", SKY),
    ("cull", CULL),
    ("pyramid", PYRAMID),
    ("scatter", SCATTER),
    ("tonemap", TONE_MAP),
];
