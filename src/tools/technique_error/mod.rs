//! Error of each bump technique against what it imitates: `relief compare`.
//!
//! ```text
//! job         what to compare, on which base_mesh
//! maps        a height map, and what follows from it
//! test_scene  a world: one mesh, coarse as techniques have it and finely displaced; three lights, a camera
//! truth       the displaced mesh lit light by light, shadows traced → what techniques are measured by
//! cost        what a draw takes with each technique
//! report      a table, CSV, a chart
//! ```
//!
//! `docs/compare.md` says what is measured and how.

mod base_mesh;
mod cost;
mod job;
mod maps;
mod report;
mod test_scene;
mod truth;

pub use base_mesh::BaseMesh;
pub use job::{CompareJob, MOST_DEGREES, MOST_PIXELS};
pub use report::{Report, Row};

use crate::frames::FrameError;
use crate::output::{self, OutputError};
use crate::tools::compare::{self, CompareError, PictureError};
use crate::tools::error::ToolError;
use crate::tools::gallery::Sheet;
use image::RgbImage;
use std::path::PathBuf;
use systems::assets::Technique;
use test_scene::{Lit, Shown, TestScene};
use truth::Truth;

/// Draws the truth and every technique, writes the files and returns the figures. `progress` is told what is begun, how
/// many steps are done, and of how many.
///
/// # Errors
/// [`ToolError`]; nothing is written before all is drawn and compared.
pub fn measure(job: &CompareJob, mut progress: impl FnMut(&str, u64, u64)) -> Result<Report, ToolError> {
    let techniques = job.techniques();
    refuse_overwriting(job, &techniques)?;
    let steps = (techniques.len() + 4) as u64;
    progress("maps", 0, steps);
    let maps = maps::load(job)?;
    output::make_folder(&job.folder)?;
    output::check_writable(&job.folder)?;
    let mut stand = TestScene::new(job, maps)?;
    progress("truth", 1, steps);
    let truth = Truth::new(&mut stand, job.size)?;
    let coverage = stand.coverage(job.size)?;
    let counted: Vec<bool> = coverage.iter().zip(&truth.coverage).map(|(&c, &t)| c == 4 && t == 4).collect();
    let apart: u32 = coverage.iter().zip(&truth.coverage).map(|(c, t)| u32::from(c.abs_diff(*t))).sum();

    let judge = Judge { truth: &truth, counted: &counted, size: job.size };
    let mut drawn = Vec::new();
    for (i, &technique) in techniques.iter().enumerate() {
        progress(technique.name(), 2 + i as u64, steps);
        let linear = stand.linear(job.size, Shown::Coarse(technique), Lit::All)?;
        let sun = stand.sun_shadow(job.size, technique)?;
        drawn.push(judge.judge(technique.name(), linear, Some(sun))?);
    }
    let geometry = stand.linear(job.size, Shown::Displaced, Lit::All)?;
    drawn.push(judge.judge(report::GEOMETRY, geometry, None)?);

    progress("cost", steps - 2, steps);
    let shown: Vec<Shown> = techniques.iter().map(|&technique| Shown::Coarse(technique)).collect();
    let costs = cost::measure(&mut stand, job.size, &shown, cost::ROUNDS)?;
    let geometry = cost::measure(&mut stand, job.size, &[Shown::Displaced], cost::FEW_ROUNDS)?;
    let off = costs.ms.first().copied().unwrap_or(0.0).max(1e-9);
    let times = costs.ms.iter().copied().zip(costs.times_first.iter().copied());
    let times = times.chain(geometry.ms.iter().map(|&ms| (ms, ms / off)));
    for (judged, (ms, times_off)) in drawn.iter_mut().zip(times) {
        (judged.row.ms, judged.row.times_off) = (ms, times_off);
    }
    let report = Report {
        figure: job.figure,
        angle: job.angle,
        width: job.size.0,
        height: job.size.1,
        adapter: stand.adapter(),
        timed_by: costs.by,
        triangles: stand.triangles,
        pixels: counted.iter().filter(|counts| **counts).count(),
        silhouette_pixels: f64::from(apart) / 4.0,
        mean_luminance: compare::mean_luminance(&judge.luminances(&truth.shadowed), &counted),
        rows: drawn.iter().map(|drawn| drawn.row.clone()).collect(),
    };
    progress("files", steps - 1, steps);
    write(job, &report, &truth, &drawn)?;
    Ok(report)
}

/// Refuses inputs that [`write`] would overwrite.
fn refuse_overwriting(job: &CompareJob, techniques: &[Technique]) -> Result<(), FrameError> {
    let drawn = techniques.iter().map(|technique| technique.name()).chain([report::GEOMETRY]);
    let mut written: Vec<String> =
        drawn.flat_map(|name| [format!("{name}.png"), format!("{name}_error.png")]).collect();
    written.extend(["truth", "truth_unshadowed", "compare"].map(|name| format!("{name}.png")));
    let is_written = |input: &&PathBuf| written.iter().any(|name| output::is_same(&job.folder.join(name), input));
    match [&job.height, &job.normal, &job.base].into_iter().flatten().find(is_written) {
        Some(path) => Err(FrameError::Overwrites { path: path.clone() }),
        None => Ok(()),
    }
}

/// A technique's picture beside what is said of it.
struct Judged {
    row: Row,
    picture: RgbImage,
    error: Vec<f32>,
}

/// Compares with the truth.
struct Judge<'a> {
    truth: &'a Truth,
    counted: &'a [bool],
    size: (u32, u32),
}

impl Judge<'_> {
    fn luminances(&self, linear: &[glam::Vec3]) -> Vec<f32> {
        linear.iter().map(|color| compare::luminance(color.extend(1.0).to_array())).collect()
    }

    fn judge(
        &self,
        name: &'static str,
        linear: Vec<glam::Vec3>,
        sun: Option<Vec<Option<bool>>>,
    ) -> Result<Judged, ToolError> {
        let (shadowed, error) = self.errors(&self.truth.shadowed, &linear)?;
        let (unshadowed, _) = self.errors(&self.truth.unshadowed, &linear)?;
        let shadows = sun.map(|sun| self.wrong_shadows(&sun));
        let row = Row { technique: name, shadowed, unshadowed, shadows, ms: 0.0, times_off: 0.0 };
        Ok(Judged { row, picture: truth::encoded(&linear, self.size), error })
    }

    fn errors(&self, truth: &[glam::Vec3], linear: &[glam::Vec3]) -> Result<(PictureError, Vec<f32>), CompareError> {
        let error = compare::luminance_error(&self.luminances(truth), &self.luminances(linear), self.counted);
        // What does not count is black in both: FLIP is a mean over the whole picture.
        let masked = |linear: &[glam::Vec3]| {
            let kept = linear.iter().zip(self.counted).map(|(&c, &counts)| if counts { c } else { glam::Vec3::ZERO });
            truth::encoded(&kept.collect::<Vec<_>>(), self.size)
        };
        let counted = self.counted.iter().filter(|counts| **counts).count();
        let share = counted as f64 / self.counted.len().max(1) as f64;
        let flip = compare::flip(&masked(truth), &masked(linear))?;
        // Differences spread a little beyond the pixels that count: where those are few, to more than all of them.
        let flip = if counted > 0 { (flip / share).min(1.0) } else { 0.0 };
        Ok((PictureError { mean: error.mean, p99: error.p99, flip }, error.of_pixels))
    }

    /// Share of wrong shadows, where only one of the pictures has one. It counts pixels where the sun, without shadows,
    /// would light both.
    fn wrong_shadows(&self, sun: &[Option<bool>]) -> f64 {
        let pairs = sun.iter().zip(&self.truth.sun).zip(self.counted);
        let both: Vec<bool> =
            pairs.filter(|(_, counts)| **counts).filter_map(|((a, b), _)| Some((*a)? != (*b)?)).collect();
        both.iter().filter(|wrong| **wrong).count() as f64 / both.len().max(1) as f64
    }
}

fn write(job: &CompareJob, report: &Report, truth: &Truth, drawn: &[Judged]) -> Result<(), FrameError> {
    let file = |name: &str| job.folder.join(name);
    let picture = |name: &str, picture: &RgbImage| output::write_png(&file(name), &picture.clone().into());
    let shadowed = truth::encoded(&truth.shadowed, job.size);
    let mut sheet = Sheet::new(job.size, drawn.len() + 1);
    sheet.add(&shadowed);
    picture("truth.png", &shadowed)?;
    picture("truth_unshadowed.png", &truth::encoded(&truth.unshadowed, job.size))?;
    for Judged { row, picture: own, error } in drawn {
        sheet.add(own);
        picture(&format!("{}.png", row.technique), own)?;
        let heat = compare::heat_map(error, job.size.0, job.size.1).unwrap_or_default();
        picture(&format!("{}_error.png", row.technique), &heat)?;
    }
    picture("compare.png", &sheet.picture)?;
    output::write_whole(&file("compare.csv"), report.csv().as_bytes())?;
    let chart = report.svg().map_err(|message| {
        let source = std::io::Error::other(message);
        OutputError::Io { path: file("compare.svg"), source }
    })?;
    Ok(output::write_whole(&file("compare.svg"), chart.as_bytes())?)
}
