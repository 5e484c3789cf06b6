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
use systems::sensors::{GeoOrigin, GnssReading, GnssSensor, ImuReading, ImuSensor, Sensor, SensorKind};
use systems::space::{Interpolated, Transform};

/// m/s: what has no motion of its own, which programs move by putting it where it is, was put elsewhere beyond this.
/// What moves by itself knows when it jumped.
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

/// Place at a time, and the number of jumps until then.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Place {
    pub pose: Pose,
    /// [`jumps`].
    pub jumps: u32,
}

impl Place {
    /// Tells if it moved from here to a later place, so many seconds later, rather than being put there.
    pub fn leads_to(&self, later: &Self, seconds: f64) -> bool {
        let distance = self.pose.translation.distance(later.pose.translation);
        self.jumps == later.jumps && distance <= FASTEST * seconds
    }
}

/// Number of jumps of something, by itself or with what it is on. It may begin anew where it comes to hang
/// elsewhere.
pub(super) fn jumps(world: &World, entity: Entity) -> u32 {
    let own = |entity| world.get::<Interpolated>(entity).map_or(0, Interpolated::jumps);
    own_and_above(world, entity).map(own).fold(0, u32::wrapping_add)
}

/// Places of a sensor when it was due last: steps and places, the latest last.
#[derive(Clone, Debug, Default)]
pub(super) struct Track(Vec<(u64, Place)>);

impl Track {
    /// Notes where a sensor is that is due after a step, `seconds` after it was due before. Returns where it was then,
    /// and before that, as far as that is known and it moved from there to here. The same again where it is asked
    /// again.
    pub fn note(&mut self, sensor: &Sensor, step: u64, seconds: f64, now: Place) -> [Option<Pose>; 2] {
        self.0.retain(|(at, _)| *at < step);
        let needed = poses_needed(&sensor.kind);
        let noted = |intervals: u64| {
            let due = step.checked_sub(intervals * u64::from(sensor.every)).filter(|_| intervals <= needed as u64)?;
            self.0.iter().find(|(at, _)| *at == due).map(|(_, place)| *place)
        };
        let last = noted(1).filter(|last| last.leads_to(&now, seconds));
        let first = last.and_then(|last| noted(2).filter(|first| first.leads_to(&last, seconds)));
        self.0.push((step, now));
        self.0.drain(..self.0.len().saturating_sub(needed + 1));
        [last, first].map(|place| place.map(|place| place.pose))
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

/// What a unit measured that is at the pose now, and was at the others when it was due before, latest first.
pub(super) fn imu(imu: &ImuSensor, now: &Pose, before: &[Option<Pose>; 2], moment: Moment) -> ImuCapture {
    let Moment { seconds, before: nanoseconds, noise } = moment;
    let sigmas = imu.sigmas(seconds);
    let [Some(last), Some(first)] = before else {
        return ImuCapture { sigmas, nanoseconds, ..ImuCapture::default() };
    };
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

    fn place(x: f64) -> Place {
        Place { pose: at(x), jumps: 0 }
    }

    fn sensor(kind: SensorKind, every: u32) -> Sensor {
        Sensor::new(kind).every(every)
    }

    #[test]
    fn a_track_knows_the_poses_of_the_last_intervals() {
        let imu = sensor(SensorKind::Imu(ImuSensor::default()), 3);
        let mut track = Track::default();
        let mut note = |step, x| track.note(&imu, step, 1.0, place(x));
        assert_eq!(note(1, 1.0), [None, None]);
        assert_eq!(note(4, 4.0), [Some(at(1.0)), None]);
        // Asked twice, it says the same.
        for _ in 0..2 {
            assert_eq!(note(7, 7.0), [Some(at(4.0)), Some(at(1.0))]);
        }
        // It was not asked after step 10: nothing leads from what was before that.
        assert_eq!(note(13, 13.0), [None, None]);
        // The world went back.
        assert_eq!(note(10, 10.0), [Some(at(7.0)), Some(at(4.0))]);
        assert_eq!(note(13, 14.0), [Some(at(10.0)), Some(at(7.0))]);
        let (gnss, mut track) = (sensor(SensorKind::Gnss(GnssSensor::default()), 1), Track::default());
        let is_known = [1, 2, 3].map(|step| track.note(&gnss, step, 1.0, place(0.0))[0].is_some());
        assert_eq!((is_known, track.0.len()), ([false, true, true], 2));
        assert_eq!(poses_needed(&SensorKind::Lidar(LidarSensor { sweep: true, ..LidarSensor::default() })), 1);
    }

    #[test]
    fn nothing_leads_over_a_jump_however_slow() {
        let imu = sensor(SensorKind::Imu(ImuSensor::default()), 60);
        let mut track = Track::default();
        let mut note = |step, x, jumps| {
            let [last, first] = track.note(&imu, step, 1.0, Place { pose: at(x), jumps });
            (last.is_some(), first.is_some())
        };
        assert_eq!(note(0, 0.0, 3), (false, false));
        assert_eq!(note(60, 10.0, 3), (true, false));
        assert_eq!(note(120, 20.0, 3), (true, true));
        // 30 m back in a second, where it drives 10.
        assert_eq!(note(180, -10.0, 4), (false, false));
        assert_eq!(note(240, 0.0, 4), (true, false));
        assert_eq!(note(300, 10.0, 4), (true, true));
        // Where it jumped to where it would have been.
        assert_eq!(note(360, 20.0, 5), (false, false));
    }

    #[test]
    fn what_is_put_where_it_is_moves_by_that_up_to_the_speed_of_sound() {
        let moved = |x: f64| place(0.0).leads_to(&place(x), 0.1);
        assert_eq!([33.9, 34.1].map(moved), [true, false]);
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
