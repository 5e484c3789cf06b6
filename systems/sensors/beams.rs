//! The beams of lidars: where each looks, and when it fires.
//!
//! A lidar fires *columns*, one after the other around its axis; each column has the same beams, its *rings*. The axis
//! is up. Column 0 looks forward, and the columns turn clockwise, seen from above, as those of Velodyne and Ouster do.
//! A solid-state lidar's columns go from the left to the right of its field of view.
//!
//! Tables have the nominal angles of manuals. Real sensors are calibrated one by one: give theirs as [`Beams::List`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One beam of a column.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Beam {
    /// Angle above the horizontal plane.
    #[schemars(range(min = -90.0, max = 90.0), extend("unit" = "°"))]
    pub elevation_degrees: f32,
    /// From the column's direction, the way that the columns turn.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("unit" = "°"))]
    pub azimuth_degrees: f32,
    /// Height of its beginning above the sensor's origin.
    #[serde(default)]
    #[schemars(range(min = -10.0, max = 10.0), extend("unit" = "m"))]
    pub height: f32,
    /// Time after the column's first beam.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 10.0), extend("unit" = "s"))]
    pub delay: f32,
}

/// The beams of a lidar.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Beams {
    /// Velodyne VLP-16: −15° to 15° in steps of 2°, with vertical positions and firing times ("VLP-16 User Manual",
    /// 63-9243). Usual: 10 Hz, 1,800 columns, 100 m.
    Vlp16,
    /// Velodyne HDL-32E: −30⅔° to 10⅔° in steps of 1⅓°, with firing times ("HDL-32E User's Manual", 63-9113).
    /// Usual: 10 Hz, 2,170 columns, 100 m.
    Hdl32,
    /// Velodyne HDL-64E: 2° to −8⅓° in steps of ⅓°, below them −8.83° to −24.33° in steps of ½° ("HDL-64E User's
    /// Manual"). Usual: 10 Hz, 2,083 columns, 120 m.
    Hdl64,
    /// Ouster OS1 with 64 beams over 45° ("OS1 Datasheet"). Of every four beams one looks 4.23°, one 1.41°, one
    /// −1.41° and one −4.23° aside, as the metadata of such sensors say. Usual: 10 Hz, 1,024 columns, 120 m.
    #[serde(rename = "os1_64")]
    Os1With64,
    /// The same with 128 beams.
    #[serde(rename = "os1_128")]
    Os1With128,
    /// A solid-state lidar, which does not turn. A revolution is one pass over its field of view.
    Grid {
        /// Beams one above the other.
        #[schemars(range(min = 1))]
        rows: u16,
        /// Field of view across all columns.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 360, "unit" = "°"))]
        horizontal_degrees: f32,
        /// Field of view across all rows.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 180, "unit" = "°"))]
        vertical_degrees: f32,
    },
    /// Any others, in the order of their rings.
    List(#[schemars(length(min = 1, max = u16::MAX), extend("of" = "beams"))] Vec<Beam>),
}

impl Beams {
    /// The names of the models that have tables.
    pub const MODELS: [(&str, Self); 5] = [
        ("vlp16", Self::Vlp16),
        ("hdl32", Self::Hdl32),
        ("hdl64", Self::Hdl64),
        ("os1_64", Self::Os1With64),
        ("os1_128", Self::Os1With128),
    ];

    /// The beams of a column by ring: in tables and grids the lowest first.
    pub fn rings(&self) -> Vec<Beam> {
        match self {
            Self::Vlp16 => (0..16).map(vlp16).collect(),
            Self::Hdl32 => (0..32).map(hdl32).collect(),
            Self::Hdl64 => (0..64).map(hdl64).collect(),
            Self::Os1With64 => (0..64).map(|ring| os1(ring, 64)).collect(),
            Self::Os1With128 => (0..128).map(|ring| os1(ring, 128)).collect(),
            Self::Grid { rows, vertical_degrees, .. } => {
                let at = |row| (f32::from(row) + 0.5) / f32::from(*rows) - 0.5;
                let beam = |row| Beam { elevation_degrees: at(row) * vertical_degrees, ..Beam::default() };
                (0..*rows).map(beam).collect()
            }
            Self::List(beams) => beams.clone(),
        }
    }

    /// Azimuth of a column among `columns`: degrees clockwise from forward, seen from above.
    pub fn column_degrees(&self, column: u32, columns: u32) -> f64 {
        let (column, columns) = (f64::from(column), f64::from(columns));
        match self {
            Self::Grid { horizontal_degrees, .. } => {
                ((column + 0.5) * 2.0 - columns) * f64::from(*horizontal_degrees) / (2.0 * columns)
            }
            _ => column / columns * 360.0,
        }
    }
}

/// Vertical corrections of the VLP-16's rings from −15° to −1°, millimetres; those above are their negatives in
/// reverse.
const VLP16_MILLIMETRES: [f32; 8] = [11.2, 9.7, 8.1, 6.6, 5.1, 3.7, 2.2, 0.7];

fn vlp16(ring: u8) -> Beam {
    let millimetres = match ring {
        0..8 => VLP16_MILLIMETRES[usize::from(ring)],
        _ => -VLP16_MILLIMETRES[usize::from(15 - ring)],
    };
    Beam {
        elevation_degrees: -15.0 + 2.0 * f32::from(ring),
        height: millimetres * 1e-3,
        delay: 2.304e-6 * f32::from(interleaved(ring, 16)),
        ..Beam::default()
    }
}

fn hdl32(ring: u8) -> Beam {
    Beam {
        elevation_degrees: (-92.0 + 4.0 * f32::from(ring)) / 3.0,
        delay: 1.152e-6 * f32::from(interleaved(ring, 32)),
        ..Beam::default()
    }
}

/// Firing order of a ring: the lowest one, the lowest of the upper half, the second lowest, and so on.
fn interleaved(ring: u8, rings: u8) -> u8 {
    let half = rings / 2;
    if ring < half { 2 * ring } else { 2 * (ring - half) + 1 }
}

fn hdl64(ring: u8) -> Beam {
    let elevation_degrees = match ring {
        0..32 => -24.33 + 0.5 * f32::from(ring),
        _ => (-25.0 + f32::from(ring - 32)) / 3.0,
    };
    Beam { elevation_degrees, ..Beam::default() }
}

fn os1(ring: u8, rings: u8) -> Beam {
    // The metadata count from the highest.
    let from_top = usize::from(rings - 1 - ring);
    Beam {
        elevation_degrees: 45.0 * (f32::from(ring) / f32::from(rings - 1) - 0.5),
        azimuth_degrees: [4.23, 1.41, -1.41, -4.23][from_top % 4],
        ..Beam::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::check::check;
    use crate::sensors::lidar::LidarSensor;

    fn degrees(beams: &Beams) -> Vec<f32> {
        beams.rings().iter().map(|beam| beam.elevation_degrees).collect()
    }

    #[test]
    fn tables_have_the_angles_of_their_manuals() {
        let counts = [("vlp16", 16, -15.0, 15.0), ("hdl32", 32, -30.67, 10.67), ("hdl64", 64, -24.33, 2.0)];
        let ouster = [("os1_64", 64, -22.5, 22.5), ("os1_128", 128, -22.5, 22.5)];
        for ((name, count, lowest, highest), (model, beams)) in counts.into_iter().chain(ouster).zip(Beams::MODELS) {
            let degrees = degrees(&beams);
            assert_eq!((name, degrees.len()), (model, count));
            assert!(degrees.is_sorted_by(|a, b| a < b), "{name}: {degrees:?}");
            // Manuals give two decimals.
            assert!((degrees[0] - lowest).abs() < 5e-3 && (degrees[count - 1] - highest).abs() < 5e-3, "{name}");
            assert_eq!(check(&LidarSensor { beams, ..LidarSensor::default() }), Ok(()));
        }
    }

    #[test]
    fn firing_orders_and_heights_are_those_of_the_manual() {
        let vlp16 = Beams::Vlp16.rings();
        let mut fired = vlp16.clone();
        fired.sort_by(|a, b| a.delay.total_cmp(&b.delay));
        // Lasers 0 to 3 and 15 of the manual's table.
        let of = |laser: usize| (fired[laser].elevation_degrees, (fired[laser].height * 1e4).round() / 10.0);
        assert_eq!([0, 1, 2, 3, 15].map(of), [(-15.0, 11.2), (1.0, -0.7), (-13.0, 9.7), (3.0, -2.2), (15.0, -11.2)]);
        assert!((fired[15].delay - 34.56e-6).abs() < 1e-9);
        let mut hdl32 = Beams::Hdl32.rings();
        hdl32.sort_by(|a, b| a.delay.total_cmp(&b.delay));
        let first = [0, 1, 2, 31].map(|laser| (hdl32[laser].elevation_degrees * 100.0).round() / 100.0);
        assert_eq!(first, [-30.67, -9.33, -29.33, 10.67]);
    }

    #[test]
    fn a_grid_s_beams_are_in_the_middles_of_equal_parts() {
        let grid = Beams::Grid { rows: 4, horizontal_degrees: 90.0, vertical_degrees: 20.0 };
        assert_eq!(degrees(&grid), [-7.5, -2.5, 2.5, 7.5]);
        assert_eq!([0, 1, 2].map(|column| grid.column_degrees(column, 3)), [-30.0, 0.0, 30.0]);
        assert_eq!([0, 1, 2, 3].map(|column| Beams::Vlp16.column_degrees(column, 4)), [0.0, 90.0, 180.0, 270.0]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let steep = Beam { elevation_degrees: 91.0, ..Beam::default() };
        let cases = [
            (Beams::List(vec![]), "beams: expected from 1 to 65535 beams, found 0"),
            (
                Beams::List(vec![Beam::default(), steep]),
                "beams[1].elevation_degrees: expected a number from -90 to 90, found 91",
            ),
            (
                Beams::Grid { rows: 1, horizontal_degrees: f32::NAN, vertical_degrees: 1.0 },
                "beams.horizontal_degrees: expected a number above 0, at most 360, found NaN",
            ),
        ];
        for (beams, expected) in cases {
            let fault = check(&LidarSensor { beams, ..LidarSensor::default() }).expect_err("a fault");
            assert_eq!(fault.to_string(), expected);
        }
    }
}
