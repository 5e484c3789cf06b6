//! Outputs of cameras as pictures, and points of lidars from above.

use super::colors::{Scale, rgb_of_class, rgb_of_number, rgb_of_panoptic, rgb_of_shift, srgb};
use crate::export::picture::rgb_of_normal;
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::flow::{Flow, flags};
use crate::sense::captures::lidar::LidarCapture;
use glam::Vec2;
use half::f16;
use image::{Rgb, RgbImage};
use systems::sensors::{CameraOutput, Classes};

/// Painting of a sensor's values, and what its colours mean.
#[derive(Clone, PartialEq, Debug)]
pub struct Picture {
    /// 8-bit sRGB, rows from the top.
    pub image: RgbImage,
    /// `None` where colours stand for no amount.
    pub scale: Option<Scale>,
}

impl Picture {
    /// An output of a camera, whole; of large pictures each n-th pixel, so that no side is longer than `longest`,
    /// colours as their mean. `None` where the output was not captured.
    pub fn of_camera(camera: &CameraCapture, output: CameraOutput, classes: &Classes, longest: u32) -> Option<Self> {
        let grid = Grid::new((camera.width, camera.height), longest);
        let distances = |metres: &[f32]| {
            let scale = Scale::of_distances(metres.iter().copied());
            let color = |i: usize| scale.map_or([0; 3], |scale| scale.color(metres[i]));
            (grid.picture(metres.len(), color), scale)
        };
        let numbers = |numbers: &[u32]| grid.picture(numbers.len(), |i| rgb_of_number(numbers[i]));
        let (image, scale) = match output {
            CameraOutput::Color => (grid.means(&camera.color), None),
            CameraOutput::Linear => {
                let color = |i: usize| srgb(camera.linear[i].map(f16::to_f32));
                (grid.picture(camera.linear.len(), color), None)
            }
            CameraOutput::Depth => distances(&camera.depth),
            CameraOutput::Range => distances(&camera.range),
            CameraOutput::Normal => (grid.picture(camera.normal.len(), |i| rgb_of_normal(camera.normal[i])), None),
            CameraOutput::Instance => (numbers(&camera.instance), None),
            CameraOutput::Part => (numbers(&camera.part), None),
            CameraOutput::Class => (grid.picture(camera.class.len(), |i| rgb_of_class(camera.class[i], classes)), None),
            CameraOutput::Boxes => (grid.boxes(camera, classes), None),
            CameraOutput::Flow => (grid.flow(&camera.flow), None),
            CameraOutput::FlowBack => (grid.flow(&camera.flow_back), None),
            CameraOutput::Panoptic => {
                let color = |i: usize| rgb_of_panoptic(camera.panoptic[i], classes);
                (grid.picture(camera.panoptic.len(), color), None)
            }
        };
        Some(Self { image: image?, scale })
    }

    /// The points of a lidar from above, forward up and left to the left, in a square of so many pixels whose sides are
    /// `reach` metres from its middle. Higher points hide lower ones. `None` where nothing was fired.
    pub fn from_above(lidar: &LidarCapture, by: PointValue, classes: &Classes, reach: f32, side: u32) -> Option<Self> {
        if lidar.scan.is_empty() {
            return None;
        }
        let PointColors { colors, scale } = by.colors(lidar, classes);
        let mut image = RgbImage::new(side, side);
        let mut height = vec![f32::NEG_INFINITY; side as usize * side as usize];
        for (i, [forward, left, up]) in returns(lidar) {
            let at = (Vec2::new(-left, -forward) / reach * 0.5 + 0.5) * side as f32;
            let is_inside = at.cmpge(Vec2::ZERO).all() && at.cmplt(Vec2::splat(side as f32)).all();
            let (x, y) = (at.x as u32, at.y as u32);
            if is_inside && let Some(highest) = height.get_mut((y * side + x) as usize).filter(|highest| up > **highest)
            {
                *highest = up;
                image.put_pixel(x, y, Rgb(colors[i]));
            }
        }
        Some(Self { image, scale })
    }
}

/// The beams with a return, and where.
fn returns(lidar: &LidarCapture) -> impl Iterator<Item = (usize, [f32; 3])> {
    let beams = lidar.scan.xyz.iter().zip(&lidar.scan.hit).enumerate();
    beams.filter(|(_, (_, hit))| **hit != 0).map(|(i, (xyz, _))| (i, *xyz))
}

/// Reach of a view from above around a lidar, metres, so that it has nine of ten points: 1, 2, 5, 10, 20 and so on.
pub fn reach_from_above(lidar: &LidarCapture) -> f32 {
    let mut across: Vec<f32> = returns(lidar).map(|(_, [x, y, _])| x.abs().max(y.abs())).collect();
    let place = across.len() * 9 / 10;
    let wanted = if across.is_empty() { 1.0 } else { *across.select_nth_unstable_by(place, f32::total_cmp).1 };
    let decades = (0..6).map(|decade| 10_f32.powi(decade));
    let rounded = decades.flat_map(|decade| [1.0, 2.0, 5.0].map(|digit| digit * decade));
    rounded.into_iter().find(|reach| *reach >= wanted).unwrap_or(1e6)
}

/// Painted pixels of a camera.
struct Grid {
    width: usize,
    height: usize,
    /// Each so-many-th, along both sides.
    every: usize,
}

impl Grid {
    fn new((width, height): (u32, u32), longest: u32) -> Self {
        let every = width.max(height).div_ceil(longest.max(1)).max(1);
        Self { width: width as usize, height: height as usize, every: every as usize }
    }

    /// By the places of pixels in arrays. `None` where there is not a value for each.
    fn picture(&self, values: usize, color: impl Fn(usize) -> [u8; 3]) -> Option<RgbImage> {
        if values == 0 || values != self.width * self.height {
            return None;
        }
        // The middle one of those that one stands for.
        let middle = |at: u32, side: usize| (at as usize * self.every + self.every / 2).min(side - 1);
        let painted = |side: usize| (side / self.every).max(1) as u32;
        Some(RgbImage::from_fn(painted(self.width), painted(self.height), |x, y| {
            Rgb(color(middle(y, self.height) * self.width + middle(x, self.width)))
        }))
    }

    /// Boxes of what is seen, in the colours of classes, on the colours if there are any.
    fn boxes(&self, camera: &CameraCapture, classes: &Classes) -> Option<RgbImage> {
        let blank = || self.picture(self.width * self.height, |_| [0; 3]);
        let mut image = self.means(&camera.color).or_else(blank)?;
        let (width, height) = image.dimensions();
        for one in camera.boxes.iter().filter(|one| one.pixels > 0) {
            let [left, top, right, bottom] = one.box_visible.map(|edge| edge as u32 / self.every as u32);
            let (right, bottom) =
                (right.clamp(left + 1, width.max(left + 1)) - 1, bottom.clamp(top + 1, height.max(top + 1)) - 1);
            let across = (left..=right).flat_map(|x| [(x, top), (x, bottom)]);
            let down = (top..=bottom).flat_map(|y| [(left, y), (right, y)]);
            for (x, y) in across.chain(down).filter(|(x, y)| *x < width && *y < height) {
                image.put_pixel(x, y, Rgb(rgb_of_class(one.class, classes)));
            }
        }
        Some(image)
    }

    /// Directions as hues, lengths as brightness up to the longest; black where there is none.
    fn flow(&self, flow: &Flow) -> Option<RgbImage> {
        let longest = flow.pixels.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f32::max);
        self.picture(flow.pixels.len(), |i| {
            let is_valid = flow.flags[i] & flags::VALID != 0;
            if is_valid { rgb_of_shift(flow.pixels[i], longest) } else { [0; 3] }
        })
    }

    /// Colours, each the mean of those that it stands for.
    fn means(&self, colors: &[[u8; 3]]) -> Option<RgbImage> {
        let (before, count) = (self.every / 2, (self.every * self.every) as u32);
        self.picture(colors.len(), |middle| {
            if self.every == 1 || self.every > self.width.min(self.height) {
                return colors[middle];
            }
            let first = middle - before * self.width - before;
            let rows = (0..self.every).map(|row| first + row * self.width);
            let block = rows.flat_map(|start| &colors[start..start + self.every]);
            let sum = block.fold([0; 3], |sum: [u32; 3], rgb| [0, 1, 2].map(|i| sum[i] + u32::from(rgb[i])));
            sum.map(|sum| ((sum + count / 2) / count) as u8)
        })
    }
}

/// Quantity that the colours of a lidar's points stand for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PointValue {
    /// Metres above the sensor.
    Height,
    /// Metres along the beam.
    Range,
    /// 0 to 1.
    Intensity,
    /// The beam's place in its column.
    Ring,
    /// Number of the thing.
    Instance,
    /// Semantic class.
    Class,
}

/// A colour for each beam, and what it stands for.
#[derive(Clone, PartialEq, Debug)]
pub struct PointColors {
    /// 8-bit sRGB; of no meaning where there is no return.
    pub colors: Vec<[u8; 3]>,
    /// `None` where colours stand for no amount.
    pub scale: Option<Scale>,
}

impl PointValue {
    /// All, with their names.
    pub const ALL: [(&'static str, Self); 6] = [
        ("height", Self::Height),
        ("range", Self::Range),
        ("intensity", Self::Intensity),
        ("ring", Self::Ring),
        ("instance", Self::Instance),
        ("class", Self::Class),
    ];

    /// The colours of a lidar's points.
    pub fn colors(self, lidar: &LidarCapture, classes: &Classes) -> PointColors {
        let scan = &lidar.scan;
        let of_returns = |value: &dyn Fn(usize) -> f32| returns(lidar).map(|(i, _)| value(i)).collect::<Vec<f32>>();
        let by_scale = |scale: Option<Scale>, value: &dyn Fn(usize) -> f32| {
            let color = |i| scale.map_or([0; 3], |scale: Scale| scale.color(value(i)));
            PointColors { colors: (0..scan.len()).map(color).collect(), scale }
        };
        let amounts = |value: &dyn Fn(usize) -> f32, unit| by_scale(Scale::of_amounts(of_returns(value), unit), value);
        match self {
            Self::Height => amounts(&|i| scan.xyz[i][2], " m"),
            Self::Range => by_scale(Scale::of_distances(of_returns(&|i| scan.range[i])), &|i| scan.range[i]),
            Self::Intensity => amounts(&|i| scan.intensity[i], ""),
            Self::Ring => amounts(&|i| f32::from(scan.ring[i]), ""),
            Self::Instance => PointColors {
                colors: lidar.instance.iter().map(|number| rgb_of_number(*number)).collect(),
                scale: None,
            },
            Self::Class => {
                let colors = lidar.class.iter().map(|class| rgb_of_class(*class, classes)).collect();
                PointColors { colors, scale: None }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::pictures::colors::VIRIDIS;
    use crate::sense::captures::lidar::LidarScan;
    use proptest::prelude::*;

    #[test]
    fn each_output_has_its_colours() {
        let classes = Classes::default();
        let camera = CameraCapture {
            width: 2,
            height: 1,
            color: vec![[1, 2, 3], [4, 5, 6]],
            linear: vec![[0.0, 1.0, 9.0].map(f16::from_f32), [0.5; 3].map(f16::from_f32)],
            depth: vec![2.0, f32::INFINITY],
            normal: vec![[0.0, 1.0, -1.0], [0.0; 3]],
            instance: vec![0, 7],
            class: vec![26, 1],
            panoptic: vec![26_001, 7],
            ..CameraCapture::default()
        };
        let painted = |output| {
            let picture = Picture::of_camera(&camera, output, &classes, 100);
            picture.map(|picture| [0, 1].map(|x| picture.image.get_pixel(x, 0).0))
        };
        assert_eq!(painted(CameraOutput::Color), Some([[1, 2, 3], [4, 5, 6]]));
        // sRGB of 0.5 is 1.055 · 0.5^(1/2.4) − 0.055 = 0.7354.
        assert_eq!(painted(CameraOutput::Linear), Some([[0, 255, 255], [188; 3]]));
        assert_eq!(painted(CameraOutput::Depth), Some([VIRIDIS[8], [0; 3]]));
        assert_eq!(painted(CameraOutput::Range), None, "not captured");
        assert_eq!(painted(CameraOutput::Normal), Some([[128, 255, 0], [0; 3]]));
        assert_eq!(painted(CameraOutput::Instance), Some([[0; 3], rgb_of_number(7)]));
        // A car; and the ego vehicle, whose own colour is black.
        assert_eq!(painted(CameraOutput::Class), Some([[0, 0, 142], rgb_of_number(1)]));
        assert_eq!(painted(CameraOutput::Panoptic), Some([rgb_of_number(26_001), [128, 64, 128]]));
        assert!(rgb_of_number(7) != rgb_of_number(8) && rgb_of_number(7) != [0; 3]);
    }

    #[test]
    fn points_are_seen_from_above_with_the_highest_on_top() {
        let scan = LidarScan {
            // Ahead, below it, to the left, without a return, behind and out of sight.
            xyz: vec![[5.0, 0.1, 2.0], [5.0, 0.1, 0.0], [-0.1, 5.0, 1.0], [9.0, 9.0, 9.0], [-11.0, 0.0, 0.0]],
            range: vec![1.0; 5],
            intensity: vec![1.0; 5],
            ring: vec![7, 3, 4, 1, 0],
            time: vec![0.0; 5],
            entity: vec![0; 5],
            hit: vec![1, 1, 1, 0, 1],
        };
        let lidar = LidarCapture { scan, ..LidarCapture::default() };
        let picture = Picture::from_above(&lidar, PointValue::Ring, &Classes::default(), 10.0, 4).expect("points");
        let painted = picture.image.enumerate_pixels().filter(|(.., rgb)| rgb.0 != [0; 3]);
        let painted: Vec<_> = painted.map(|(x, y, rgb)| (x, y, rgb.0)).collect();
        assert_eq!(painted, [(1, 1, VIRIDIS[8]), (1, 2, VIRIDIS[5])]);
        assert_eq!(reach_from_above(&lidar), 20.0);
        assert_eq!(picture.scale.map(|scale| (scale.least, scale.most)), Some((0.0, 7.0)));
        let nothing = LidarCapture::default();
        assert_eq!(Picture::from_above(&nothing, PointValue::Height, &Classes::default(), 1.0, 4), None);
        assert_eq!(reach_from_above(&nothing), 1.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Against every pixel of each block, added up.
        #[test]
        fn large_pictures_are_painted_smaller(width in 1_u32..40, height in 1_u32..40, longest in 1_u32..50) {
            let color: Vec<[u8; 3]> = (0..width * height).map(|i| [i as u8, (i * 7) as u8, (i / 3) as u8]).collect();
            let camera = CameraCapture { width, height, color: color.clone(), ..CameraCapture::default() };
            let picture = Picture::of_camera(&camera, CameraOutput::Color, &Classes::default(), longest);
            let image = picture.expect("captured").image;
            prop_assert!(image.width().max(image.height()) <= longest);
            let every = width.max(height).div_ceil(longest);
            if every > width.min(height) {
                return Ok(());
            }
            for (x, y, rgb) in image.enumerate_pixels() {
                let block = (0..every * every).map(|i| (x * every + i % every, y * every + i / every));
                let block: Vec<[u8; 3]> = block.map(|(x, y)| color[(y * width + x) as usize]).collect();
                let sum = |i: usize| block.iter().map(|rgb| f64::from(rgb[i])).sum::<f64>();
                let mean = [0, 1, 2].map(|i| sum(i) / block.len() as f64);
                let expected = mean.map(|mean| (mean + 0.5).floor() as u8);
                prop_assert_eq!(rgb.0, expected);
            }
        }
    }
}
