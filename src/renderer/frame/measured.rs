//! Plans of views whose pictures and measurements are drawn of different levels of detail.
//!
//! A picture may be off by a pixel's part, and is cheaper so. Depths, normals and ids are to be those of the meshes as
//! they are ([`Settings::measures_whole`]). So such a view is drawn as two, which differ in their outputs and levels.

use crate::renderer::plan::output_set::OutputSet;
use crate::renderer::plan::settings::Settings;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::views::outputs::Outputs;
use systems::assets::levels::LevelOfDetail;
use systems::draw::FrameData;

/// Plans as they are drawn, and which of them make up one that was asked for.
#[derive(Debug)]
pub(crate) struct DrawnPlans {
    pub plans: Vec<ViewPlan>,
    /// By plan as it is drawn: the place of that which was asked for.
    pub asked: Vec<usize>,
}

impl DrawnPlans {
    /// `has_levels`: whether some mesh that is drawn has levels of detail.
    pub fn new(asked: &[ViewPlan], has_levels: bool) -> Self {
        let mut drawn = Self { plans: Vec::new(), asked: Vec::new() };
        for (place, plan) in asked.iter().enumerate() {
            let mut add = |settings| {
                drawn.plans.push(ViewPlan { settings, ..plan.clone() });
                drawn.asked.push(place);
            };
            let settings = plan.settings;
            let measured = settings.outputs.beside_color();
            if !settings.measures_whole || !settings.levels.enabled || !has_levels || measured == OutputSet::NONE {
                add(settings);
                continue;
            }
            let picture = settings.outputs.without(measured);
            if picture != OutputSet::NONE {
                add(Settings { outputs: picture, ..settings });
            }
            // Nothing is shaded, so it needs one sample and no shadows.
            add(Settings { outputs: measured, levels: LevelOfDetail::OFF, shadow_maps: 0, samples: 1, ..settings });
        }
        drawn
    }

    /// Outputs of the plans that were asked for.
    pub fn join(&self, drawn: Vec<Outputs>) -> Vec<Outputs> {
        let mut joined: Vec<Outputs> = Vec::new();
        let mut last = None;
        for (&asked, outputs) in self.asked.iter().zip(drawn) {
            match joined.last_mut().filter(|_| last == Some(asked)) {
                Some(picture) => {
                    *picture = Outputs {
                        picture: picture.picture.take(),
                        linear: std::mem::take(&mut picture.linear),
                        ..outputs
                    };
                }
                None => joined.push(outputs),
            }
            last = Some(asked);
        }
        joined
    }
}

/// Tells if some opaque object of a frame has a mesh with levels of detail.
pub(crate) fn has_levels(frame: &FrameData<'_>) -> bool {
    let mesh = |batch: &systems::draw::Batch| frame.library.mesh(batch.key.mesh);
    frame.list.batches.iter().filter_map(mesh).any(|entry| entry.levels.len() > 1)
}
