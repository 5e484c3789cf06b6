//! Results of a bake, and its report.

use crate::tools::maps::Raster;
use glam::Vec2;
use std::fmt;
use std::time::Duration;

/// Outcome of baking a texel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Coverage {
    /// It belongs to no chart.
    #[default]
    Outside,
    /// Its ray met nothing.
    Missed,
    /// Its ray met the fine mesh.
    Baked,
}

/// The maps; those that were not wanted are `None`.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Three channels: 0.5 + 0.5·n, tangent space, green up.
    pub normal: Option<Raster>,
    /// One channel: 0 deepest, 1 highest.
    pub height: Option<Raster>,
    /// One channel: 1 open, 0 shut in.
    pub occlusion: Option<Raster>,
    /// Outcome of each texel, before dilation.
    pub coverage: Vec<Coverage>,
    /// Counts and scales.
    pub report: Report,
}

impl Baked {
    /// One channel: 1 where a texel was baked, 0.5 where its ray met nothing, 0 beyond the charts.
    pub fn coverage_map(&self) -> Raster {
        let mut map = Raster::new(self.report.size.0, self.report.size.1, 1);
        let grey = |coverage: &Coverage| match coverage {
            Coverage::Outside => 0.0,
            Coverage::Missed => 0.5,
            Coverage::Baked => 1.0,
        };
        map.values = self.coverage.iter().map(grey).collect();
        map
    }
}

/// Counts and scales of a bake. Its text is what the command prints.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Report {
    /// Texels, width and height.
    pub size: (usize, usize),
    /// Triangles of the fine mesh.
    pub triangles: usize,
    /// Texels whose ray met the fine mesh.
    pub baked: usize,
    /// Texels of charts whose ray met nothing.
    pub missed: usize,
    /// Places of the first of them, in UVs.
    pub first_missed: Vec<Vec2>,
    /// Texels that several triangles claim.
    pub overlapping: usize,
    /// Triangles of the coarse mesh that have no area in the UVs.
    pub flat_triangles: usize,
    /// Texels beyond the charts, or missed, that were filled from their neighbours.
    pub dilated: usize,
    /// Rays cast, all kinds together.
    pub rays: u64,
    /// Duration of casting.
    pub casting: Duration,
    /// Metres of black and white in the height map, above the coarse mesh or above the patch's origin.
    pub height_range: (f32, f32),
    /// The lowest and highest that were met, metres.
    pub heights_met: (f32, f32),
    /// Metres of a width of the image, whose texels are square: the mean over the map in the middle; a twentieth of the
    /// map has less than the first, a twentieth more than the last.
    pub metres_per_width: (f32, f32, f32),
}

impl Report {
    /// The `height_scale_uv` of a material: depth from black to white in widths of the image.
    pub fn height_scale_uv(&self) -> f32 {
        (self.height_range.1 - self.height_range.0) / self.metres_per_width.1
    }

    /// The `height_rest` of a material: the grey at which the coarse mesh's surface lies.
    pub fn height_rest(&self) -> f32 {
        let (black, white) = self.height_range;
        if white > black { (-black / (white - black)).clamp(0.0, 1.0) } else { 0.5 }
    }

    /// Rays of a second, all threads together.
    pub fn rays_per_second(&self) -> f64 {
        self.rays as f64 / self.casting.as_secs_f64().max(1e-9)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (width, height) = self.size;
        let share = |count: usize| 100.0 * count as f64 / (self.baked + self.missed).max(1) as f64;
        writeln!(f, "map       {width}×{height} texels, from {} triangles", self.triangles)?;
        writeln!(f, "baked     {} texels, {} filled from their neighbours", self.baked, self.dilated)?;
        write!(f, "missed    {} texels, {:.2} %", self.missed, share(self.missed))?;
        if !self.first_missed.is_empty() {
            let places: Vec<String> =
                self.first_missed.iter().map(|uv| format!("({:.4}, {:.4})", uv.x, uv.y)).collect();
            write!(f, "; the first at UV {}", places.join(" "))?;
        }
        writeln!(f, "\noverlap   {} texels claimed by several triangles", self.overlapping)?;
        if self.flat_triangles > 0 {
            writeln!(f, "flat      {} triangles of the low-poly mesh have no area in the UVs", self.flat_triangles)?;
        }
        let ((black, white), (low, high)) = (self.height_range, self.heights_met);
        writeln!(f, "height    black {black} m, white {white} m; met {low:.5} to {high:.5} m")?;
        let (least, mean, most) = self.metres_per_width;
        write!(f, "material  height_scale_uv {:.6}, height_rest {:.6}", self.height_scale_uv(), self.height_rest())?;
        writeln!(f, "; the image is {mean:.5} m wide, mostly {least:.5} to {most:.5}")?;
        let (seconds, rate) = (self.casting.as_secs_f64(), self.rays_per_second() / 1e6);
        writeln!(f, "rays      {} in {seconds:.2} s, {rate:.2} million a second", self.rays)
    }
}
