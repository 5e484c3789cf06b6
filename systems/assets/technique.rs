//! The bump techniques: their names, the maps they go by, and what they write.

use super::material::MapSlot;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A way to bump a surface. A choice of pipeline, not a branch in a shader. `docs/techniques.md` tells what each does.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Technique {
    /// The interpolated vertex normal.
    Off,
    /// Tangent-space normal map.
    #[default]
    Normal,
    /// Blinn 1978: the normal perturbed by the height map's slope, from screen-space derivatives; needs no tangents.
    PerturbedNormal,
    /// Difference of two heights, one of them shifted toward the light; diffuse only.
    Emboss,
    /// The same in several passes that are blended, as it was done before shaders.
    EmbossMultipass,
    /// Light vectors per vertex, packed to 8 bits, dotted with the normal map.
    Dot3,
    /// The same with one light vector for the whole object.
    Dot3Constant,
    /// Environment-mapped bump mapping: the offset map shifts the look-up into the environment, or into what lies
    /// behind.
    PerturbedUv,
    /// Parallax with offset limiting, then the normal map.
    Parallax,
    /// Ray march through the height map, with the surface's own shadows, then the normal map.
    Relief,
    /// Normal map, with shadows by the horizon maps.
    Horizon,
    /// `Parallax` with shadows by the horizon maps.
    ParallaxHorizon,
    /// `Relief` with shadows by the horizon maps rather than by a march to each light.
    ReliefHorizon,
    /// `Parallax` that writes the displaced depth.
    ZCorrectParallax,
    /// `Relief` that writes the displaced depth.
    ZCorrect,
    /// `ReliefHorizon` that writes the displaced depth.
    Combined,
}

impl Technique {
    /// All techniques with the names that scene files and the command line use.
    pub const ALL: [(&'static str, Self); 16] = [
        ("off", Self::Off),
        ("emboss", Self::Emboss),
        ("emboss_multipass", Self::EmbossMultipass),
        ("dot3", Self::Dot3),
        ("dot3_constant", Self::Dot3Constant),
        ("normal", Self::Normal),
        ("perturbed_normal", Self::PerturbedNormal),
        ("perturbed_uv", Self::PerturbedUv),
        ("parallax", Self::Parallax),
        ("relief", Self::Relief),
        ("horizon", Self::Horizon),
        ("parallax_horizon", Self::ParallaxHorizon),
        ("relief_horizon", Self::ReliefHorizon),
        ("z_correct_parallax", Self::ZCorrectParallax),
        ("z_correct", Self::ZCorrect),
        ("combined", Self::Combined),
    ];

    /// The maps without which it leaves the surface smooth.
    pub fn needs(self) -> &'static [MapSlot] {
        use MapSlot::{Height, Horizon0, Horizon1, Normal, Offset};
        match self {
            Self::Off | Self::Normal => &[],
            Self::Dot3 | Self::Dot3Constant => &[Normal],
            Self::PerturbedUv => &[Offset],
            Self::Horizon => &[Horizon0, Horizon1],
            Self::PerturbedNormal | Self::Emboss | Self::EmbossMultipass => &[Height],
            Self::Parallax | Self::Relief | Self::ZCorrectParallax | Self::ZCorrect => &[Height],
            Self::ParallaxHorizon | Self::ReliefHorizon | Self::Combined => &[Height, Horizon0, Horizon1],
        }
    }

    /// Tells if it displaces the depth that is written.
    pub fn writes_depth(self) -> bool {
        matches!(self, Self::ZCorrectParallax | Self::ZCorrect | Self::Combined)
    }

    /// The name that scene files and the command line use.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, technique)| *technique == self).map_or("", |(name, _)| name)
    }
}
