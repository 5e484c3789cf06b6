//! The figures of a suite as files: lines of JSON, a page of tables, and charts.

use super::grid::GridView;
use super::measurement::Measurement;
use super::plot::{Chart, Series, count};
use super::separate_process::Scene;
use super::sweeps::{Axis, Sweep};
use crate::name;
use crate::tools::error::ToolError;
use crate::tools::json_line;
use std::fmt::Write;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The file of a suite's results, which a later one can be compared with.
pub(super) const RESULTS: &str = "results.jsonl";
/// Slower by more than this share is worth a warning.
const WORTH_A_WARNING: f64 = 0.10;
/// Milliseconds that a median moves by itself: less is never worth one.
const NOISE_MS: f64 = 0.05;
/// No file of results is longer.
const MOST_BYTES: u64 = 64 << 20;

/// The results of an earlier suite.
pub(super) struct Earlier {
    path: PathBuf,
    results: Vec<Measurement>,
}

impl Earlier {
    /// Reads a `results.jsonl`.
    pub fn read(path: &Path) -> Result<Self, ToolError> {
        let refuse = |place: String, message: String| ToolError::Results { path: path.to_owned(), place, message };
        let mut text = String::new();
        let read = File::open(path).and_then(|file| file.take(MOST_BYTES).read_to_string(&mut text));
        read.map_err(|error| refuse("the file".into(), error.to_string()))?;
        let mut results = Vec::new();
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let place = format!("line {}", number + 1);
            // Not from_str: the reader of bytes is compiled for other files, too.
            let result: Measurement =
                serde_json::from_slice(line.as_bytes()).map_err(|error| refuse(place.clone(), error.to_string()))?;
            if result.objects == 0 || result.frames == 0 {
                return Err(refuse(place, "expected a line of figures as relief bench writes them".into()));
            }
            results.push(result);
        }
        if results.is_empty() {
            return Err(refuse(
                "the file".into(),
                "expected lines of figures as relief bench writes them, found none".into(),
            ));
        }
        Ok(Self { path: path.to_owned(), results })
    }
}

/// Everything that is written.
pub(super) struct Report<'a> {
    sweeps: &'a [Sweep],
    results: &'a [Measurement],
    earlier: Option<&'a Earlier>,
    slower: Vec<String>,
}

impl<'a> Report<'a> {
    pub fn new(sweeps: &'a [Sweep], results: &'a [Measurement], earlier: Option<&'a Earlier>) -> Self {
        let mut report = Self { sweeps, results, earlier, slower: Vec::new() };
        report.slower = report.pairs().flat_map(|(now, before)| slower(now, before)).collect();
        report
    }

    /// Figures that got slower, in words.
    pub fn slower(&self) -> &[String] {
        &self.slower
    }

    /// Names and contents.
    pub fn files(&self) -> Result<Vec<(&'static str, String)>, ToolError> {
        let mut lines = String::new();
        self.results.iter().for_each(|result| {
            let _ = writeln!(lines, "{}", json_line(result));
        });
        let mut files = vec![(RESULTS, lines)];
        for (axis, file, ..) in CHARTS {
            files.push((file, self.chart(axis).svg().map_err(|message| ToolError::Plot { file, message })?));
        }
        files.push(("report.md", self.page()));
        Ok(files)
    }

    fn result(&self, scene: &Scene) -> Option<&Measurement> {
        self.results.iter().find(|result| scene.is_of(result))
    }

    /// Every result with the earlier one of the same scene.
    fn pairs(&self) -> impl Iterator<Item = (&Measurement, &Measurement)> {
        let earlier = self.earlier.map(|earlier| earlier.results.as_slice()).unwrap_or_default();
        self.results.iter().filter_map(|now| Some((now, earlier.iter().find(|before| same_scene(now, before))?)))
    }

    fn chart(&self, axis: Axis) -> Chart<'_> {
        let mut series = Vec::new();
        for (i, sweep) in self.sweeps.iter().filter(|sweep| sweep.axis == axis).enumerate() {
            let points = |ms: &dyn Fn(&Measurement) -> f64| -> Vec<(f64, f64)> {
                let results = sweep.scenes.iter().filter_map(|scene| self.result(scene));
                results.map(|m| (place(axis, m), ms(m))).collect()
            };
            let name = sweep.scenes.first().map(describe).unwrap_or_default();
            series.push(Series { name: format!("frame, {name}"), points: points(&|m| m.frame_ms_median) });
            // The engine's work does not depend on size and view: one line says it.
            if i == 0 {
                series.push(Series { name: "engine (CPU)".into(), points: points(&|m| m.cpu_ms_median) });
            }
        }
        let (_, _, title, x_label) = CHARTS.into_iter().find(|chart| chart.0 == axis).unwrap_or(CHARTS[0]);
        Chart { title, x_label, x_logarithmic: axis != Axis::Moving, series }
    }

    fn page(&self) -> String {
        let mut page = String::from("# relief bench\n\n");
        if let Some(m) = self.results.first() {
            let build = &m.build;
            let commit = build.commit.as_deref().unwrap_or("unknown");
            let features = if build.target_features.is_empty() { "none" } else { &build.target_features.join(", ") };
            let _ = writeln!(page, "- adapter: {}\n- driver: {}", m.adapter, m.driver);
            let _ = writeln!(page, "- build: {} {}, commit {commit}, {}", build.version, build.profile, build.target);
            let _ = writeln!(page, "- target features beyond the base: {features}; worker threads: {}", m.threads);
            let [levels, blocks] = [m.levels, m.compress].map(|on| if on { "on" } else { "off" });
            let _ = writeln!(
                page,
                "- samples per pixel: {}; lights: {}; levels of detail: {levels}; occlusion: {}; textures in \
                 blocks: {blocks}; mesh: {}",
                m.samples, m.lights_policy, m.occlusion, m.mesh
            );
        }
        page += "\nMedians; times in milliseconds. *engine*: the CPU's work up to handing the frame in. *GPU*: from there until\n\
                 the GPU is idle. *floor* (where measured): the triangles in view\n\
                 by themselves, with the plainest shader. *bytes*: uploaded per frame. *memory*: the most the process had, MB.\n";
        for (axis, file, title, _) in CHARTS {
            let _ = write!(page, "\n## {title}\n\n![{title}]({file})\n");
            for sweep in self.sweeps.iter().filter(|sweep| sweep.axis == axis) {
                self.table(&mut page, sweep);
            }
        }
        self.memory(&mut page);
        self.comparison(&mut page);
        page
    }

    fn table(&self, page: &mut String, sweep: &Sweep) {
        let Some(first) = sweep.scenes.first() else { return };
        let _ = write!(
            page,
            "\n{}\n\n| {} | frame | 5 %–95 % | floor | engine | GPU | lights chosen | bytes | draws | drawn | culled | memory | first frame |\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
            describe(first),
            match sweep.axis {
                Axis::Objects => "objects",
                Axis::Lights => "lights",
                Axis::Moving => "moving",
            }
        );
        for m in sweep.scenes.iter().filter_map(|scene| self.result(scene)) {
            let at = place(sweep.axis, m);
            let at = if sweep.axis == Axis::Moving { format!("{at} %") } else { count(&at) };
            let floor = m.floor_ms_median.map_or(String::new(), ms);
            let memory = m.rss_mb.map_or("?".into(), |mb| format!("{mb:.0}"));
            let _ = writeln!(
                page,
                "| {at} | {} | {}–{} | {floor} | {} | {} | {} | {} | {} | {} | {} | {memory} | {:.0} |",
                ms(m.frame_ms_median),
                ms(m.frame_ms_p05),
                ms(m.frame_ms_p95),
                ms(m.cpu_ms_median),
                ms(m.gpu_ms_median),
                ms(m.select_ms_median),
                m.upload_bytes_median,
                m.draws,
                m.drawn_objects,
                m.culled_objects,
                m.first_frame_ms
            );
        }
    }

    /// Writes the memory of one more object, from the two scenes with most.
    fn memory(&self, page: &mut String) {
        let Some(sweep) = self.sweeps.iter().find(|sweep| sweep.axis == Axis::Objects) else { return };
        let known = sweep.scenes.iter().filter_map(|scene| self.result(scene));
        let known: Vec<(f64, f64)> = known.filter_map(|m| Some((f64::from(m.objects), m.rss_mb?))).collect();
        // Between fewer, what all scenes share would drown it.
        if let [.., (few, small), (many, large)] = known[..]
            && many - few >= 10_000.0
        {
            let bytes = (large - small) * f64::from(1 << 20) / (many - few);
            let _ = write!(
                page,
                "\n## Memory\n\n{bytes:.0} bytes per object, from {} to {} objects.\n",
                count(&few),
                count(&many)
            );
        }
    }

    fn comparison(&self, page: &mut String) {
        let Some(earlier) = self.earlier else { return };
        let _ = write!(page, "\n## Compared with {}\n\n", earlier.path.display());
        let mut pairs = self.pairs().peekable();
        let Some((now, before)) = pairs.peek() else {
            page.push_str("No scene is in both.\n");
            return;
        };
        if (&now.adapter, &now.driver, now.threads) != (&before.adapter, &before.driver, before.threads) {
            let _ = writeln!(page, "**Not the same machine**: {}, {} threads, then.\n", before.adapter, before.threads);
        }
        for warning in &self.slower {
            let _ = writeln!(page, "- **slower**: {warning}");
        }
        page.push_str("\nRatios: now / then, below 1 is faster.\n\n| scene | frame then | now | ratio | engine then | now | ratio |\n|---|---|---|---|---|---|---|\n");
        for (now, before) in pairs {
            let _ = writeln!(
                page,
                "| {} | {} | {} | {:.2} | {} | {} | {:.2} |",
                now.title(),
                ms(before.frame_ms_median),
                ms(now.frame_ms_median),
                now.frame_ms_median / before.frame_ms_median,
                ms(before.cpu_ms_median),
                ms(now.cpu_ms_median),
                now.cpu_ms_median / before.cpu_ms_median
            );
        }
    }
}

/// Axis, file, title, label.
const CHARTS: [(Axis, &str, &str, &str); 3] = [
    (Axis::Objects, "objects.svg", "Cost against objects", "objects"),
    (Axis::Lights, "lights.svg", "Cost against lights", "lights"),
    (Axis::Moving, "moving.svg", "Cost against the share that moves", "moving, %"),
];

/// Position of a result on the axis.
fn place(axis: Axis, m: &Measurement) -> f64 {
    match axis {
        Axis::Objects => m.objects.into(),
        Axis::Lights => m.lights.into(),
        Axis::Moving => m.moving_percent(),
    }
}

/// Names the view and size that tell the scenes of a sweep from others.
fn describe(scene: &Scene) -> String {
    format!("{} {}x{}", name::of(&GridView::ALL, scene.view), scene.size.0, scene.size.1)
}

fn same_scene(a: &Measurement, b: &Measurement) -> bool {
    let scene = |m: &Measurement| (m.objects, m.lights, m.mesh.clone(), m.moving, m.view.clone(), m.size);
    let drawn = |m: &Measurement| {
        let switches = (m.levels, m.occlusion.clone(), m.compress, m.hdr);
        (m.samples, m.lights_policy.clone(), m.technique.clone(), switches)
    };
    scene(a) == scene(b) && drawn(a) == drawn(b)
}

/// Figures of a scene that got slower.
fn slower(now: &Measurement, before: &Measurement) -> Vec<String> {
    let medians =
        [("frame", now.frame_ms_median, before.frame_ms_median), ("engine", now.cpu_ms_median, before.cpu_ms_median)];
    let worth = |now: f64, before: f64| now > before * (1.0 + WORTH_A_WARNING) && now - before > NOISE_MS;
    let worse = medians.into_iter().filter(|&(_, now, before)| worth(now, before));
    worse.map(|(what, t, then)| format!("{}: {what} {} ms, was {} ms", now.title(), ms(t), ms(then))).collect()
}

/// Three significant digits or so.
fn ms(value: f64) -> String {
    match value {
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v if v >= 1.0 => format!("{v:.2}"),
        v => format!("{v:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(frame: f64, engine: f64) -> Measurement {
        Measurement { objects: 10, frames: 1, frame_ms_median: frame, cpu_ms_median: engine, ..Measurement::default() }
    }

    #[test]
    fn a_tenth_more_is_worth_a_warning_unless_it_is_noise() {
        assert_eq!(slower(&figures(12.0, 1.0), &figures(10.0, 1.0)).len(), 1);
        assert_eq!(slower(&figures(12.0, 1.2), &figures(10.0, 1.0)).len(), 2);
        assert!(slower(&figures(10.9, 1.0), &figures(10.0, 2.0)).is_empty());
        assert!(slower(&figures(10.0, 0.03), &figures(10.0, 0.02)).is_empty());
    }

    #[test]
    fn lines_that_do_not_say_so_kept_colours_linear() {
        let now = figures(1.0, 1.0);
        let line = json_line(&now).replace("\"hdr\":false,", "");
        assert_ne!(line, json_line(&now));
        let before: Measurement = serde_json::from_slice(line.as_bytes()).expect("an earlier line");
        assert!(!same_scene(&now, &before));
        assert!(same_scene(&Measurement { hdr: true, ..now }, &before));
    }

    #[test]
    fn other_scenes_are_not_compared() {
        let (a, b) = (figures(1.0, 1.0), Measurement { moving: 0.5, ..figures(1.0, 1.0) });
        assert!(same_scene(&a, &a) && !same_scene(&a, &b));
    }
}
