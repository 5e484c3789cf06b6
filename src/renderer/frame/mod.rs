//! A frame: the renderer prepares and encodes views, alone or many together, and reads back what they give. May use
//! all other floors.

mod batch_encoder;
mod draw_outputs;
mod encode;
pub(crate) mod many_worlds;
mod measured;
mod objects;
pub(crate) mod renderer;
pub(crate) mod single_view;
pub(crate) mod view_batches;
mod visible;
mod worlds;
