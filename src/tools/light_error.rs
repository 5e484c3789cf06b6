//! Error of a scene lit by some lights per object against one lit by all: `relief lights`.
//!
//! One frame is drawn as the scene has it, and with each [`LightPolicy`] for all objects; without shadows, whose error
//! `relief shadows` tells. Luminance is compared before the tone map, over the pixels that show an object; FLIP
//! compares the pictures as written, all of them. Seams are found where two pieces of one object meet: the renderer is
//! handed records with slots for ids, which tell them apart.

use crate::frames::{self, FrameError};
use crate::output;
use crate::renderer::{Gpu, OutputSet, Settings, SingleView};
use crate::session::Session;
use crate::tools::compare::{self, Shown};
use crate::tools::error::ToolError;
use crate::tools::frame_error::{self, FrameErrorJob};
use bevy_ecs::entity::EntityIndex;
use bevy_ecs::world::World;
use image::RgbImage;
use image::buffer::ConvertBuffer;
use std::fmt;
use std::path::PathBuf;
use systems::draw::pieces::PieceOf;
use systems::lights::{LightPolicies, LightPolicy};

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

impl LightReport {
    /// One line.
    pub fn json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
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

/// A frame by one policy.
struct PolicyPicture {
    picture: RgbImage,
    luminances: Vec<f32>,
}

/// Draws a scene with all lights and by each policy, writes the pictures and says how far apart they are.
///
/// # Errors
/// [`ToolError`]; nothing is written before all pictures are drawn and compared.
pub fn measure(job: &FrameErrorJob) -> Result<LightReport, ToolError> {
    compare::check_size(job.size)?;
    let (width, height) = job.size;
    let mut stage = frames::load_session(&job.scene, job.camera.as_deref(), &job.load)?;
    let forced = LightPolicy::ALL.into_iter().filter(|(_, policy)| *policy != LightPolicy::All);
    let policies =
        || std::iter::once(("default", None)).chain(forced.clone().map(|(name, policy)| (name, Some(policy))));
    let of_policies = policies().flat_map(|(name, _)| [name.to_owned(), error_name(name)]);
    let outputs: Vec<PathBuf> = of_policies.chain(["all".to_owned()]).map(|name| job.picture(&name)).collect();
    frames::check_outputs(&stage.scene.files, |path| outputs.iter().any(|picture| output::is_same(path, picture)))?;
    let mut renderer = SingleView::new(&Gpu::headless()?);
    for _ in 0..job.frame {
        stage.simulation.step();
    }
    let all = draw(&mut stage, &mut renderer, job, Some(LightPolicy::All))?;
    let outputs = renderer.draw_outputs(OutputSet { id: true, ..OutputSet::NONE });
    renderer.gpu().check()?;
    let slots = outputs.map(|outputs| outputs.entities()).unwrap_or_default();
    let (world, objects) = (&stage.simulation.world, &stage.simulation.draw_list().instances.objects);
    let shown: Vec<Option<Shown>> = slots.into_iter().map(|slot| shown(world, objects, slot?)).collect();
    let shows_object: Vec<bool> = shown.iter().map(Option::is_some).collect();
    let borders = compare::piece_borders(&shown, width as usize);
    let mut report = LightReport {
        scene: job.scene.clone(),
        frame: job.frame,
        width,
        height,
        lights: frame_error::lights_on(&stage.simulation),
        object_pixels: shows_object.iter().filter(|shows| **shows).count(),
        mean_luminance: compare::mean_luminance(&all.luminances, &shows_object),
        seam_pairs: borders.len(),
        policies: Vec::new(),
    };
    let mut pictures = Vec::new();
    for (name, policy) in policies() {
        let other = draw(&mut stage, &mut renderer, job, policy)?;
        let error = compare::luminance_error(&all.luminances, &other.luminances, &shows_object);
        let seams = compare::seams(&all.luminances, &other.luminances, &shows_object, &borders);
        let flip = compare::flip(&all.picture, &other.picture)?;
        report.policies.push((name, PolicyError { mean: error.mean, p99: error.p99, flip, seams }));
        let heat = compare::heat_map(&error.of_pixels, width, height).unwrap_or_default();
        pictures.extend([(name.to_owned(), other.picture), (error_name(name), heat)]);
    }
    pictures.push(("all".to_owned(), all.picture));
    output::make_folder(&job.folder)?;
    for (name, picture) in pictures {
        output::write_png(&job.picture(&name), &picture.into())?;
    }
    Ok(report)
}

/// Draws a frame by a policy, or as the scene has it, with slots for ids.
fn draw(
    stage: &mut Session,
    renderer: &mut SingleView,
    job: &FrameErrorJob,
    policy: Option<LightPolicy>,
) -> Result<PolicyPicture, FrameError> {
    stage.simulation.world.resource_mut::<LightPolicies>().forced = policy;
    stage.simulation.frame();
    let view = stage.viewpoint.view(&stage.simulation.world, job.size);
    let settings = Settings { technique: job.technique, shadow_maps: 0, ..Settings::default() }.for_files();
    stage
        .simulation
        .with_frame(|frame| frames::with_slot_ids(frame, |frame| renderer.prepare(frame, &view, &settings)))?;
    let picture = renderer.draw_picture().convert();
    let luminances = renderer.read_linear().unwrap_or_default().into_iter().map(compare::luminance).collect();
    renderer.gpu().check()?;
    Ok(PolicyPicture { picture, luminances })
}

/// Object in a slot, and the piece of it that the slot holds.
fn shown(world: &World, objects: &[Option<EntityIndex>], slot: u32) -> Option<Shown> {
    let piece = objects.get(slot as usize).copied().flatten()?;
    let whole = world.get::<PieceOf>(world.entities().resolve_from_index(piece));
    Some(Shown { object: whole.map_or(piece.index(), |piece| piece.0.index_u32()), piece: piece.index() })
}

fn error_name(policy: &str) -> String {
    format!("{policy}_error")
}
