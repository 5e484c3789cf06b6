//! Readings of motion sensors, and of those for what is around a vehicle.

use crate::captures::common::{Common, common};
use crate::given::arguments::required;
use numpy::PyArray2;
use pyo3::prelude::*;
use relief::sense::{GnssCapture, ImuCapture};
use relief::systems::sensors::collision::Collision;
use relief::systems::sensors::{Class, Classes, LaneReading as Reading};

/// Getters that all readings have, and those of one: of each its name, type and value in `own`.
macro_rules! reading {
    ($class:ident, $own:ident: { $($(#[$doc:meta])* $getter:ident: $type:ty = $value:expr;)* } $($more:tt)*) => {
        common! { $class,
            /// From the sensor's axes, X forward, Y left, Z up, to the scene's coordinates: float64 (4, 4).
        }

        #[pymethods]
        impl $class {
            $(
                $(#[$doc])*
                #[getter]
                fn $getter(&self) -> $type {
                    let $own = &self.own;
                    $value
                }
            )*

            $($more)*
        }
    };
}

/// Measurement of an inertial measurement unit, for the time that it was due before.
#[pyclass(frozen, module = "relief")]
pub struct ImuReading {
    common: Common,
    own: ImuCapture,
}

impl ImuReading {
    pub fn new(own: ImuCapture, common: Common) -> Self {
        Self { common, own }
    }
}

reading! { ImuReading, own: {
    /// True if the places of the sensor at the last two times that it was due are known. If not, all is 0.
    valid: bool = own.valid;
    /// Nanoseconds of the clock of which the reading is.
    nanoseconds: u64 = own.nanoseconds;
    /// Acceleration against free fall, m/s²: (0, 0, 9.81) at rest on level ground.
    specific_force: (f64, f64, f64) = own.reading.specific_force.into();
    /// About its axes, rad/s.
    angular_velocity: (f64, f64, f64) = own.reading.angular_velocity.into();
    /// Standard deviations of what noise adds, on each axis: of the specific force, m/s², and of the angular velocity,
    /// rad/s. A density n becomes n/√s of readings s seconds apart (Kalibr's "IMU noise model").
    sigmas: (f64, f64) = own.sigmas.into();
} }

/// Measurement of a receiver of satellite navigation.
#[pyclass(frozen, module = "relief")]
pub struct GnssReading {
    common: Common,
    own: GnssCapture,
}

impl GnssReading {
    pub fn new(own: GnssCapture, common: Common) -> Self {
        Self { common, own }
    }
}

reading! { GnssReading, own: {
    /// True if the place of the scene on Earth is known. If not, all is 0.
    valid: bool = own.valid;
    /// Degrees, WGS 84.
    latitude: f64 = own.reading.place.latitude_degrees;
    /// Degrees, WGS 84.
    longitude: f64 = own.reading.place.longitude_degrees;
    /// Metres above the ellipsoid.
    altitude: f64 = own.reading.place.altitude;
    /// Standard deviations of what noise adds, metres: to the east and to the north, and upward.
    sigmas: (f64, f64) = own.sigmas.into();
    /// True if the place of the sensor when it was due before is known. If not, the velocity is 0.
    has_velocity: bool = own.has_velocity;
    /// To the east, north and up, m/s; the mean since the sensor was due before.
    velocity: (f64, f64, f64) = own.reading.velocity.into();
} }

/// Pose in a lane. All is 0 where no lane is near.
#[pyclass(frozen, module = "relief")]
pub struct LaneReading {
    common: Common,
    own: Reading,
}

impl LaneReading {
    pub fn new(own: Reading, common: Common) -> Self {
        Self { common, own }
    }
}

reading! { LaneReading, own: {
    /// Tells if a lane is near.
    valid: bool = own.valid;
    /// The route's place in `Sim.routes`.
    route: u32 = own.route;
    /// The lane, counted from the edge of the road.
    lane: u32 = own.lane;
    /// Metres from the middle of the lane, left positive.
    offset: f64 = own.offset;
    /// Radians from the way that the lane goes to the sensor's forward, left positive, −π to π.
    heading_error: f64 = own.heading_error;
    /// Curvature of the lane's centre line, 1/m, left positive.
    curvature: f64 = own.curvature;
    /// Width of the lane, metres.
    width: f64 = own.width;
    /// Metres along the route's centre line from its beginning.
    along: f64 = own.along;
    /// Speed of the vehicle that the sensor is on, m/s along its forward.
    speed: f64 = own.speed;
} }

/// Contact with another entity.
#[pyclass(frozen, module = "relief")]
pub struct Contact {
    /// The id of the other.
    #[pyo3(get)]
    instance: u32,
    /// The name of its semantic class; ``None`` for none.
    #[pyo3(get)]
    class_: Option<String>,
    /// Metres that the two would have to be moved apart to be beside each other; negative where they are apart by it.
    #[pyo3(get)]
    depth: f64,
    /// The way from the other, unit, in the sensor's axes: forward, left, up.
    #[pyo3(get)]
    normal: (f64, f64, f64),
    /// m/s at which they come nearer along it.
    #[pyo3(get)]
    speed: f64,
}

/// All that something touches.
#[pyclass(frozen, sequence, module = "relief")]
pub struct Collisions {
    common: Common,
    own: Vec<Collision>,
    classes: Vec<Option<String>>,
}

impl Collisions {
    pub fn new(own: Vec<Collision>, common: Common, classes: &Classes) -> Self {
        let name = |collision: &Collision| {
            let known = classes.get(Class(collision.class)).filter(|_| collision.class != 0);
            known.map(|info| info.name.clone())
        };
        let classes = own.iter().map(name).collect();
        Self { common, own, classes }
    }

    fn contact(&self, index: usize) -> Option<Contact> {
        let Collision { instance, depth, normal, speed, .. } = *self.own.get(index)?;
        let class_ = self.classes.get(index).cloned().flatten();
        Some(Contact { instance, class_, depth, normal: normal.into(), speed })
    }
}

reading! { Collisions, own: {}
    fn __len__(&self) -> usize {
        self.own.len()
    }

    fn __getitem__(&self, index: &Bound<'_, PyAny>) -> PyResult<Contact> {
        let index: isize = required("index", index)?;
        let place = if index < 0 { index + self.own.len() as isize } else { index };
        let contact = usize::try_from(place).ok().and_then(|place| self.contact(place));
        contact.ok_or_else(|| {
            pyo3::exceptions::PyIndexError::new_err(format!("contact {index} of {}", self.own.len()))
        })
    }
}
