//! Error of a scene's shadows against those that rays find: `relief shadows`.
//!
//! One frame is drawn at twice the size with one sample per pixel; four samples are a pixel. The reference, `truth`,
//! has all lights, whatever cells there are, each where a ray from the surface reaches it. Against it stand the frame
//! without shadows, with shadow maps, and with the scene's own light policies, each light of an object shadowed as rays
//! find it. Figures are those of `light_error`.

use crate::frames::FrameError;
use crate::renderer::{OutputSet, Settings, SingleView, TracedShadows};
use crate::session::Session;
use crate::tools::compare::{self, PictureError, quarters};
use crate::tools::error::ToolError;
use crate::tools::frame_error::{self, Comparison, FrameErrorJob, Shot, select_lights};
use crate::tools::traced::{ObjectLights, Traced, TracedScene};
use image::RgbImage;
use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;
use systems::assets::color::{linear_from_srgb, srgb_from_linear};
use systems::assets::levels::LevelOfDetail;
use systems::cells::Cells;
use systems::draw::View;
use systems::lights::LightPolicy;

/// Results of the comparison.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ShadowReport {
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
    /// Pixels of which some sample shows an object.
    pub object_pixels: usize,
    /// Mean of L_truth over those pixels: linear, exposed, before the tone map.
    pub mean_luminance: f64,
    /// Samples at outlines whose object no ray met: they have no shadows in any picture.
    pub unmet_samples: usize,
    /// Lights that have a shadow map.
    pub mapped: u32,
    /// No shadows at all.
    pub unshadowed: PictureError,
    /// Shadow maps.
    pub maps: PictureError,
    /// Every light of an object's list as rays find it, without shadows in what is left out of the list.
    pub perfect: PictureError,
    /// Effect of cells; `None` without any.
    pub cells: Option<CellsReport>,
}

/// Effect of a scene's cells on its lights.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct CellsReport {
    /// No shadows and no cells.
    pub without: PictureError,
    /// Lights that reach an object: the mean of the objects that the picture shows.
    pub lights_per_object: f64,
    /// The same without cells.
    pub lights_per_object_without: f64,
    /// Pairs of an object and a light that by its cells does not reach it, though rays found a sample that it lights.
    pub left_out: usize,
}

/// A table for people.
impl fmt::Display for ShadowReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { width, height, lights, object_pixels, mean_luminance, unmet_samples, .. } = self;
        writeln!(f, "{}: frame {}, {width}x{height}, {lights} lights", self.scene.display(), self.frame)?;
        writeln!(f, "{object_pixels} pixels show objects, of mean luminance {mean_luminance:.4} with traced shadows")?;
        writeln!(f, "{} lights have a shadow map", self.mapped)?;
        writeln!(f, "{unmet_samples} of {} samples show an object that no ray met", 4 * width * height)?;
        writeln!(f, "error          mean      p99     FLIP")?;
        let without = self.cells.map(|cells| ("no cells", cells.without));
        let rows = [("unshadowed", self.unshadowed), ("maps", self.maps), ("perfect", self.perfect)];
        for (name, PictureError { mean, p99, flip }) in rows.into_iter().chain(without) {
            writeln!(f, "{name:<10} {mean:8.4} {p99:8.4} {flip:8.4}")?;
        }
        if let Some(CellsReport { lights_per_object, lights_per_object_without, left_out, .. }) = self.cells {
            writeln!(
                f,
                "{lights_per_object:.1} lights reach an object, {lights_per_object_without:.1} without cells; \
                 {left_out} that light it are left out"
            )?;
        }
        Ok(())
    }
}

/// Source of the lights' visibility.
#[derive(Clone, Copy)]
enum Shadows<'a> {
    /// Shadow maps, at most so many.
    Maps(u32),
    /// Rays.
    Traced(&'a TracedShadows),
}

/// Draws a scene with traced shadows, with at most `maps` shadow maps and without, writes the pictures and says how far
/// apart they are.
///
/// # Errors
/// [`ToolError`]; nothing is written before all pictures are drawn and compared.
pub fn measure(job: &FrameErrorJob, maps: u32) -> Result<ShadowReport, ToolError> {
    let (width, height) = job.size;
    let (mut session, mut renderer) = job.begin("truth", &["unshadowed", "maps", "perfect"])?;
    select_lights(&mut session, None);
    let view = session.viewpoint.view(&session.simulation.world, (2 * width, 2 * height));
    let mapped = draw(&mut session, &mut renderer, &view, job, Shadows::Maps(maps))?;
    let lights_with_maps = renderer.stats().shadows.lights;
    let unshadowed = draw(&mut session, &mut renderer, &view, job, Shadows::Maps(0))?;
    let ids = renderer.draw_outputs(OutputSet { id: true, ..OutputSet::NONE });
    renderer.gpu().check()?;
    let shown = ids.map(|ids| ids.entities()).unwrap_or_default();
    let rounding = renderer.gpu().vertex_rounding();
    let traced = TracedScene::new(&session.simulation, &view);
    let Traced { shadows, unmet } = traced.shadows(&session.simulation, &shown, rounding);
    let perfect = draw(&mut session, &mut renderer, &view, job, Shadows::Traced(&shadows))?;
    let with_cells = (!session.simulation.world.resource::<Cells>().is_empty()).then(|| {
        select_lights(&mut session, Some(LightPolicy::All));
        let reached = ObjectLights::new(&session.simulation);
        session.simulation.world.insert_resource(Cells::default());
        reached
    });
    let mut without = None;
    if with_cells.is_some() {
        select_lights(&mut session, None);
        without = Some(draw(&mut session, &mut renderer, &view, job, Shadows::Maps(0))?);
    }
    select_lights(&mut session, Some(LightPolicy::All));
    let Traced { shadows, .. } = traced.shadows(&session.simulation, &shown, rounding);
    let truth = draw(&mut session, &mut renderer, &view, job, Shadows::Traced(&shadows))?;

    let shows_object: Vec<bool> = quarters(&shown, width).map(|samples| samples.iter().any(Option::is_some)).collect();
    let mut compared = Comparison { job, reference: truth, counted: shows_object, pictures: Vec::new() };
    let cells = match (&with_cells, &without) {
        (Some(reached), Some(without)) => {
            let objects: BTreeSet<u32> = shown.iter().flatten().copied().collect();
            let mean = |lights: &ObjectLights| {
                let count: usize = objects.iter().map(|&slot| lights.of(slot).len()).sum();
                count as f64 / objects.len().max(1) as f64
            };
            Some(CellsReport {
                without: compared.error_of(without)?.0,
                lights_per_object: mean(reached),
                lights_per_object_without: mean(&ObjectLights::new(&session.simulation)),
                left_out: traced.left_out(&session.simulation, &shown, reached),
            })
        }
        _ => None,
    };
    let report = ShadowReport {
        scene: job.scene.clone(),
        frame: job.frame,
        width,
        height,
        lights: frame_error::lights_on(&session.simulation),
        object_pixels: compared.counted.iter().filter(|shows| **shows).count(),
        mean_luminance: compare::mean_luminance(&compared.reference.luminances, &compared.counted),
        unmet_samples: unmet,
        mapped: lights_with_maps,
        unshadowed: compared.add("unshadowed", unshadowed)?,
        maps: compared.add("maps", mapped)?,
        perfect: compared.add("perfect", perfect)?,
        cells,
    };
    compared.write("truth")?;
    Ok(report)
}

/// Draws the world's last frame, and makes pixels of its samples.
fn draw(
    session: &mut Session,
    renderer: &mut SingleView,
    view: &View,
    job: &FrameErrorJob,
    shadows: Shadows<'_>,
) -> Result<Shot, FrameError> {
    let (technique, levels) = (job.technique, LevelOfDetail::OFF);
    let (shadow_maps, traced) = match shadows {
        Shadows::Maps(most) => (most, None),
        Shadows::Traced(traced) => (0, Some(traced)),
    };
    // Maps are those of the picture by itself.
    let settings = Settings { technique, levels, samples: 1, shadow_maps, oversampling: 2, ..Settings::default() };
    let settings = settings.for_files();
    renderer.set_traced_shadows(traced)?;
    let (samples, luminances) = frame_error::draw(session, renderer, view, &settings)?;
    let (width, height) = job.size;
    // As the tone map does with the samples of a pixel: the mean of what each is shown as.
    let mean = |samples: [u8; 4]| {
        let sum: f32 = samples.iter().map(|&sample| linear_from_srgb(f32::from(sample) / 255.0)).sum();
        (srgb_from_linear(sum * 0.25) * 255.0).round() as u8
    };
    let colors: Vec<[u8; 3]> = samples.pixels().map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2]]).collect();
    let pixels = quarters(&colors, width).flat_map(|[a, b, c, d]| [0, 1, 2].map(|i| mean([a[i], b[i], c[i], d[i]])));
    Ok(Shot {
        picture: RgbImage::from_raw(width, height, pixels.collect()).unwrap_or_default(),
        luminances: quarters(&luminances, width).map(|samples| samples.iter().sum::<f32>() * 0.25).collect(),
    })
}
