//! Files of the KITTI data set (Geiger, Lenz, Urtasun, "Are we ready for Autonomous Driving? The KITTI Vision Benchmark
//! Suite", CVPR 2012), as the readme files of its development kits define them. Its cameras look along z, with x to
//! the right and y down; its lidar has x forward, y left, z up.

use super::array::{Column, interleave};
use std::f64::consts::{PI, TAU};
use std::io::Result;

/// An object in a picture: a line of `label_2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Label<'a> {
    /// `Car`, `Pedestrian`, `Cyclist` and others: one word.
    pub class: &'a str,
    /// Share of it outside of the picture, from 0 to 1.
    pub truncated: f64,
    /// Level of occlusion: [`occluded`].
    pub occluded: u8,
    /// The angle at which it is seen, in radians: [`alpha`].
    pub alpha: f64,
    /// Left, top, right, bottom in pixels, whose centres are the integers from 0: [`inclusive`].
    pub bbox: [f64; 4],
    /// Height, width, length in metres.
    pub size: [f64; 3],
    /// The middle of its lower face in the camera's axes: x, y, z in metres.
    pub location: [f64; 3],
    /// Its turn about the camera's y, in radians: [`rotation_y`].
    pub rotation_y: f64,
}

impl Label<'_> {
    /// The line, with a line feed. Lengths are given to a tenth of a millimetre. Spaces in the class become `_`.
    pub fn line(&self) -> String {
        let words: Vec<&str> = self.class.split_whitespace().collect();
        let class = if words.is_empty() { "Misc".to_owned() } else { words.join("_") };
        let mut line = format!("{class} {:.4} {} {:.4}", self.truncated, self.occluded, self.alpha);
        let (bbox, size, location) = (&self.bbox[..], &self.size[..], &self.location[..]);
        for value in [bbox, size, location, &[self.rotation_y]].concat() {
            line += &format!(" {value:.4}");
        }
        line + "\n"
    }
}

/// Level of occlusion, from the visible share of an object: 0 fully visible, 1 partly occluded, 2 largely occluded.
/// KITTI's people judged by eye; here the borders are 0.8 and 0.4.
pub fn occluded(visible: f32) -> u8 {
    match visible {
        seen if seen > 0.8 => 0,
        seen if seen > 0.4 => 1,
        _ => 2,
    }
}

/// The last two numbers of a box count the last pixels, where those of edges count what is beyond them.
pub fn inclusive([left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
    [left, top, right - 1.0, bottom - 1.0]
}

/// The turn about the camera's y of what looks along `forward` (x, y, z in the camera's axes): 0 along x.
pub fn rotation_y(forward: [f64; 3]) -> f64 {
    (-forward[2]).atan2(forward[0])
}

/// The same turn, seen along the ray to a place in the camera's axes; between −π and π.
pub fn alpha(rotation_y: f64, location: [f64; 3]) -> f64 {
    let turn = rotation_y - location[0].atan2(location[2]);
    turn - TAU * ((turn + PI) / TAU).floor()
}

/// A depth of the depth benchmark: 256 steps a metre, 0 for nothing and for what is farther than 255.99 m.
pub fn depth_steps(metres: f32) -> u16 {
    if metres < 255.99 { (metres * 256.0).round() as u16 } else { 0 }
}

/// A flow of the flow benchmark, as a pixel of 16 bits: 64 steps a pixel from 2¹⁵, right and down, and whether it is
/// valid. All is 0 where it is not, and where it is 512 pixels or more.
pub fn flow_steps([right, down]: [f32; 2], is_valid: bool) -> [u16; 3] {
    let steps = [right, down].map(|pixels| (pixels * 64.0 + 32_768.0).round());
    let fits = steps.iter().all(|steps| (0.0..=65_535.0).contains(steps));
    if is_valid && fits { [steps[0] as u16, steps[1] as u16, 1] } else { [0; 3] }
}

/// A scan of a lidar: x, y, z in metres and the reflectance from 0 to 1 of each point, as floats.
///
/// # Errors
/// More or fewer reflectances than points.
pub fn velodyne(points: &[[f32; 3]], reflectance: &[f32]) -> Result<Vec<u8>> {
    let columns = [Column::new("xyz", &[3], points.as_flattened()), Column::new("reflectance", &[], reflectance)];
    interleave(points.len(), &columns)
}

/// Calibration of cameras and lidar: `calib/NNNNNN.txt`. Matrices have their rows first, and lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Pixels of cameras 0 to 3, of places in the axes of camera 0: 3×4.
    pub projections: [[f64; 12]; 4],
    /// Rotation from the axes of camera 0 to those that the pictures are aligned with: 3×3.
    pub rectification: [f64; 9],
    /// Axes of camera 0 of those of the lidar: 3×4.
    pub camera_from_lidar: [f64; 12],
    /// Axes of the lidar of those of the inertial unit: 3×4.
    pub lidar_from_imu: [f64; 12],
}

impl Calibration {
    /// The file. Each number has as many digits as give it back.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |name: &str, matrix: &[f64]| {
            text += &format!("{name}:");
            matrix.iter().for_each(|value| text += &format!(" {value:e}"));
            text += "\n";
        };
        for (camera, projection) in self.projections.iter().enumerate() {
            line(&format!("P{camera}"), projection);
        }
        line("R0_rect", &self.rectification);
        line("Tr_velo_to_cam", &self.camera_from_lidar);
        line("Tr_imu_to_velo", &self.lidar_from_imu);
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_line_has_the_fifteen_fields_in_their_order() {
        let label = Label {
            class: "Person sitting",
            truncated: 0.5,
            occluded: 1,
            alpha: -1.57,
            bbox: [599.41, 156.4, 629.75, 189.25],
            size: [2.85, 2.63, 12.34],
            location: [0.47, 1.49, 69.44],
            rotation_y: -1.56,
        };
        let expected = "Person_sitting 0.5000 1 -1.5700 599.4100 156.4000 629.7500 189.2500 2.8500 2.6300 12.3400 \
                        0.4700 1.4900 69.4400 -1.5600\n";
        assert_eq!(label.line(), expected);
        assert!(Label { class: " ", ..label }.line().starts_with("Misc 0.5"));
    }

    #[test]
    fn turns_are_about_the_axis_that_points_down() {
        // Along x, away from the camera, along −x, toward it.
        let directions = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
        let turns = directions.map(rotation_y).map(|turn| (turn / FRAC_PI_2).round() as i32);
        assert_eq!([turns[0], turns[1], turns[2].abs(), turns[3]], [0, -1, 2, 1]);
        // What is seen from behind is so at every place: it looks along the ray.
        for x in [-30.0, -1.0, 0.0, 5.0] {
            let turn = rotation_y([x, 0.0, 10.0]);
            assert!((alpha(turn, [x, 1.5, 10.0]) + FRAC_PI_2).abs() < 1e-12);
        }
        // 3 − (−1) = 4 is 4 − 2π.
        assert!((alpha(3.0, [-1.0_f64.tan(), 0.0, 1.0]) - (4.0 - TAU)).abs() < 1e-12);
    }

    #[test]
    fn steps_of_depth_and_flow_are_those_of_the_benchmarks() {
        let depths = [0.0, 1.0, 2.001, 255.98, 255.99, f32::INFINITY, f32::NAN, -1.0];
        assert_eq!(depths.map(depth_steps), [0, 256, 512, 65_531, 0, 0, 0, 0]);
        assert_eq!(flow_steps([0.0, 0.0], true), [32_768, 32_768, 1]);
        assert_eq!(flow_steps([1.5, -0.25], true), [32_864, 32_752, 1]);
        assert_eq!(flow_steps([1.5, -0.25], false), [0; 3]);
        assert_eq!(flow_steps([-512.0, 511.98], true), [0, 65_535, 1]);
        assert_eq!(flow_steps([512.0, 0.0], true), [0; 3]);
        assert_eq!(flow_steps([f32::NAN, 0.0], true), [0; 3]);
        assert_eq!([1.0, 0.8, 0.5, 0.4, 0.0].map(occluded), [0, 1, 1, 2, 2]);
        assert_eq!(inclusive([3.0, 4.0, 5.0, 6.0]), [3.0, 4.0, 4.0, 5.0]);
    }
}
