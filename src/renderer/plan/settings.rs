//! Choices for a whole view.

use super::output_set::OutputSet;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use systems::assets::Technique;
use systems::assets::levels::LevelOfDetail;
use systems::draw::{Environment, ToneMap};

/// Debug picture in place of the lit one.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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
    /// Number of lights that reach each object, as a heat map.
    LightCount,
    /// Contributions of the object's first three lights, as red, green and blue; the picked object brighter.
    ThreeLights,
    /// The most that an object may miss by what its lights leave out, as a heat map: a sum of scores
    /// ([`dropped`](systems::lights::Selection::dropped)), times the exposure.
    ErrorBound,
    /// Visibility of the object's first three lights, as red, green and blue.
    Visibility,
    /// Surfaces in the colours of the cells that they lie in, and portals as outlines.
    Cells,
    /// Part of the light of the sky's upper half that the surface gets, as grey.
    Openness,
}

impl DebugView {
    /// All views with their names.
    pub const ALL: [(&'static str, Self); 10] = [
        ("off", Self::Off),
        ("base", Self::Base),
        ("normal", Self::Normal),
        ("tangent", Self::Tangent),
        ("light_count", Self::LightCount),
        ("three_lights", Self::ThreeLights),
        ("error_bound", Self::ErrorBound),
        ("visibility", Self::Visibility),
        ("cells", Self::Cells),
        ("openness", Self::Openness),
    ];

    /// Description in a few words; empty where the name says enough.
    pub fn shows(self) -> &'static str {
        match self {
            Self::Off | Self::Base | Self::Normal | Self::Tangent => "",
            Self::LightCount => "lights in range of each object, 1 blue to 64 red, none grey",
            Self::ThreeLights => "contributions of the first three lights as red, green and blue",
            Self::Visibility => "how much of the first three lights is seen, as red, green and blue",
            Self::Cells => "surfaces by cell, grey outside; outlines of portals, open ones green, shut ones red",
            Self::Openness => "how much of the sky's light reaches the surface, 0 black to 1 white",
            Self::ErrorBound => "upper bound of the luminance that is left out, 0.001 blue to 10 red, none grey",
        }
    }

    /// The outline of a portal that is open, linear RGB.
    pub const OPEN_PORTAL: Vec3 = Vec3::new(0.1, 0.9, 0.2);
    /// The outline of one that is shut.
    pub const SHUT_PORTAL: Vec3 = Vec3::new(0.9, 0.05, 0.03);

    /// Factor on the colours of surfaces in a cell, linear RGB. Hues go around by the golden ratio: those of
    /// neighbouring numbers lie far apart.
    pub fn cell_color(number: u32) -> Vec3 {
        let hue = (number as f32 * 0.618_034).fract();
        let part = |offset: f32| (((hue + offset).fract() * 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        Vec3::ONE.lerp(Vec3::new(part(0.0), part(2.0 / 3.0), part(1.0 / 3.0)), 0.7)
    }

    /// The tone map of its pictures: the scene's, or none.
    pub(crate) fn tone_map(self, environment: &Environment) -> ToneMap {
        if self == Self::Off { environment.tone_map } else { ToneMap::Clamp }
    }

    /// Legend of a heat map's colours; `None` for other views. `shaders/debug.wgsl` paints by the same scale.
    pub fn heat_scale(self) -> Option<HeatScale> {
        match self {
            Self::LightCount => {
                Some(HeatScale { what: "lights that reach the object", ticks: &["1", "2", "4", "8", "16", "32", "64"] })
            }
            Self::ErrorBound => Some(HeatScale {
                what: "brightness that may be left out; 1: white",
                ticks: &["0.001", "0.01", "0.1", "1", "10"],
            }),
            _ => None,
        }
    }
}

/// The legend of a heat map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HeatScale {
    /// The quantity.
    pub what: &'static str,
    /// Evenly spaced from the first colour to the last, which stand for what is beyond them, too; 0 is
    /// [`HeatScale::NONE`].
    pub ticks: &'static [&'static str],
}

impl HeatScale {
    /// The colour of 0, linear RGB.
    pub const NONE: Vec3 = Vec3::splat(0.2);

    /// The colour of a place on the scale, 0 the first tick to 1 the last; linear RGB.
    pub fn color(heat: f32) -> Vec3 {
        let h = heat.clamp(0.0, 1.0);
        Vec3::new(4.0 * h - 2.0, 2.0 - (4.0 * h - 2.0).abs(), 2.0 - 4.0 * h).clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// Occlusion culling: objects that others hide are left out. The picture is the same, except where two faces lie in one
/// plane: the one that is drawn first is in front, and objects that were seen before are drawn first.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Occlusion {
    /// Enabled for many objects. Frames that are written to files never use it, so that each depends on its scene
    /// alone.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

impl Occlusion {
    /// All choices with their names.
    pub const ALL: [(&'static str, Self); 3] = [("auto", Self::Auto), ("on", Self::On), ("off", Self::Off)];

    /// Tells if a view of so many objects is drawn in two phases.
    pub fn is_on(self, objects: u32) -> bool {
        match self {
            Self::Auto => objects >= FEW_OBJECTS,
            Self::On => true,
            Self::Off => false,
        }
    }
}

/// Fewer objects are drawn in one phase: the second costs more than it can save.
const FEW_OBJECTS: u32 = 4096;

/// Choices for a whole view.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Draws every material with this technique.
    pub technique: Option<Technique>,
    /// A debug view instead of the shaded picture.
    pub debug: DebugView,
    /// Levels of detail of distant meshes.
    pub levels: LevelOfDetail,
    /// Depths, normals and ids are of every mesh as it is, also where the picture is of other levels. Those of
    /// [`Renderer::draw_views`](crate::renderer::Renderer::draw_views) and its like.
    pub measures_whole: bool,
    /// Samples per pixel: 4, or 1 for comparing single samples.
    pub samples: u32,
    /// Specular antialiasing: highlights are as much wider as the normals within a pixel spread, those of bumps that
    /// smaller mip levels average away and those of the curved mesh.
    pub specular_aa: bool,
    /// The entity (its index) that debug views point out.
    pub picked_entity: Option<u32>,
    /// Occlusion culling.
    pub occlusion: Occlusion,
    /// Worlds of at most 2,048 objects and no cells are culled on the CPU: for small pictures, whose culling would take
    /// the GPU longer than their drawing. What is drawn is the same.
    pub few_on_cpu: bool,
    /// Point lights and spots that may have a shadow map at once: the most important ones of those that cast shadows.
    /// The four brightest directional lights have theirs besides. 0: no shadows at all; at most
    /// [`Self::MOST_SHADOW_MAPS`].
    pub shadow_maps: u32,
    /// Pixels along a side that the caller makes one of, at least 1. Shadow maps are as fine as such a one can show.
    pub oversampling: u32,
    /// Outputs that are drawn. Without the picture, its target stays as it is, or has undefined colours. Others are
    /// drawn with the picture where pixels have one sample each and no object is drawn with
    /// [`Technique::EmbossMultipass`], else in a pass after it.
    pub outputs: OutputSet,
}

impl Settings {
    /// The most that [`Self::shadow_maps`] can be.
    pub const MOST_SHADOW_MAPS: u32 = 240;

    /// For pictures that are written to files. In two phases, which of two faces in one plane is in front depends on
    /// what was seen before; such a picture depends on its scene alone.
    pub fn for_files(self) -> Self {
        let occlusion = if self.occlusion == Occlusion::Auto { Occlusion::Off } else { self.occlusion };
        Self { occlusion, ..self }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            technique: None,
            debug: DebugView::Off,
            levels: LevelOfDetail::default(),
            measures_whole: false,
            samples: 4,
            specular_aa: true,
            picked_entity: None,
            occlusion: Occlusion::Auto,
            few_on_cpu: false,
            shadow_maps: 32,
            oversampling: 1,
            outputs: OutputSet::COLOR,
        }
    }
}
