//! The passes over a scene: what each writes, and by which entry points of the forward shader.

use super::emboss::EmbossPass;
use crate::renderer::gpu::formats::{HDR_FORMAT, ID_FORMAT, NORMAL_FORMAT};
use crate::renderer::plan::output_set::OutputSet;
use crate::renderer::plan::settings::DebugView;
use systems::assets::{AlphaMode, Shading, Technique};
use systems::draw::{LightFeatures, PipelineKey};

/// Pass of the forward shader, by its outputs.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Pass {
    /// Colour.
    Color {
        lights: LightFeatures,
        debug: DebugView,
        samples: u32,
        specular_aa: bool,
        shadows: Option<Shadows>,
        /// Outputs written beside the colour.
        beside: Attached,
        /// One of the passes of [`Technique::EmbossMultipass`], over what the pass without it drew.
        emboss: Option<EmbossPass>,
    },
    /// Outputs without colour.
    Outputs(Attached),
}

/// Source of a light's visibility at a pixel; without one, all of it is visible.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Shadows {
    /// Shadow maps.
    Maps,
    /// Rays.
    Traced,
}

/// The outputs that are attachments of a pass. Depth always is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(crate) struct Attached {
    pub normal: bool,
    pub id: bool,
}

impl Attached {
    /// Those of some outputs.
    pub fn of(outputs: OutputSet) -> Self {
        Self { normal: outputs.normal, id: outputs.id }
    }

    pub fn any(self) -> bool {
        self.normal || self.id
    }

    /// Their targets in the order of the shader's structs.
    fn targets(self, write_mask: wgpu::ColorWrites) -> [Option<wgpu::ColorTargetState>; 2] {
        let target = |format| wgpu::ColorTargetState { format, blend: None, write_mask };
        [self.normal.then_some(target(NORMAL_FORMAT)), self.id.then_some(target(ID_FORMAT))]
    }

    /// The targets of a pass that writes colour: it, and these beside it.
    pub fn targets_beside(
        self,
        color: wgpu::ColorTargetState,
        write_mask: wgpu::ColorWrites,
    ) -> Vec<Option<wgpu::ColorTargetState>> {
        let beside = if self.any() { self.targets(write_mask).to_vec() } else { Vec::new() };
        std::iter::once(Some(color)).chain(beside).collect()
    }
}

impl Pass {
    pub fn samples(self) -> u32 {
        match self {
            Self::Color { samples, .. } => samples,
            Self::Outputs(_) => 1,
        }
    }

    pub fn shadows(self) -> Option<Shadows> {
        match self {
            Self::Color { shadows, .. } => shadows,
            Self::Outputs(_) => None,
        }
    }

    /// The passes of [`Technique::EmbossMultipass`] that follow on it.
    pub fn emboss_passes(self) -> impl Iterator<Item = Self> {
        EmbossPass::all().filter_map(move |step| match self {
            Self::Color { lights, debug, samples, shadows, .. } => {
                let (beside, emboss) = (Attached::default(), Some(step));
                Some(Self::Color { lights, debug, samples, specular_aa: false, shadows, beside, emboss })
            }
            Self::Outputs(_) => None,
        })
    }

    /// The technique that objects of a technique are drawn with in this pass.
    pub fn technique(self, technique: Technique, alpha: AlphaMode, shading: Shading) -> Technique {
        // Passes add up over what is opaque.
        let passes = matches!(self, Self::Color { debug: DebugView::Off, .. });
        match technique {
            Technique::EmbossMultipass if !passes || alpha == AlphaMode::Blend || shading == Shading::Unlit => {
                Technique::Emboss
            }
            other => other,
        }
    }

    /// Tells if all that it draws of an object follows from where its triangles are: neither maps nor normals are read.
    pub fn draws_places_alone(self, alpha: AlphaMode, technique: Technique) -> bool {
        matches!(self, Self::Outputs(Attached { normal: false, .. }))
            && alpha == AlphaMode::Opaque
            && !technique.writes_depth()
    }

    /// The entry points of the forward shader.
    pub fn entry_points(self, key: PipelineKey) -> (&'static str, &'static str) {
        let technique = key.technique;
        match self {
            Self::Color { emboss: Some(_), .. } => ("vs_main", "fs_emboss"),
            Self::Outputs(_) if technique.writes_depth() => ("vs_main", "fs_z_correct_outputs"),
            Self::Outputs(_) if self.draws_places_alone(key.alpha, technique) => ("vs_ids", "fs_ids"),
            Self::Outputs(_) => ("vs_main", "fs_outputs"),
            Self::Color { .. } => match (technique, self.writes_outputs(key)) {
                (technique, false) if technique.writes_depth() => ("vs_main", "fs_z_correct"),
                (technique, true) if technique.writes_depth() => ("vs_main", "fs_z_correct_with_outputs"),
                (Technique::Dot3, false) => ("vs_dot3", "fs_dot3"),
                (Technique::Dot3, true) => ("vs_dot3", "fs_dot3_with_outputs"),
                (_, false) => ("vs_main", "fs_main"),
                (_, true) => ("vs_main", "fs_main_with_outputs"),
            },
        }
    }

    /// Tells if objects write outputs beside their colour. Blended ones do so afterwards: they hide by other rules than
    /// they blend by.
    fn writes_outputs(self, key: PipelineKey) -> bool {
        matches!(self, Self::Color { beside, .. } if beside.any()) && key.alpha != AlphaMode::Blend
    }

    /// Colour target states of its attachments.
    pub fn targets(self, key: PipelineKey) -> Vec<Option<wgpu::ColorTargetState>> {
        let (all, none) = (wgpu::ColorWrites::ALL, wgpu::ColorWrites::empty());
        match self {
            Self::Outputs(attached) => attached.targets(all).to_vec(),
            Self::Color { emboss: Some(step), .. } => vec![Some(step.target())],
            Self::Color { beside, .. } => {
                let blend = (key.alpha == AlphaMode::Blend).then_some(wgpu::BlendState::ALPHA_BLENDING);
                let color = wgpu::ColorTargetState { format: HDR_FORMAT, blend, write_mask: all };
                beside.targets_beside(color, if self.writes_outputs(key) { all } else { none })
            }
        }
    }

    /// The sky that is drawn in a colour pass; in others it has no meaning.
    pub fn sky(self) -> SkyKey {
        let (beside, atmosphere) = match self {
            Self::Color { beside, lights, .. } => (beside, lights.atmosphere),
            Self::Outputs(_) => (Attached::default(), false),
        };
        SkyKey { samples: self.samples(), beside, atmosphere }
    }
}

/// Key of the sky's pipeline, from the pass of objects that the sky is drawn in.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct SkyKey {
    pub samples: u32,
    pub beside: Attached,
    pub atmosphere: bool,
}
