//! How far a scene lit by three lights per object is from one lit by all: `relief lights`.
//!
//! One frame is drawn with each [`LightPolicy`]. Luminance is compared before the tone map, over the pixels that show
//! an object; FLIP compares the pictures as written, all of them.

use crate::compare::{self, LuminanceError};
use crate::frames::{self, FrameError, LoadOptions, Stage};
use crate::output;
use crate::renderer::{Gpu, OutputSet, Settings, SingleView};
use image::RgbImage;
use image::buffer::ConvertBuffer;
use std::fmt;
use std::path::{Path, PathBuf};
use systems::assets::Technique;
use systems::lights::{LightPolicies, LightPolicy, LightRecord};

/// What to compare.
#[derive(Clone, Debug)]
pub struct LightErrorJob {
    /// Scene file or model.
    pub scene: PathBuf,
    /// How the scene is loaded.
    pub load: LoadOptions,
    /// Where the pictures go; made if missing.
    pub folder: PathBuf,
    /// Steps of the clock before the picture.
    pub frame: u64,
    /// Pixels.
    pub size: (u32, u32),
    /// The name of the camera; `None`: the scene's first.
    pub camera: Option<String>,
    /// Draws every material with this technique.
    pub technique: Option<Technique>,
}

/// How far a policy is from [`LightPolicy::All`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PolicyError {
    /// Mean over the pixels that show an object of |L − L_all|, over the mean of L_all there.
    pub mean: f64,
    /// 99 % of those pixels are at most this far off.
    pub p99: f64,
    /// Mean FLIP of the tone-mapped pictures.
    pub flip: f64,
}

/// What was found.
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
    /// [`LightPolicy::Three`].
    pub three: PolicyError,
    /// [`LightPolicy::Hard`].
    pub hard: PolicyError,
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
        let Self { width, height, lights, object_pixels, mean_luminance, .. } = self;
        writeln!(f, "{}: frame {}, {width}x{height}, {lights} lights", self.scene.display(), self.frame)?;
        writeln!(f, "{object_pixels} pixels show objects, of mean luminance {mean_luminance:.4} by all lights")?;
        writeln!(f, "error     mean      p99     FLIP")?;
        for (name, PolicyError { mean, p99, flip }) in [("three", self.three), ("hard", self.hard)] {
            writeln!(f, "{name:<5} {mean:8.4} {p99:8.4} {flip:8.4}")?;
        }
        Ok(())
    }
}

/// A frame by one policy.
struct PolicyPicture {
    picture: RgbImage,
    luminances: Vec<f32>,
}

/// Draws a scene with all lights, three and hard, writes the pictures and says how far apart they are.
///
/// # Errors
/// [`FrameError`]; nothing is written before all pictures are drawn and compared.
pub fn measure(job: &LightErrorJob) -> Result<LightReport, FrameError> {
    compare::check_size(job.size)?;
    let mut stage = frames::load_stage(&job.scene, job.camera.as_deref(), &job.load)?;
    let pictures = ["all", "three", "hard", "three_error", "hard_error"].map(|name| picture(&job.folder, name));
    stage.check_outputs(|path| pictures.iter().any(|picture| output::is_same(path, picture)))?;
    let mut renderer = SingleView::new(&Gpu::headless()?);
    for _ in 0..job.frame {
        stage.simulation.step();
    }
    let settings = Settings { technique: job.technique, ..Settings::default() }.for_files();
    let mut draw = |policy| draw(&mut stage, &mut renderer, job.size, &settings, policy);
    let three = draw(LightPolicy::Three)?;
    let hard = draw(LightPolicy::Hard)?;
    let all = draw(LightPolicy::All)?;
    let outputs = renderer.draw_outputs(OutputSet { id: true, ..OutputSet::NONE });
    let ids = outputs.map(|outputs| outputs.entities()).unwrap_or_default();
    renderer.gpu().check()?;
    let shows_object: Vec<bool> = ids.iter().map(Option::is_some).collect();
    let records = &stage.simulation.draw_list().lights.records;

    let compared = |other: &PolicyPicture| -> Result<(PolicyError, LuminanceError), FrameError> {
        let error = compare::luminance_error(&all.luminances, &other.luminances, &shows_object);
        let flip = compare::flip(&all.picture, &other.picture)?;
        Ok((PolicyError { mean: error.mean, p99: error.p99, flip }, error))
    };
    let ((three_error, three_map), (hard_error, hard_map)) = (compared(&three)?, compared(&hard)?);
    let report = LightReport {
        scene: job.scene.clone(),
        frame: job.frame,
        width: job.size.0,
        height: job.size.1,
        lights: records.iter().filter(|record| record.kind != LightRecord::OFF).count(),
        object_pixels: shows_object.iter().filter(|shows| **shows).count(),
        mean_luminance: compare::mean_luminance(&all.luminances, &shows_object),
        three: three_error,
        hard: hard_error,
    };
    output::make_folder(&job.folder)?;
    for (name, of_policy) in [("all", all), ("three", three), ("hard", hard)] {
        write(&job.folder, name, of_policy.picture)?;
    }
    for (name, map) in [("three_error", three_map), ("hard_error", hard_map)] {
        let heat = compare::heat_map(&map.of_pixels, job.size.0, job.size.1).unwrap_or_default();
        write(&job.folder, name, heat)?;
    }
    Ok(report)
}

fn draw(
    stage: &mut Stage,
    renderer: &mut SingleView,
    size: (u32, u32),
    settings: &Settings,
    policy: LightPolicy,
) -> Result<PolicyPicture, FrameError> {
    stage.simulation.world.insert_resource(LightPolicies::forced(policy));
    stage.simulation.frame();
    let view = stage.viewpoint.view(&stage.simulation.world, size);
    stage.simulation.with_frame(|frame| renderer.prepare(frame, &view, settings))?;
    let picture = renderer.draw_picture().convert();
    let luminances = renderer.read_linear().unwrap_or_default().into_iter().map(compare::luminance).collect();
    renderer.gpu().check()?;
    Ok(PolicyPicture { picture, luminances })
}

fn picture(folder: &Path, name: &str) -> PathBuf {
    folder.join(name).with_extension("png")
}

fn write(folder: &Path, name: &str, picture: RgbImage) -> Result<(), FrameError> {
    Ok(output::write_png(&self::picture(folder, name), &picture.into())?)
}
