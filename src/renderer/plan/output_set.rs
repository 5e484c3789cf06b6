//! Outputs of a view, as they are asked for.

use serde::{Deserialize, Serialize};

/// Outputs of a view.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize)]
pub struct OutputSet {
    /// The shaded picture.
    pub color: bool,
    /// Its linear colours, exposed, before the tone map.
    pub linear: bool,
    /// Distances along the viewing direction.
    pub depth: bool,
    /// Shading normals.
    pub normal: bool,
    /// Entities.
    pub id: bool,
}

impl OutputSet {
    /// None.
    pub const NONE: Self = Self { color: false, linear: false, depth: false, normal: false, id: false };
    /// The picture alone.
    pub const COLOR: Self = Self { color: true, ..Self::NONE };
    /// All.
    pub const ALL: Self = Self { color: true, linear: true, depth: true, normal: true, id: true };

    /// These, but for those of another set.
    pub fn without(self, other: Self) -> Self {
        Self {
            color: self.color && !other.color,
            linear: self.linear && !other.linear,
            depth: self.depth && !other.depth,
            normal: self.normal && !other.normal,
            id: self.id && !other.id,
        }
    }

    /// These, and those of another set.
    pub fn with(self, other: Self) -> Self {
        Self {
            color: self.color || other.color,
            linear: self.linear || other.linear,
            depth: self.depth || other.depth,
            normal: self.normal || other.normal,
            id: self.id || other.id,
        }
    }

    /// These, but for the picture and its linear colours.
    pub fn beside_color(self) -> Self {
        self.without(Self { linear: true, ..Self::COLOR })
    }

    /// Tells whether objects are shaded for them.
    pub fn is_shaded(self) -> bool {
        self.color || self.linear
    }
}
