//! Readings of IMUs and of receivers of satellite navigation.

use crate::sense::captures::motion::{GnssCapture, ImuCapture};
use crate::sense::captures::pose::Pose;
use glam::DVec3;
use systems::sensors::philox::Noise;
use systems::sensors::{GeoOrigin, GnssSensor, ImuSensor};

/// A sensor's interval and what its noise begins with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// Since it was due before.
    pub seconds: f64,
    /// Nanoseconds of the clock when it was due before.
    pub before: u64,
    /// Its random numbers.
    pub noise: Noise,
}

/// Measurement of a unit that is at the pose now, and was at the others when it was due before, latest first.
pub(crate) fn imu(imu: &ImuSensor, now: &Pose, before: &[Option<Pose>; 2], moment: Moment) -> ImuCapture {
    let Moment { seconds, before: nanoseconds, noise } = moment;
    let sigmas = imu.sigmas(seconds);
    let [Some(last), Some(first)] = before else {
        return ImuCapture { sigmas, nanoseconds, ..ImuCapture::default() };
    };
    let moments = [first, last, now].map(|pose| (pose.translation, pose.rotation));
    ImuCapture { valid: true, nanoseconds, reading: imu.measure(&moments, seconds, noise), sigmas }
}

/// Measurement of a receiver that is at the pose now, and was at another when it was due before. `origin`: the world's,
/// in the scene's coordinates.
pub(crate) fn gnss(
    gnss: &GnssSensor,
    on_earth: Option<&GeoOrigin>,
    origin: DVec3,
    poses: (&Pose, Option<Pose>),
    moment: Moment,
) -> GnssCapture {
    let sigmas = [gnss.noise.horizontal_sigma, gnss.noise.vertical_sigma].map(f64::from);
    let Some(on_earth) = on_earth else { return GnssCapture { sigmas, ..GnssCapture::default() } };
    let (now, before) = poses;
    let velocity = before.map(|before| (now.translation - before.translation) / moment.seconds);
    let mut reading = gnss.measure(on_earth, now.translation + origin, velocity.unwrap_or_default(), moment.noise);
    if velocity.is_none() {
        reading.velocity = DVec3::ZERO;
    }
    GnssCapture { valid: true, has_velocity: velocity.is_some(), reading, sigmas }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> Pose {
        Pose { translation: DVec3::X * x, ..Pose::default() }
    }

    #[test]
    fn what_knows_not_where_it_was_has_no_reading_of_motion() {
        let moment = Moment { seconds: 0.1, before: 7, noise: Noise::new(0, 0, 0) };
        let (unit, receiver) = (ImuSensor::default(), GnssSensor::default());
        let read = |before: [Option<Pose>; 2]| {
            let (now, origin) = (at(2.0), GeoOrigin::default());
            let place = gnss(&receiver, Some(&origin), DVec3::ZERO, (&now, before[0]), moment);
            (imu(&unit, &now, &before, moment).valid, place.has_velocity, place.valid)
        };
        assert_eq!(read([Some(at(1.0)), Some(at(0.0))]), (true, true, true));
        assert_eq!(read([Some(at(1.0)), None]), (false, true, true));
        assert_eq!(read([None, None]), (false, false, true));
    }
}
