//! Error of a scene lit by some lights per object against one lit by all: `relief lights`.
//!
//! One frame is drawn as the scene has it, and with each [`LightPolicy`] for all objects; without shadows, whose error
//! `relief shadows` tells. Luminance is compared before the tone map, over the pixels that show an object; FLIP
//! compares the pictures as written, all of them. Seams are found where two pieces of one object meet: the renderer is
//! handed records with slots for ids, which tell them apart.

use crate::frames::FrameError;
use crate::renderer::{OutputSet, Settings, SingleView};
use crate::session::Session;
use crate::tools::compare::{self, PictureError, Shown};
use crate::tools::error::ToolError;
use crate::tools::frame_error::{self, Comparison, FrameErrorJob, Shot};
use bevy_ecs::entity::EntityIndex;
use bevy_ecs::world::World;
use image::buffer::ConvertBuffer;
use std::fmt;
use std::path::PathBuf;
use systems::draw::pieces::PieceOf;
use systems::lights::LightPolicy;

/// Error of a policy against [`LightPolicy::All`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PolicyError {
    /// Mean over the pixels that show an object of |L − L_all|, over the mean of L_all there.
    pub mean: f64,
    /// 99 % of those pixels are at most this far off.
    pub p99: f64,
    /// Mean FLIP of the tone-mapped pictures.
    pub flip: f64,
    /// Error at seams, where two pieces of one object meet. 99.9 % of the steps of (L − L_all) / mean L_all from pixel
    /// to pixel are at most this high; 0 without such pixels.
    pub seams: f64,
}

/// Results of the comparison.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct LightReport {
    /// The scene.
    pub scene: PathBuf,
    /// Steps of the clock before the picture.
    pub frame: u64,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Lights that are on.
    pub lights: usize,
    /// Pixels that show an object (their centre does).
    pub object_pixels: usize,
    /// Mean of L_all over those pixels: linear, exposed, before the tone map.
    pub mean_luminance: f64,
    /// Pairs of neighbouring pixels that show two pieces of one object.
    pub seam_pairs: usize,
    /// The policies that were compared, by name; in JSON an object for each.
    #[serde(flatten, serialize_with = "by_name")]
    pub policies: Vec<(&'static str, PolicyError)>,
}

fn by_name<S: serde::Serializer>(policies: &[(&'static str, PolicyError)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(policies.iter().copied())
}

/// A table for people.
impl fmt::Display for LightReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { width, height, lights, object_pixels, mean_luminance, seam_pairs, .. } = self;
        writeln!(f, "{}: frame {}, {width}x{height}, {lights} lights", self.scene.display(), self.frame)?;
        writeln!(f, "{object_pixels} pixels show objects, of mean luminance {mean_luminance:.4} by all lights")?;
        writeln!(f, "{seam_pairs} pairs of neighbouring pixels show two pieces of one object")?;
        writeln!(f, "error        mean      p99     FLIP    seams")?;
        for (name, PolicyError { mean, p99, flip, seams }) in &self.policies {
            writeln!(f, "{name:<8} {mean:8.4} {p99:8.4} {flip:8.4} {seams:8.4}")?;
        }
        Ok(())
    }
}

/// Draws a scene with all lights and by each policy, writes the pictures and says how far apart they are.
///
/// # Errors
/// [`ToolError`]; nothing is written before all pictures are drawn and compared.
pub fn measure(job: &FrameErrorJob) -> Result<LightReport, ToolError> {
    let (width, height) = job.size;
    let forced = LightPolicy::ALL.into_iter().filter(|(_, policy)| *policy != LightPolicy::All);
    let policies = std::iter::once(("default", None)).chain(forced.map(|(name, policy)| (name, Some(policy))));
    let policies: Vec<(&str, Option<LightPolicy>)> = policies.collect();
    let names: Vec<&str> = policies.iter().map(|(name, _)| *name).collect();
    let (mut session, mut renderer) = job.begin("all", &names)?;
    let all = draw(&mut session, &mut renderer, job, Some(LightPolicy::All))?;
    let outputs = renderer.draw_outputs(OutputSet { id: true, ..OutputSet::NONE });
    renderer.gpu().check()?;
    let slots = outputs.map(|outputs| outputs.entities()).unwrap_or_default();
    let (world, objects) = (&session.simulation.world, &session.simulation.draw_list().instances.objects);
    let shown: Vec<Option<Shown>> = slots.into_iter().map(|slot| shown(world, objects, slot?)).collect();
    let shows_object: Vec<bool> = shown.iter().map(Option::is_some).collect();
    let borders = compare::piece_borders(&shown, width as usize);
    let mut compared = Comparison { job, reference: all, counted: shows_object, pictures: Vec::new() };
    let mut report = LightReport {
        scene: job.scene.clone(),
        frame: job.frame,
        width,
        height,
        lights: frame_error::lights_on(&session.simulation),
        object_pixels: compared.counted.iter().filter(|shows| **shows).count(),
        mean_luminance: compare::mean_luminance(&compared.reference.luminances, &compared.counted),
        seam_pairs: borders.len(),
        policies: Vec::new(),
    };
    for (name, policy) in policies {
        let other = draw(&mut session, &mut renderer, job, policy)?;
        let seams = compare::seams(&compared.reference.luminances, &other.luminances, &compared.counted, &borders);
        let PictureError { mean, p99, flip } = compared.add(name, other)?;
        report.policies.push((name, PolicyError { mean, p99, flip, seams }));
    }
    compared.write("all")?;
    Ok(report)
}

/// Draws a frame by a policy, or as the scene has it.
fn draw(
    session: &mut Session,
    renderer: &mut SingleView,
    job: &FrameErrorJob,
    policy: Option<LightPolicy>,
) -> Result<Shot, FrameError> {
    frame_error::select_lights(session, policy);
    let view = session.viewpoint.view(&session.simulation.world, job.size);
    let settings = Settings { technique: job.technique, shadow_maps: 0, ..Settings::default() }.for_files();
    let (picture, luminances) = frame_error::draw(session, renderer, &view, &settings)?;
    Ok(Shot { picture: picture.convert(), luminances })
}

/// Object in a slot, and the piece of it that the slot holds.
fn shown(world: &World, objects: &[Option<EntityIndex>], slot: u32) -> Option<Shown> {
    let piece = objects.get(slot as usize).copied().flatten()?;
    let whole = world.get::<PieceOf>(world.entities().resolve_from_index(piece));
    Some(Shown { object: whole.map_or(piece.index(), |piece| piece.0.index_u32()), piece: piece.index() })
}
