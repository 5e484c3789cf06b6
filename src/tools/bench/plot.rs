//! Line charts as SVG.

use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Pixels.
const SIZE: (u32, u32) = (860, 480);
/// Pixels along the right edge.
const LEGEND: u32 = 210;
/// Told apart in print and by most colour-blind eyes (Okabe and Ito).
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// One line of a chart.
pub(super) struct Series {
    pub name: String,
    pub points: Vec<(f64, f64)>,
}

/// A chart of milliseconds against something.
pub(super) struct Chart<'a> {
    pub title: &'a str,
    pub x_label: &'a str,
    /// Else in even steps from 0.
    pub x_logarithmic: bool,
    pub series: Vec<Series>,
}

impl Chart<'_> {
    /// The chart as SVG; what could not be drawn, in words.
    pub fn svg(&self) -> Result<String, String> {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let (x_low, x_high) = range(points().map(|p| p.0));
        let (y_low, y_high) = range(points().map(|p| p.1));
        let y = (decade_below(y_low)..decade_below(y_high) * 10.0).log_scale();
        if self.x_logarithmic {
            let x = (x_low.max(1.0) * 0.9..x_high.max(1.0) * 1.1).log_scale();
            self.draw(x, y, &count)
        } else {
            self.draw(0.0..x_high.max(1e-3) * 1.02, y, &|x| format!("{x}"))
        }
    }

    fn draw<X, Y>(&self, x: X, y: Y, x_text: &dyn Fn(&f64) -> String) -> Result<String, String>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut svg = String::new();
        let drawn = (|| {
            let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
            area.fill(&WHITE)?;
            let (left, legend) = area.split_horizontally(SIZE.0 - LEGEND);
            let mut chart = ChartBuilder::on(&left)
                .caption(self.title, ("sans-serif", 20))
                .margin(12)
                .x_label_area_size(44)
                .y_label_area_size(64)
                .build_cartesian_2d(x, y)?;
            chart
                .configure_mesh()
                .x_desc(self.x_label)
                .y_desc("ms per frame")
                .x_label_formatter(&|x| x_text(x))
                .y_label_formatter(&|y| format!("{y}"))
                .light_line_style(BLACK.mix(0.06))
                .bold_line_style(BLACK.mix(0.16))
                .draw()?;
            for (i, (series, color)) in self.series.iter().zip(COLORS.iter().cycle()).enumerate() {
                let style = color.stroke_width(2);
                chart.draw_series(LineSeries::new(series.points.iter().copied(), style).point_size(3))?;
                let y = 60 + 22 * i as i32;
                legend.draw(&PathElement::new([(0, y), (20, y)], style))?;
                let text = TextStyle::from(("sans-serif", 14)).pos(Pos::new(HPos::Left, VPos::Center));
                legend.draw(&Text::new(series.name.as_str(), (28, y), text))?;
            }
            area.present()
        })();
        drawn.map_err(|error| error.to_string())?;
        Ok(svg)
    }
}

/// Least and greatest of some numbers above 0.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) =
        values.filter(|v| *v > 0.0).fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    if low <= high { (low, high) } else { (1.0, 1.0) }
}

fn decade_below(value: f64) -> f64 {
    10f64.powf(value.log10().floor())
}

/// 1000 → 1k.
pub(super) fn count(value: &f64) -> String {
    match *value {
        v if v >= 1e6 => format!("{}M", (v / 1e4).round() / 1e2),
        v if v >= 1e3 => format!("{}k", (v / 1e1).round() / 1e2),
        v => format!("{}", v.round()),
    }
}
