//! Views: the state of each from frame to frame, what it is drawn into, what it gives. May use all but `frame`.

pub(crate) mod blended;
pub(crate) mod layers;
pub(crate) mod outputs;
pub(crate) mod view_passes;
pub(crate) mod view_state;
pub(crate) mod view_target;
