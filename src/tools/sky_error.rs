//! Error of a scene's sky light against rays: `relief sky`.
//!
//! One frame is drawn with one sample per pixel. The reference, `truth`, is the light of the sky's upper half on each
//! pixel's surface: of [`RAYS`] directions about its shading normal, those whose ray meets nothing that casts shadows.
//! Against it stand the same light as if nothing hid the sky, and by the openness that pictures are drawn with. Sun and
//! moon are not in it, nor what surfaces throw back.

use crate::frames::{self, FrameError};
use crate::problem::Problem;
use crate::renderer::{DebugView, OutputSet, Settings};
use crate::scene::SceneError;
use crate::tools::compare::PictureError;
use crate::tools::error::ToolError;
use crate::tools::frame_error::{Comparison, FrameErrorJob, Shot};
use crate::tools::traced::TracedScene;
use glam::{DVec3, Vec3};
use image::RgbImage;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use systems::assets::color::srgb_from_linear;
use systems::assets::levels::LevelOfDetail;
use systems::lights::LUMINANCE;
use systems::weather::Sky;

/// Rays of each pixel.
pub const RAYS: usize = 512;

/// Results of the comparison.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SkyReport {
    /// The scene.
    pub scene: PathBuf,
    /// Steps of the clock before the picture.
    pub frame: u64,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Pixels that show an object which the ray through their middle meets.
    pub object_pixels: usize,
    /// Mean illuminance by the sky over those pixels, lux.
    pub mean_lux: f64,
    /// Part of the sky's light that reaches them.
    pub open: f64,
    /// Nothing hides the sky.
    pub none: PictureError,
    /// Openness.
    pub openness: PictureError,
    /// Share that rays find, times the light that an open place has by three bands of harmonics.
    pub perfect: PictureError,
}

/// A table for people.
impl fmt::Display for SkyReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { width, height, object_pixels, mean_lux, open, .. } = self;
        writeln!(f, "{}: frame {}, {width}x{height}", self.scene.display(), self.frame)?;
        writeln!(f, "{object_pixels} pixels show objects, under {mean_lux:.4} lx of the sky, {open:.3} of all of it")?;
        writeln!(f, "error          mean      p99     FLIP")?;
        let rows = [("none", self.none), ("openness", self.openness), ("perfect", self.perfect)];
        for (name, PictureError { mean, p99, flip }) in rows {
            writeln!(f, "{name:<10} {mean:8.4} {p99:8.4} {flip:8.4}")?;
        }
        Ok(())
    }
}

/// Draws a scene's openness, finds by rays what it should be, writes pictures of the sky's light and says how far apart
/// they are.
///
/// # Errors
/// [`ToolError`], also where the sky is no atmosphere; nothing is written before all is compared.
pub fn measure(job: &FrameErrorJob) -> Result<SkyReport, ToolError> {
    let (width, height) = job.size;
    let (mut session, mut renderer) = job.begin("truth", &["none", "openness", "perfect"])?;
    session.simulation.frame();
    let Some(sky) = session.simulation.draw_list().sky.as_ref().map(|drawn| drawn.sky.clone()) else {
        let message = "expected weather with the sky of an atmosphere: the scene's sky is a gradient";
        return Err(FrameError::from(SceneError::from(Problem::error(&job.scene, message))).into());
    };
    let view = session.viewpoint.view(&session.simulation.world, job.size);
    let settings = Settings {
        technique: job.technique,
        debug: DebugView::Openness,
        levels: LevelOfDetail::OFF,
        samples: 1,
        ..Settings::default()
    };
    let settings = settings.for_files();
    session
        .simulation
        .with_frame(|frame| frames::with_slot_ids(frame, |frame| renderer.prepare(frame, &view, &settings)))?;
    renderer.draw_picture();
    let open = renderer.read_linear().unwrap_or_default();
    let outputs = renderer.draw_outputs(OutputSet { id: true, normal: true, ..OutputSet::NONE });
    renderer.gpu().check()?;
    let (shown, normals) = outputs.map(|outputs| (outputs.entities(), outputs.normals())).unwrap_or_default();
    let light = SkyLight::new(&sky);
    let traced = TracedScene::new(&session.simulation, &view);
    let seen = traced.seen_sky(&shown, &normals, |normal, is_free| light.seen(normal, is_free));

    let counted: Vec<bool> = seen.iter().map(Option::is_some).collect();
    let truth: Vec<f64> = seen.iter().map(|seen| seen.map_or(0.0, |[seen, _]| seen)).collect();
    let whole: Vec<f64> = normals.iter().map(|normal| light.upper(Vec3::from(*normal))).collect();
    let none: Vec<f64> =
        whole.iter().zip(&counted).map(|(whole, counted)| if *counted { *whole } else { 0.0 }).collect();
    let by_openness: Vec<f64> = none.iter().zip(&open).map(|(whole, open)| whole * f64::from(open[0])).collect();
    let share = |seen: &Option<[f64; 2]>| seen.map_or(0.0, |[seen, all]| seen / all.max(f64::MIN_POSITIVE));
    let perfect: Vec<f64> = none.iter().zip(&seen).map(|(whole, seen)| whole * share(seen)).collect();

    let count = counted.iter().filter(|counted| **counted).count();
    let mean_lux = truth.iter().sum::<f64>() / count.max(1) as f64;
    let all: f64 = seen.iter().flatten().map(|[_, all]| all).sum();
    // White where the sky has nothing in its way.
    let white = light.upper(Vec3::Y);
    let shot = |lux: &[f64]| shot(lux, white, job.size);
    let reference = shot(&truth);
    let mut compared = Comparison { job, reference, counted, pictures: Vec::new() };
    let report = SkyReport {
        scene: job.scene.clone(),
        frame: job.frame,
        width,
        height,
        object_pixels: count,
        mean_lux,
        open: truth.iter().sum::<f64>() / all.max(f64::MIN_POSITIVE),
        none: compared.add("none", shot(&none))?,
        openness: compared.add("openness", shot(&by_openness))?,
        perfect: compared.add("perfect", shot(&perfect))?,
    };
    compared.write("truth")?;
    Ok(report)
}

fn shot(lux: &[f64], white: f64, (width, height): (u32, u32)) -> Shot {
    let luminances: Vec<f32> = lux.iter().map(|lux| (lux / white) as f32).collect();
    let grey = |luminance: &f32| [(srgb_from_linear(luminance.clamp(0.0, 1.0)) * 255.0).round() as u8; 3];
    let picture = RgbImage::from_raw(width, height, luminances.iter().flat_map(grey).collect()).unwrap_or_default();
    Shot { picture, luminances }
}

/// Light of a sky's upper half.
struct SkyLight {
    sky: Arc<Sky>,
    /// Directions of a half sphere about +Y, of which each stands for as much of a diffuse surface's light.
    directions: Vec<DVec3>,
}

impl SkyLight {
    fn new(sky: &Arc<Sky>) -> Self {
        let direction = |number: usize| {
            let (sin, cos) = (2.399_963_229_728_653 * number as f64).sin_cos();
            let flat = ((number as f64 + 0.5) / RAYS as f64).sqrt();
            DVec3::new(flat * cos, (1.0 - flat * flat).sqrt(), flat * sin)
        };
        Self { sky: sky.clone(), directions: (0..RAYS).map(direction).collect() }
    }

    /// Illuminance of a surface with that normal, of what is free and of all: lux.
    fn seen(&self, normal: DVec3, mut is_free: impl FnMut(DVec3) -> bool) -> [f64; 2] {
        let (x, z) = normal.any_orthonormal_pair();
        let (mut seen, mut all) = (0.0, 0.0);
        for direction in &self.directions {
            let toward = x * direction.x + normal * direction.y + z * direction.z;
            if toward.y > 0.0 {
                let luminance = self.sky.luminance(toward);
                all += luminance;
                seen += if is_free(toward) { luminance } else { 0.0 };
            }
        }
        [seen, all].map(|sum| sum * std::f64::consts::PI / RAYS as f64)
    }

    /// Illuminance of a surface that sees all of the upper half, by harmonics: lux.
    fn upper(&self, normal: Vec3) -> f64 {
        self.sky.upper(normal.as_dvec3()).dot(LUMINANCE.as_dvec3()).max(0.0)
    }
}
