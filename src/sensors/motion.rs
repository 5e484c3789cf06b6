//! Sensors of motion: what an IMU and a receiver of satellite navigation capture, and where sensors were before.
//!
//! Poses are those of the state, in 64 bits as far as it has them: a vehicle's place, and what is mounted on it. So
//! accelerations are not lost in the roundings of places: a place in 32 bits, 100 m from the origin, is 8 µm from its
//! neighbour, which at 60 steps a second is 0.03 m/s².

use super::label_table::own_and_above;
use super::lidar::Pose;
use bevy_ecs::prelude::*;
use glam::{DAffine3, DVec3};
use systems::draw::rigid;
use systems::sensors::philox::Noise;
use systems::sensors::{GeoOrigin, GnssReading, GnssSensor, ImuReading, ImuSensor, SensorKind};
use systems::space::Transform;

/// m/s: what moves faster was put elsewhere.
const FASTEST: f64 = 340.0;

/// What an inertial measurement unit measured.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ImuCapture {
    /// Whether it is known where the sensor was when it was due before, and before that. If not, all is 0.
    pub valid: bool,
    /// Nanoseconds of the clock of which the reading is: of when it was due before.
    pub nanoseconds: u64,
    /// The reading.
    pub reading: ImuReading,
    /// Standard deviations of its white noise: of the specific force, m/s², and of the angular rate, rad/s.
    pub sigmas: [f64; 2],
}

/// What a receiver of satellite navigation measured.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct GnssCapture {
    /// Whether it is known where on Earth the scene is. If not, all is 0.
    pub valid: bool,
    /// Whether it is known where the sensor was when it was due before. If not, the velocity is 0.
    pub has_velocity: bool,
    /// The reading; its velocity is the mean one since the sensor was due before.
    pub reading: GnssReading,
    /// Standard deviations of its place, metres: horizontal and vertical.
    pub sigmas: [f64; 2],
}

/// A sensor's interval and what its noise begins with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// Since it was due before.
    pub seconds: f64,
    /// Nanoseconds of the clock when it was due before.
    pub before: u64,
    /// Its random numbers.
    pub noise: Noise,
}

/// How many of the poses at which it was due before a sensor measures by.
pub(super) fn poses_needed(kind: &SensorKind) -> usize {
    match kind {
        SensorKind::Imu(_) => 2,
        SensorKind::Gnss(_) => 1,
        SensorKind::Lidar(lidar) => usize::from(lidar.sweep),
        _ => 0,
    }
}

/// Whether a sensor's poses are those of the state, rather than those that it is drawn at.
pub(super) fn measures_motion(kind: &SensorKind) -> bool {
    matches!(kind, SensorKind::Imu(_) | SensorKind::Gnss(_) | SensorKind::Lane(_) | SensorKind::Collision(_))
}

/// Where a sensor was when it was due last: steps and poses, the latest last.
#[derive(Clone, Debug, Default)]
pub(super) struct Track(Vec<(u64, Pose)>);

impl Track {
    /// Notes where a sensor is that is due after a step. Returns where it was when it was due before, and before that,
    /// as far as that is known. The same again where it is asked again.
    pub fn note(&mut self, kind: &SensorKind, step: u64, every: u32, now: Pose) -> [Option<Pose>; 2] {
        self.0.retain(|(at, _)| *at < step);
        let needed = poses_needed(kind);
        let before = [1, 2].map(|intervals| {
            let due = step.checked_sub(intervals * u64::from(every)).filter(|_| intervals <= needed as u64)?;
            self.0.iter().find(|(at, _)| *at == due).map(|(_, pose)| *pose)
        });
        self.0.push((step, now));
        self.0.drain(..self.0.len().saturating_sub(needed + 1));
        before
    }
}

/// `world_from_entity` in the state.
pub(super) fn place(world: &World, entity: Entity) -> DAffine3 {
    own_and_above(world, entity).fold(DAffine3::IDENTITY, |below, entity| local(world, entity) * below)
}

/// From an entity to what it is below.
fn local(world: &World, entity: Entity) -> DAffine3 {
    let Some(at) = world.get::<Transform>(entity) else { return DAffine3::IDENTITY };
    #[cfg(feature = "vehicles")]
    let exact = world.get::<systems::vehicles::Motion>(entity).map(|motion| motion.place);
    #[cfg(not(feature = "vehicles"))]
    let exact: Option<DVec3> = None;
    // What something else has moved is where that has put it.
    let translation = exact.filter(|place| place.as_vec3() == at.translation).unwrap_or(at.translation.as_dvec3());
    let rotation = at.rotation.as_dquat().normalize();
    DAffine3::from_scale_rotation_translation(at.scale.as_dvec3(), rotation, translation)
}

/// A sensor's pose in the state.
pub(super) fn pose(world: &World, entity: Entity) -> Pose {
    let place = place(world, entity);
    let upright = rigid(&place.as_affine3a());
    let rotation = glam::Quat::from_mat3a(&upright.matrix3).as_dquat().normalize();
    Pose { translation: place.translation, rotation }
}

/// Whether something may have moved from one place to another in so many seconds.
pub(super) fn may_have_moved(from: &Pose, to: &Pose, seconds: f64) -> bool {
    from.translation.distance(to.translation) <= FASTEST * seconds
}

/// What a unit measured that is at the pose now, and was at the others when it was due before, latest first.
pub(super) fn imu(imu: &ImuSensor, now: &Pose, before: &[Option<Pose>; 2], moment: Moment) -> ImuCapture {
    let Moment { seconds, before: nanoseconds, noise } = moment;
    let sigmas = imu.sigmas(seconds);
    let [Some(last), Some(first)] = before else {
        return ImuCapture { sigmas, nanoseconds, ..ImuCapture::default() };
    };
    if !(may_have_moved(first, last, seconds) && may_have_moved(last, now, seconds)) {
        return ImuCapture { sigmas, nanoseconds, ..ImuCapture::default() };
    }
    let moments = [first, last, now].map(|pose| (pose.translation, pose.rotation));
    ImuCapture { valid: true, nanoseconds, reading: imu.measure(&moments, seconds, noise), sigmas }
}

/// What a receiver measured that is at the pose now, and was at another when it was due before. `origin`: the world's,
/// in the scene's coordinates.
pub(super) fn gnss(
    gnss: &GnssSensor,
    on_earth: Option<&GeoOrigin>,
    origin: DVec3,
    poses: (&Pose, Option<Pose>),
    moment: Moment,
) -> GnssCapture {
    let sigmas = [gnss.noise.horizontal_sigma, gnss.noise.vertical_sigma].map(f64::from);
    let Some(on_earth) = on_earth else { return GnssCapture { sigmas, ..GnssCapture::default() } };
    let (now, before) = poses;
    let before = before.filter(|before| may_have_moved(before, now, moment.seconds));
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
    use systems::sensors::LidarSensor;

    fn at(x: f64) -> Pose {
        Pose { translation: DVec3::X * x, ..Pose::default() }
    }

    #[test]
    fn a_track_knows_the_poses_of_the_last_intervals() {
        let (imu, gnss) = (SensorKind::Imu(ImuSensor::default()), SensorKind::Gnss(GnssSensor::default()));
        let mut track = Track::default();
        assert_eq!(track.note(&imu, 1, 3, at(1.0)), [None, None]);
        assert_eq!(track.note(&imu, 4, 3, at(4.0)), [Some(at(1.0)), None]);
        // Asked twice, it says the same.
        for _ in 0..2 {
            assert_eq!(track.note(&imu, 7, 3, at(7.0)), [Some(at(4.0)), Some(at(1.0))]);
        }
        // It was not asked after step 10.
        assert_eq!(track.note(&imu, 13, 3, at(13.0)), [None, Some(at(7.0))]);
        // The world went back.
        assert_eq!(track.note(&imu, 10, 3, at(10.0)), [Some(at(7.0)), Some(at(4.0))]);
        assert_eq!(track.note(&imu, 13, 3, at(14.0)), [Some(at(10.0)), Some(at(7.0))]);
        let mut track = Track::default();
        assert_eq!([1, 2, 3].map(|step| track.note(&gnss, step, 1, at(0.0))[0].is_some()), [false, true, true]);
        assert_eq!(track.0.len(), 2);
        assert_eq!(poses_needed(&SensorKind::Lidar(LidarSensor { sweep: true, ..LidarSensor::default() })), 1);
    }

    #[test]
    fn what_was_put_elsewhere_has_no_reading_of_motion() {
        let moment = Moment { seconds: 0.1, before: 7, noise: Noise::new(0, 0, 0) };
        let (unit, receiver) = (ImuSensor::default(), GnssSensor::default());
        let read = |places: [f64; 3]| {
            let [first, last, now] = places.map(at);
            let before = [Some(last), Some(first)];
            let origin = GeoOrigin::default();
            let place = gnss(&receiver, Some(&origin), DVec3::ZERO, (&now, Some(last)), moment);
            (imu(&unit, &now, &before, moment).valid, place.has_velocity, place.valid)
        };
        assert_eq!(read([0.0, 30.0, 60.0]), (true, true, true));
        assert_eq!(read([0.0, 40.0, 60.0]), (false, true, true));
        assert_eq!(read([0.0, 20.0, 60.0]), (false, false, true));
    }
}
