//! The plan of a view.

use super::settings::Settings;
use systems::draw::View;

/// A view of a frame, and how it is drawn.
#[derive(Clone, PartialEq, Debug)]
pub struct ViewPlan {
    /// The camera at its place, and the size of the picture.
    pub view: View,
    /// Choices for the whole view.
    pub settings: Settings,
}

impl ViewPlan {
    /// Pixels.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.view.width, self.view.height)
    }
}
