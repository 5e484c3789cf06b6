//! Choices for a whole view.

use systems::library::Technique;

/// What to look at instead of the lit picture.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub enum DebugView {
    /// The lit picture.
    #[default]
    Off,
    /// Base colour.
    Base,
    /// Shading normal, world space, 0..1.
    Normal,
    /// Vertex tangent, world space, 0..1.
    Tangent,
    /// How many lights reach each pixel.
    LightCount,
    /// What each of the object's three lights gives, as red, green and blue; the picked object brighter.
    ThreeLights,
}

impl DebugView {
    /// All views with their names.
    pub const ALL: [(&'static str, Self); 6] = [
        ("off", Self::Off),
        ("base", Self::Base),
        ("normal", Self::Normal),
        ("tangent", Self::Tangent),
        ("light_count", Self::LightCount),
        ("three_lights", Self::ThreeLights),
    ];
}

/// Choices for a whole view.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Settings {
    /// Draws every material with this technique.
    pub technique: Option<Technique>,
    /// Shows something else than light.
    pub debug: DebugView,
    /// Samples per pixel: 4, or 1 for comparing single samples.
    pub samples: u32,
    /// The entity (its index) that debug views point out.
    pub picked_entity: Option<u32>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { technique: None, debug: DebugView::Off, samples: 4, picked_entity: None }
    }
}
