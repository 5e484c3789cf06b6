//! Points of a lidar as they are drawn over the scene.

use crate::app::sensors::choice::Choice;
use crate::data::pictures::PointValue;
use crate::sense::LidarCapture;
use egui::Color32;
use glam::{DVec3, Vec3};
use systems::sensors::Classes;

/// Most points of a lidar that are projected, painted and uploaded in each frame.
const MOST_DOTS: usize = 60_000;

/// The points of a lidar as they are drawn.
pub struct Dots {
    /// Origin of the places, scene coordinates.
    pub from: DVec3,
    /// Counting from there, with colours.
    pub places: Vec<(Vec3, Color32)>,
    /// Stride of the beams drawn.
    pub every: usize,
}

/// The greatest one (Euclid).
fn common_factor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_factor(b, a % b) }
}

impl Dots {
    /// Takes the returns of a scan, with the colours of a choice.
    pub fn new(lidar: &LidarCapture, choice: Option<Choice>, classes: &Classes) -> Self {
        let by = if let Some(Choice::Points(by)) = choice { by } else { PointValue::Height };
        let colors = by.colors(lidar, classes).colors;
        let (from, rings) = (lidar.poses[1].translation, lidar.rings());
        // No ring is left out: the steps have no factor in common with their number.
        let least = lidar.scan.len().div_ceil(MOST_DOTS).max(1);
        let every = (least..).find(|&every| common_factor(every, rings) == 1).unwrap_or(least);
        let columns = (0..lidar.columns.count).map(|i| (i as usize * rings, lidar.scene_from_column(i)));
        let places = columns.flat_map(|(first, scene_from_column)| {
            let beams = (first..first + rings).filter(|i| i.is_multiple_of(every) && lidar.scan.hit[*i] != 0);
            let colors = &colors;
            beams.map(move |i| {
                let place = scene_from_column.transform_point3(Vec3::from(lidar.scan.xyz[i]).as_dvec3()) - from;
                let [r, g, b] = colors[i];
                (place.as_vec3(), Color32::from_rgb(r, g, b))
            })
        });
        Self { from, places: places.collect(), every }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sense::{LidarScan, Pose};
    use glam::DQuat;
    use systems::sensors::LidarSensor;

    #[test]
    fn dots_are_where_their_columns_were() {
        // Two columns of one beam, 2 m ahead of a lidar that goes 4 m along X, far from the origin, and turns by 90°.
        let lidar = LidarSensor { columns: 2, hz: 1.0, ..LidarSensor::default() };
        let columns = lidar.columns_between(0, 1, 1.0);
        let begin = Pose { translation: DVec3::new(1e6, 0.0, 0.0), rotation: DQuat::IDENTITY };
        let end = Pose {
            translation: DVec3::new(1e6 + 4.0, 0.0, 0.0),
            rotation: DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2),
        };
        let scan = LidarScan {
            xyz: vec![[2.0, 0.0, 0.0]; 2],
            range: vec![2.0; 2],
            intensity: vec![1.0; 2],
            ring: vec![0; 2],
            time: vec![0.0, 0.5],
            entity: vec![0; 2],
            hit: vec![1, 1],
        };
        let capture = LidarCapture { scan, columns, poses: [begin, end], ..LidarCapture::default() };
        let dots = Dots::new(&capture, None, &Classes::default());
        let places: Vec<DVec3> = dots.places.iter().map(|(place, _)| dots.from + place.as_dvec3()).collect();
        // The second is fired half-way, turned by 45°.
        let aside = 2.0 * std::f64::consts::FRAC_1_SQRT_2;
        let expected = [DVec3::new(1e6, 0.0, 2.0), DVec3::new(1e6 + 2.0 + aside, 0.0, aside)];
        // Places count from the sensor: they round as numbers up to 4 do.
        assert!(places.iter().zip(&expected).all(|(place, at)| place.abs_diff_eq(*at, 1e-6)), "{places:?}");
    }

    #[test]
    fn of_many_beams_some_are_drawn_from_every_ring() {
        let count = 4 * MOST_DOTS;
        let rings = 64;
        let lidar = LidarSensor { columns: count as u32 / rings, hz: 1.0, ..LidarSensor::default() };
        let columns = lidar.columns_between(0, 1, 1.0);
        let beams = columns.count as usize * rings as usize;
        // Each ring at its own height.
        let scan = LidarScan {
            xyz: (0..beams).map(|i| [1.0, 0.0, (i % 64) as f32]).collect(),
            range: vec![1.0; beams],
            intensity: vec![1.0; beams],
            ring: (0..beams).map(|i| (i % 64) as u16).collect(),
            time: vec![0.0; beams],
            entity: vec![0; beams],
            hit: vec![1; beams],
        };
        let capture = LidarCapture { scan, columns, ..LidarCapture::default() };
        let dots = Dots::new(&capture, None, &Classes::default());
        assert!(dots.places.len() <= MOST_DOTS && dots.every == 5, "{} of {beams}", dots.places.len());
        let mut heights: Vec<u32> = dots.places.iter().map(|(place, _)| place.y.round() as u32).collect();
        heights.sort_unstable();
        heights.dedup();
        assert_eq!(heights.len(), 64);
    }
}
