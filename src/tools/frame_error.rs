//! Common parts of a frame's error figures: the choice of the frame, its pictures, and where they go.

use crate::frames::{self, FrameError};
use crate::output;
use crate::recording::RunFiles;
use crate::renderer::{Gpu, Settings, SingleView};
use crate::session::{LoadOptions, Session};
use crate::tools::compare::{self, CompareError, PictureError};
use crate::tools::error::ToolError;
use image::{RgbImage, RgbaImage};
use std::path::PathBuf;
use systems::Simulation;
use systems::assets::Technique;
use systems::draw::View;
use systems::lights::{LightPolicies, LightPolicy, LightRecord};

/// Settings of `relief lights`, `relief shadows` and `relief sky`.
#[derive(Clone, Debug)]
pub struct FrameErrorJob {
    /// Scene file or model.
    pub scene: PathBuf,
    /// Options of loading the scene.
    pub load: LoadOptions,
    /// Folder for the pictures; made if missing.
    pub folder: PathBuf,
    /// Steps of the clock before the picture.
    pub frame: u64,
    /// Pixels; of `relief shadows` each of four samples.
    pub size: (u32, u32),
    /// The name of the camera; `None`: the scene's first.
    pub camera: Option<String>,
    /// Draws every material with this technique.
    pub technique: Option<Technique>,
}

impl FrameErrorJob {
    /// Loads the scene and takes the steps. Before, makes sure that no picture overwrites an input: the reference, nor
    /// one of the others, each of which has a map of its error beside it.
    pub(crate) fn begin(&self, reference: &str, others: &[&str]) -> Result<(Session, SingleView), ToolError> {
        compare::check_size(self.size)?;
        let mut session = frames::load_session(&self.scene, self.camera.as_deref(), &self.load)?;
        let pictures = others.iter().flat_map(|name| [self.picture(name), self.error_map(name)]);
        let pictures: Vec<PathBuf> = pictures.chain([self.picture(reference)]).collect();
        frames::check_outputs(&session.scene.files, |path| {
            pictures.iter().any(|picture| output::is_same(path, picture))
        })?;
        session.begin(&RunFiles::default(), 0)?;
        let renderer = SingleView::new(&Gpu::headless()?);
        for _ in 0..self.frame {
            session.simulation.step();
        }
        Ok((session, renderer))
    }

    fn picture(&self, name: &str) -> PathBuf {
        self.folder.join(name).with_extension("png")
    }

    fn error_map(&self, name: &str) -> PathBuf {
        self.picture(&format!("{name}_error"))
    }
}

/// A picture, and the luminances that it was made of.
pub(crate) struct Shot {
    pub picture: RgbImage,
    pub luminances: Vec<f32>,
}

/// Pictures of a frame, and the one that they are compared with.
pub(crate) struct Comparison<'a> {
    pub job: &'a FrameErrorJob,
    pub reference: Shot,
    /// Pixels that count, as they show an object.
    pub counted: Vec<bool>,
    /// With the maps of their errors.
    pub pictures: Vec<(PathBuf, RgbImage)>,
}

impl Comparison<'_> {
    /// Adds a picture, and tells its error.
    pub fn add(&mut self, name: &str, shot: Shot) -> Result<PictureError, CompareError> {
        let (error, of_pixels) = self.error_of(&shot)?;
        let heat = compare::heat_map(&of_pixels, self.job.size.0, self.job.size.1).unwrap_or_default();
        self.pictures.extend([(self.job.picture(name), shot.picture), (self.job.error_map(name), heat)]);
        Ok(error)
    }

    /// Error of a picture, and that of each pixel.
    pub fn error_of(&self, shot: &Shot) -> Result<(PictureError, Vec<f32>), CompareError> {
        let error = compare::luminance_error(&self.reference.luminances, &shot.luminances, &self.counted);
        let flip = compare::flip(&self.reference.picture, &shot.picture)?;
        Ok((PictureError { mean: error.mean, p99: error.p99, flip }, error.of_pixels))
    }

    /// Writes all pictures.
    pub fn write(self, reference: &str) -> Result<(), ToolError> {
        output::make_folder(&self.job.folder)?;
        let reference = (self.job.picture(reference), self.reference.picture);
        for (path, picture) in self.pictures.into_iter().chain([reference]) {
            output::write_png(&path, &picture.into())?;
        }
        Ok(())
    }
}

/// Takes a frame with lights by a policy, or by those of the scene.
pub(crate) fn select_lights(session: &mut Session, policy: Option<LightPolicy>) {
    session.simulation.world.resource_mut::<LightPolicies>().forced = policy;
    session.simulation.frame();
}

/// Draws the world's last frame with slots for ids. Returns the picture, and its luminances before the tone map.
pub(crate) fn draw(
    session: &mut Session,
    renderer: &mut SingleView,
    view: &View,
    settings: &Settings,
) -> Result<(RgbaImage, Vec<f32>), FrameError> {
    session
        .simulation
        .with_frame(|frame| frames::with_slot_ids(frame, |frame| renderer.prepare(frame, view, settings)))?;
    let picture = renderer.draw_picture();
    let luminances = renderer.read_linear().unwrap_or_default().into_iter().map(compare::luminance).collect();
    renderer.gpu().check()?;
    Ok((picture, luminances))
}

/// Number of lights that are on in the last frame.
pub(crate) fn lights_on(simulation: &Simulation) -> usize {
    simulation.draw_list().lights.records.iter().filter(|light| light.kind() != LightRecord::OFF).count()
}
