//! Cameras: their views, and their pictures of what these drew. Pictures of a lens that bends are re-sampled of faces
//! and developed on the CPU. Uses captures and the renderer.

pub(crate) mod capture;
pub(crate) mod develop;
pub(crate) mod lens_map;
mod pixels;
mod resample;
