//! Places on Earth by WGS 84: between latitude, longitude, altitude and coordinates that are fixed to the Earth (ECEF).

use glam::{DMat3, DVec3};

/// Ellipsoid's axes, metres, and flattening (NIMA TR8350.2, "Department of Defense World Geodetic System 1984", table
/// 3.1).
const EQUATORIAL: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;
const POLAR: f64 = EQUATORIAL * (1.0 - FLATTENING);
/// Squares of the first and second eccentricity.
const ECCENTRICITY: f64 = FLATTENING * (2.0 - FLATTENING);
const SECOND_ECCENTRICITY: f64 = ECCENTRICITY / ((1.0 - FLATTENING) * (1.0 - FLATTENING));

/// Rounds of Bowring's iteration. One is exact to 1e-9 rad near the ground; the error falls by some 1e-4 with each.
const ROUNDS: usize = 4;

/// A place on Earth.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Geodetic {
    /// North positive, −90 to 90.
    pub latitude_degrees: f64,
    /// East positive, −180 to 180.
    pub longitude_degrees: f64,
    /// Metres above the ellipsoid, along its normal.
    pub altitude: f64,
}

impl Geodetic {
    /// From the Earth's centre, metres: X to latitude and longitude 0, Z to the north pole (TR8350.2, equation 4-14).
    pub fn ecef(self) -> DVec3 {
        let (sin, cos) = self.latitude_degrees.to_radians().sin_cos();
        let (east, along) = self.longitude_degrees.to_radians().sin_cos();
        let curve = EQUATORIAL / (1.0 - ECCENTRICITY * sin * sin).sqrt();
        let flat = (curve + self.altitude) * cos;
        DVec3::new(flat * along, flat * east, (curve * (1.0 - ECCENTRICITY) + self.altitude) * sin)
    }

    /// The place of a point, metres from the Earth's centre (Bowring: "Transformation from spatial to geographical
    /// coordinates", Survey Review 23, 1976; iterated).
    pub fn from_ecef(point: DVec3) -> Self {
        let flat = point.x.hypot(point.y);
        // The parametric latitude.
        let mut beta = (EQUATORIAL * point.z).atan2(POLAR * flat);
        let mut latitude = beta;
        for _ in 0..ROUNDS {
            let (sin, cos) = beta.sin_cos();
            let above = point.z + SECOND_ECCENTRICITY * POLAR * sin.powi(3);
            latitude = above.atan2(flat - ECCENTRICITY * EQUATORIAL * cos.powi(3));
            let (sin, cos) = latitude.sin_cos();
            beta = ((1.0 - FLATTENING) * sin).atan2(cos);
        }
        let (sin, cos) = latitude.sin_cos();
        Self {
            latitude_degrees: latitude.to_degrees(),
            longitude_degrees: point.y.atan2(point.x).to_degrees(),
            // Of a point at altitude h: flat · cos + z · sin = h + a √(1 − e² sin²).
            altitude: flat * cos + point.z * sin - EQUATORIAL * (1.0 - ECCENTRICITY * sin * sin).sqrt(),
        }
    }

    /// From east, north and up there to coordinates that are fixed to the Earth: directions alone.
    pub fn ecef_from_enu(self) -> DMat3 {
        let (sin, cos) = self.latitude_degrees.to_radians().sin_cos();
        let (east, along) = self.longitude_degrees.to_radians().sin_cos();
        DMat3::from_cols(
            DVec3::new(-east, along, 0.0),
            DVec3::new(-sin * along, -sin * east, cos),
            DVec3::new(cos * along, cos * east, sin),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(latitude_degrees: f64, longitude_degrees: f64, altitude: f64) -> Geodetic {
        Geodetic { latitude_degrees, longitude_degrees, altitude }
    }

    #[test]
    fn known_places_have_their_coordinates() {
        let polar = 6_356_752.314_245; // TR8350.2, table 3.3
        let known = [
            (at(0.0, 0.0, 0.0), DVec3::new(EQUATORIAL, 0.0, 0.0), 1e-6),
            (at(0.0, 90.0, 100.0), DVec3::new(0.0, EQUATORIAL + 100.0, 0.0), 1e-6),
            (at(90.0, 0.0, 0.0), DVec3::new(0.0, 0.0, polar), 1e-6),
            (at(-90.0, 0.0, -50.0), DVec3::new(0.0, 0.0, 50.0 - polar), 1e-6),
            // u-blox: "Datum Transformations of GPS Positions", 1999, the worked example; millimetres, and seconds of
            // arc with five decimals.
            (
                at(34.0 + 0.001_74 / 3600.0, -(117.0 + 20.0 / 60.0 + 0.849_65 / 3600.0), 251.702),
                DVec3::new(-2_430_601.828, -4_702_442.703, 3_546_587.358),
                2e-3,
            ),
        ];
        for (place, point, room) in known {
            assert!(place.ecef().abs_diff_eq(point, room), "{place:?}: {}", place.ecef());
            let back = Geodetic::from_ecef(point).ecef();
            assert!(back.abs_diff_eq(point, 1e-8), "{place:?}: {back}");
        }
    }

    /// Metres of a degree of latitude and of longitude about a latitude, of chords of an eighth of a degree.
    fn degree_at(latitude: f64) -> [f64; 2] {
        let arc = |point: &dyn Fn(f64) -> Geodetic| {
            let points: Vec<DVec3> = (-4..=4).map(|i| point(f64::from(i) / 8.0).ecef()).collect();
            points.windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f64>()
        };
        [arc(&|off| at(latitude + off, 30.0, 0.0)), arc(&|off| at(latitude, 30.0 + off, 0.0))]
    }

    #[test]
    fn degrees_are_as_long_as_published() {
        // National Geospatial-Intelligence Agency, "Length of a Degree of Latitude and Longitude Calculator", as
        // Wikipedia's "Latitude" has it: whole metres.
        let known = [
            (0.0, 110_574.0, 111_319.49), // the equator, a circle: a π/180
            (15.0, 110_649.0, 107_550.0),
            (30.0, 110_852.0, 96_486.0),
            (45.0, 111_132.0, 78_847.0),
            (60.0, 111_412.0, 55_800.0),
        ];
        for (latitude, along_meridian, along_parallel) in known {
            let [north, east] = degree_at(latitude);
            // Chords are shorter by (π/1440)²/24, 0.02 m.
            assert!((north - along_meridian).abs() < 0.53, "{latitude}: {north}");
            assert!((east - along_parallel).abs() < 0.53, "{latitude}: {east}");
            // The meridian's radius of curvature, a(1 − e²)/(1 − e² sin²)^(3/2), over the degree by Simpson's rule.
            let radius = |off: f64| {
                let sin = (latitude + off).to_radians().sin();
                EQUATORIAL * (1.0 - ECCENTRICITY) / (1.0 - ECCENTRICITY * sin * sin).powf(1.5)
            };
            let mean = (radius(-0.5) + 4.0 * radius(0.0) + radius(0.5)) / 6.0;
            assert!((north - mean.to_radians()).abs() < 0.03, "{latitude}: {north}");
        }
        // At the equator, to the decimetre.
        assert!((degree_at(0.0)[0] - 110_574.3).abs() < 0.05);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn there_and_back_is_the_same_place(
            latitude in -90.0f64..=90.0, longitude in -180.0f64..180.0, altitude in -1e4f64..1e6,
        ) {
            let place = at(latitude, longitude, altitude);
            let back = Geodetic::from_ecef(place.ecef());
            prop_assert!((back.latitude_degrees - latitude).abs() < 1e-9, "{back:?}");
            // Near the poles a metre is many degrees of longitude.
            let room = 1e-9 + 1e-12 / latitude.to_radians().cos().abs();
            prop_assert!((back.longitude_degrees - longitude).abs() < room, "{back:?}");
            // Coordinates of 7,000 km round by 1e-9 m.
            prop_assert!((back.altitude - altitude).abs() < 1e-8, "{back:?}");
        }

        #[test]
        fn east_north_and_up_are_the_ways_in_which_places_change(
            latitude in -89.0f64..89.0, longitude in -180.0f64..180.0,
        ) {
            let place = at(latitude, longitude, 100.0);
            let axes = place.ecef_from_enu();
            let step = |place: Geodetic, other: Geodetic| (other.ecef() - place.ecef()).normalize();
            let ways = [(longitude + 1e-5, latitude, 100.0), (longitude, latitude + 1e-5, 100.0), (longitude, latitude, 101.0)];
            for ((longitude, latitude, altitude), axis) in ways.into_iter().zip([axes.x_axis, axes.y_axis, axes.z_axis]) {
                let way = at(latitude, longitude, altitude);
                // Half of 1e-5 degrees, and 1e-9 m of rounding over the least way, 0.02 m.
                prop_assert!(step(place, way).abs_diff_eq(axis, 2e-7), "{} {axis}", step(place, way));
            }
            prop_assert!((axes.determinant() - 1.0).abs() < 1e-14);
        }
    }
}
