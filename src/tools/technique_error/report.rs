//! The figures for people and programs: a table, CSV, JSON, a chart.

use super::base_mesh::BaseMesh;
use crate::name;
use crate::tools::compare::PictureError;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::fmt::{self, Write};

/// The row of the displaced figure itself, drawn as an object like any other.
pub(super) const GEOMETRY: &str = "geometry";

/// Results of a technique.
#[derive(Clone, PartialEq, Debug, serde::Serialize)]
pub struct Row {
    /// Its name, or `geometry`.
    pub technique: &'static str,
    /// Against the truth.
    pub shadowed: PictureError,
    /// Against the truth without shadows.
    pub unshadowed: PictureError,
    /// The share of pixels where the sun would shine, did nothing stand in its way, and technique and truth disagree
    /// whether anything does. None for geometry, which is the truth here.
    pub shadows: Option<f64>,
    /// Milliseconds of a draw, the median.
    pub ms: f64,
    /// Over that of `off`.
    pub times_off: f64,
}

/// Results of a comparison.
#[derive(Clone, PartialEq, Debug, serde::Serialize)]
pub struct Report {
    /// Mesh that was bumped.
    pub figure: BaseMesh,
    /// Degrees between the line of sight and the vertical.
    pub angle: f32,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// The graphics adapter.
    pub adapter: String,
    /// Clock that measured the milliseconds.
    pub timed_by: &'static str,
    /// Triangles of the truth.
    pub triangles: usize,
    /// Pixels where truth and techniques show the figure.
    pub pixels: usize,
    /// Pixels, by their area, where only one does.
    pub silhouette_pixels: f64,
    /// Mean of L_truth over those of both.
    pub mean_luminance: f64,
    /// Techniques in the order of their history, then `geometry`.
    pub rows: Vec<Row>,
}

impl Report {
    /// The figures of a technique.
    pub fn row(&self, technique: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.technique == technique)
    }

    /// A header, and a line for each technique.
    pub fn csv(&self) -> String {
        let errors = |e: &PictureError| format!("{:.5},{:.5},{:.5}", e.mean, e.p99, e.flip);
        let mut text = String::from(
            "technique,shadowed_mean,shadowed_p99,shadowed_flip,unshadowed_mean,unshadowed_p99,unshadowed_flip,\
             wrong_shadows,ms,times_off\n",
        );
        for row in &self.rows {
            let shadows = row.shadows.map_or(String::new(), |share| format!("{share:.5}"));
            let (shadowed, unshadowed) = (errors(&row.shadowed), errors(&row.unshadowed));
            let _ = writeln!(
                text,
                "{},{shadowed},{unshadowed},{shadows},{:.4},{:.3}",
                row.technique, row.ms, row.times_off
            );
        }
        text
    }

    /// Error against cost as SVG; what could not be drawn, in words.
    pub(super) fn svg(&self) -> Result<String, String> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|error| error.to_string())?;
        Ok(svg)
    }

    fn draw(&self, svg: &mut String) -> Result<(), Box<dyn std::error::Error + '_>> {
        const SIZE: (u32, u32) = (900, 560);
        // Geometry costs far more where there is no GPU: it stands at the edge, with its cost beside it.
        let techniques = self.rows.iter().filter(|row| row.technique != GEOMETRY);
        let right = techniques.map(|row| row.times_off).fold(1.0, f64::max) * 1.12;
        let top = self.rows.iter().map(|row| row.shadowed.mean).fold(0.01, f64::max) * 1.08;
        let name = |row: &Row| match row.technique {
            GEOMETRY if row.times_off > right => format!("{GEOMETRY} (× {:.0})", row.times_off),
            name => name.to_owned(),
        };
        let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let caption = format!("error against cost: {}, seen at {}°", name::of(&BaseMesh::ALL, self.figure), self.angle);
        let mut chart = ChartBuilder::on(&area)
            .caption(caption, ("sans-serif", 22))
            .margin(12)
            .margin_right(170)
            .x_label_area_size(48)
            .y_label_area_size(68)
            .build_cartesian_2d(0.0..right, 0.0..top)?;
        chart
            .configure_mesh()
            .label_style(("sans-serif", 15))
            .x_desc("cost of a draw, times that of off")
            .y_desc("mean error of luminance")
            .x_label_formatter(&|x| format!("{x:.1}"))
            .y_label_formatter(&|y| format!("{y:.2}"))
            .light_line_style(BLACK.mix(0.06))
            .bold_line_style(BLACK.mix(0.16))
            .draw()?;
        let place = |row: &Row| chart.backend_coord(&(row.times_off.min(right), row.shadowed.mean));
        let places: Vec<(i32, i32)> = self.rows.iter().map(place).collect();
        for ((row, &(x, y)), (label_x, label_y)) in self.rows.iter().zip(&places).zip(label_places(&places)) {
            let color = if row.technique == GEOMETRY { RGBColor(213, 94, 0) } else { RGBColor(0, 114, 178) };
            area.draw(&PathElement::new([(x, y), (label_x - 3, label_y)], BLACK.mix(0.3)))?;
            area.draw(&Circle::new((x, y), 4, color.filled()))?;
            let text = TextStyle::from(("sans-serif", 15)).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(name(row), (label_x, label_y), text))?;
        }
        area.present()?;
        Ok(())
    }
}

/// Places the points' names beside them: moved up or down until none lies on another.
fn label_places(points: &[(i32, i32)]) -> Vec<(i32, i32)> {
    const LINE: i32 = 15;
    const WIDTH: i32 = 140;
    let mut placed: Vec<(i32, i32)> = Vec::new();
    for &(x, y) in points {
        let wanted = (0..40).map(|i| y + LINE / 3 * if i % 2 == 0 { i / 2 } else { -(i / 2 + 1) });
        let is_free = |y: &i32| placed.iter().all(|(px, py)| (px - x - 10).abs() > WIDTH || (py - y).abs() >= LINE);
        placed.push((x + 10, wanted.into_iter().find(is_free).unwrap_or(y)));
    }
    placed
}

/// A table for people.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { figure, angle, width, height, triangles, pixels, silhouette_pixels, mean_luminance, .. } = self;
        let figure = name::of(&BaseMesh::ALL, *figure);
        writeln!(f, "{figure} seen at {angle}°, {width}x{height}; the truth has {triangles} triangles")?;
        writeln!(
            f,
            "{pixels} pixels show both, of mean luminance {mean_luminance:.4}; {silhouette_pixels:.0} only one"
        )?;
        writeln!(f, "milliseconds by {} of {}", self.timed_by, self.adapter)?;
        writeln!(f, "                      shadowed                unshadowed")?;
        writeln!(f, "technique             mean     p99    FLIP    mean     p99    FLIP shadows      ms  × off")?;
        for row in &self.rows {
            let [s, u] = [row.shadowed, row.unshadowed];
            let shadows = row.shadows.map_or("-".to_owned(), |share| format!("{:.1} %", share * 100.0));
            write!(f, "{:<18} {:7.4} {:7.3} {:7.4}", row.technique, s.mean, s.p99, s.flip)?;
            write!(f, " {:7.4} {:7.3} {:7.4} {shadows:>7}", u.mean, u.p99, u.flip)?;
            writeln!(f, " {:7.3} {:6.2}", row.ms, row.times_off)?;
        }
        if self.row("perturbed_uv").is_some() {
            writeln!(f, "perturbed_uv mirrors its surroundings, which the truth does not: another surface")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_the_chart_do_not_lie_on_each_other() {
        let points = [(100, 100), (100, 100), (102, 104), (160, 98), (300, 100), (100, 240)];
        let labels = label_places(&points);
        for (i, a) in labels.iter().enumerate() {
            assert!((a.1 - points[i].1).abs() < 60);
            assert!(labels[..i].iter().all(|b| (a.0 - b.0).abs() > 140 || (a.1 - b.1).abs() >= 15), "{labels:?}");
        }
        assert_eq!(labels[0], (110, 100));
    }
}
