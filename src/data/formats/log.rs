//! The sensors of a run as one log of ROS 2 messages (MCAP), which `ros2 bag`, Foxglove and rerun open.
//!
//! ```text
//! /clock             the time, after each step
//! /tf                the frame of each sensor in the frame `world`, at each of its captures; of a lidar that sweeps
//!                    also when its first column was fired, unless that was at the capture before
//! /ego/front/…       of a camera: image_raw (rgb8), depth (32FC1, metres), class (mono8), instance (32SC1),
//!                    camera_info, boxes (foxglove_msgs/ImageAnnotations), objects (foxglove_msgs/SceneUpdate, in
//!                    `world`)
//! /ego/top/points    of a lidar, returns alone: x, y, z, intensity, ring, time, instance, class; of the time of its
//!                    first column where it sweeps
//! /ego/imu/imu       of an IMU, once it measures: of the time that its reading is of
//! /ego/mast/fix      of a GNSS receiver
//! ```
//!
//! Times are nanoseconds of the simulation. The world has Z up: (x, y, z) are the scene's (Z, X, Y). A camera's frame
//! is optical: X right, Y down, Z forward. A lidar's has X forward, Y left, Z up. A point was measured `time` seconds
//! after the stamp of its cloud, from where the frame was then: points of one that does not sweep all at the capture. A
//! camera whose projection is parallel has no camera_info. An IMU and a GNSS receiver have the axes of lidars.

use super::format::{FileFormat, Makes, Poses, RunInfo, RunWriter};
use super::log_boxes;
use crate::export::array::Column;
use crate::export::mcap::Log;
use crate::export::ros::{
    CameraInfo, Clock, Distortion, Header, Image, ImageAnnotations, Pixels, PointCloud2, SceneUpdate, TfMessage,
    TransformStamped,
};
use crate::frames::FrameError;
use crate::output::{OutputError, WholeFile};
use crate::sense::captures::axes::ROS_FROM_WORLD;
use crate::sense::captures::boxes::ObjectBox;
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::capture::{Capture, SensorData};
use crate::sense::captures::lidar::LidarCapture;
use crate::sense::motion::kind::has_messages;
use glam::{DAffine3, DQuat};
use std::collections::BTreeSet;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use systems::sensors::{CameraOutput, Classes};

/// The log of a data set.
pub(crate) const LOG: &str = "sensors.mcap";

impl FileFormat {
    /// One log of ROS 2 for the whole run.
    pub const MCAP: Self = Self {
        name: "mcap",
        help: "sensors.mcap, one log of ROS 2 for the run: image_raw, depth, class, instance and camera_info of \
               cameras, points of lidars, what others have a message for, /tf, /clock",
        endings: &[],
        needs: None,
        accepts: |kind, output| match output {
            Some(output) => {
                use CameraOutput::{Boxes, Class, Color, Depth, Instance};
                matches!(output, Color | Depth | Class | Instance | Boxes)
            }
            // Readers know messages of some kinds only.
            None => has_messages(kind),
        },
        check: |run| match cfg!(feature = "mcap") {
            true => check_names(run.sensors.keys()),
            false => Err(FrameError::NotBuiltIn { format: "mcap" }),
        },
        makes: Makes::Run(|run| Ok(Box::new(SensorLog::begin(&run.folder.join(LOG), run)?))),
    };
}

/// The frame that all others are in.
const WORLD: &str = "world";

/// A log that is being written.
struct SensorLog {
    path: PathBuf,
    log: Log<BufWriter<WholeFile>>,
    classes: Classes,
    /// Frames of cameras with boxes: where there are none in a picture, that is said.
    labelled: BTreeSet<String>,
    /// Nanoseconds of the clock from which on captures are in the log, or in those of parts of the run before this one.
    first: u64,
}

impl SensorLog {
    /// Begins the log of a run, which is at its path once it is finished.
    ///
    /// # Errors
    /// [`OutputError`].
    fn begin(path: &Path, run: &RunInfo) -> Result<Self, OutputError> {
        let file = BufWriter::new(WholeFile::begin(path)?);
        let log = Log::new(file).map_err(|error| OutputError::io(path, error))?;
        let labelled = run.labelled().iter().map(|name| frame_name(name)).collect();
        let first = (run.first as f64 * run.step_seconds * 1e9).round() as u64;
        Ok(Self { path: path.to_owned(), log, classes: run.classes.clone(), labelled, first })
    }

    fn append(&mut self, Capture { nanoseconds, sensors, .. }: &Capture) -> io::Result<()> {
        let names: Vec<String> = sensors.iter().map(|sensor| frame_name(&sensor.name)).collect();
        let named = || names.iter().map(String::as_str).zip(sensors);
        let begins = named().filter_map(|(name, sensor)| {
            let begin = sensor.lidar().filter(|lidar| self.is_begin_missing(lidar))?;
            Some(place(name, begin.nanoseconds, &begin.scene_from_column(0)))
        });
        let ends = named().map(|(name, sensor)| place(name, *nanoseconds, &sensor.world_from_outputs()));
        let places: Vec<_> = begins.chain(ends).collect();
        self.log.write("/tf", *nanoseconds, &TfMessage(&places))?;
        for (frame, sensor) in named() {
            let header = Header { nanoseconds: *nanoseconds, frame };
            match &sensor.data {
                SensorData::Camera(camera) => {
                    self.camera(header, camera)?;
                    if self.labelled.contains(header.frame) {
                        self.boxes(header, &camera.boxes)?;
                    }
                }
                SensorData::Lidar(lidar) => self.lidar(header, lidar)?,
                SensorData::Reading(reading) => {
                    for (topic, message) in reading.messages(header)? {
                        self.log.write_encoded(&format!("/{frame}/{topic}"), header.nanoseconds, &message)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn camera(&mut self, header: Header, camera: &CameraCapture) -> io::Result<()> {
        let (size, topic) = ((camera.width, camera.height), |name: &str| format!("/{}/{name}", header.frame));
        let pictures = [
            ("image_raw", Pixels::Rgb(camera.color.as_flattened())),
            ("depth", Pixels::Float32(&camera.depth)),
            ("class", Pixels::Mono8(&camera.class)),
            ("instance", Pixels::Signed32(&camera.instance)),
        ];
        for (name, pixels) in pictures.into_iter().filter(|(_, pixels)| !pixels.is_empty()) {
            self.log.write(&topic(name), header.nanoseconds, &Image { header, size, pixels })?;
        }
        let Some(k) = camera.intrinsics else { return Ok(()) };
        let distortion = Distortion::of(&camera.lens);
        let info = CameraInfo { header, size, intrinsics: [k.fx, k.fy, k.cx, k.cy], distortion };
        self.log.write(&topic("camera_info"), header.nanoseconds, &info)
    }

    fn boxes(&mut self, header: Header, boxes: &[ObjectBox]) -> io::Result<()> {
        let (nanoseconds, topic) = (header.nanoseconds, |name: &str| format!("/{}/{name}", header.frame));
        let names = log_boxes::names(boxes, &self.classes);
        let shown = log_boxes::in_picture(boxes, &names, &self.classes);
        self.log.write(&topic("boxes"), nanoseconds, &ImageAnnotations { nanoseconds, boxes: &shown })?;
        let placed = log_boxes::in_space(boxes, &self.classes);
        let header = Header { frame: WORLD, ..header };
        self.log.write(&topic("objects"), nanoseconds, &SceneUpdate { header, boxes: &placed })
    }

    /// True if the log has no transform yet of when a scan's first column was fired: none was captured then, or what
    /// was is not where the scan began.
    fn is_begin_missing(
        &self,
        LidarCapture { columns, nanoseconds, sweep, is_before_known, .. }: &LidarCapture,
    ) -> bool {
        let is_of_capture_before = *is_before_known && columns.lead_seconds() == 0.0 && *nanoseconds >= self.first;
        *sweep && columns.count > 0 && !is_of_capture_before
    }

    fn lidar(&mut self, header: Header, lidar: &LidarCapture) -> io::Result<()> {
        let LidarCapture { scan, instance, class, .. } = lidar;
        let points = scan.returns(&scan.xyz);
        let (intensity, ring) = (scan.returns(&scan.intensity), scan.returns(&scan.ring));
        // What does not sweep measures all at the capture.
        let (stamp, since) = if lidar.sweep { (lidar.nanoseconds, 1.0) } else { (header.nanoseconds, 0.0) };
        let (time, instance) = (scan.returns(&scan.time), scan.returns(instance));
        let time: Vec<f32> = time.into_iter().map(|time| time * since).collect();
        let class = scan.returns(class);
        let columns = [
            Column::new("intensity", &[], &intensity[..]),
            Column::new("ring", &[], &ring[..]),
            Column::new("time", &[], &time[..]),
            Column::new("instance", &[], &instance[..]),
            Column::new("class", &[], &class[..]),
        ];
        let of_scan = Header { nanoseconds: stamp, ..header };
        let cloud = PointCloud2 { header: of_scan, points: &points, columns: &columns };
        self.log.write(&format!("/{}/points", header.frame), header.nanoseconds, &cloud)
    }
}

impl RunWriter for SensorLog {
    fn tick(&mut self, nanoseconds: u64) -> Result<(), FrameError> {
        let written = self.log.write("/clock", nanoseconds, &Clock(nanoseconds));
        Ok(written.map_err(|error| OutputError::io(&self.path, error))?)
    }

    fn write(&mut self, capture: &Capture, _: &Poses) -> Result<(), FrameError> {
        Ok(self.append(capture).map_err(|error| OutputError::io(&self.path, error))?)
    }

    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError> {
        let Self { path, log, .. } = *self;
        let ended = log.finish().and_then(|file| file.into_inner().map_err(|error| error.into_error()));
        ended.map_err(|error| OutputError::io(&path, error))?.finish()?;
        Ok(vec![path])
    }
}

/// Pose of a sensor's frame in the world of ROS. `scene_from_outputs`: from the axes of its outputs.
fn place<'a>(name: &'a str, nanoseconds: u64, scene_from_outputs: &DAffine3) -> TransformStamped<'a> {
    let axes = ROS_FROM_WORLD * scene_from_outputs.matrix3;
    TransformStamped {
        header: Header { nanoseconds, frame: WORLD },
        child: name,
        translation: (ROS_FROM_WORLD * scene_from_outputs.translation).to_array(),
        rotation: DQuat::from_mat3(&axes).normalize().to_array(),
    }
}

/// A sensor's name as that of a frame and within those of topics. These have letters and digits of ASCII and `_`, none
/// first a digit (ROS 2, "Topic and Service name mapping to DDS"): all else becomes `_`.
fn frame_name(sensor: &str) -> String {
    let allowed = |letter: char| if letter.is_ascii_alphanumeric() { letter } else { '_' };
    let tokens = sensor.split('/').map(|token| {
        let needs_more = token.chars().next().is_none_or(|first| first.is_ascii_digit());
        let before = if needs_more { "_" } else { "" };
        before.chars().chain(token.chars().map(allowed)).collect::<String>()
    });
    tokens.collect::<Vec<_>>().join("/")
}

/// Checks that all sensors have frames and topics of their own.
///
/// # Errors
/// [`FrameError::SharedFrameName`].
fn check_names<'a>(sensors: impl Iterator<Item = &'a String>) -> Result<(), FrameError> {
    let mut taken = vec![(WORLD.to_owned(), "the world".to_owned())];
    for sensor in sensors {
        let name = frame_name(sensor);
        if let Some((_, other)) = taken.iter().find(|(other, _)| *other == name) {
            return Err(FrameError::SharedFrameName { sensor: sensor.clone(), name, other: other.clone() });
        }
        taken.push((name, format!("sensor \"{sensor}\"")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sense::captures::capture::SensorCapture;
    use std::collections::BTreeSet;

    #[test]
    fn a_frame_is_named_after_its_sensor_as_far_as_topics_allow() {
        let names = ["ego/front", "Car 2/left eye", "2/3", "größe/", ""].map(frame_name);
        assert_eq!(names, ["ego/front", "Car_2/left_eye", "_2/_3", "gr__e/_", "_"]);
    }

    #[test]
    fn two_frames_have_two_names() {
        let check = |names: &[&str]| check_names(names.iter().map(ToString::to_string).collect::<BTreeSet<_>>().iter());
        assert!(check(&["ego/a b", "ego/ab", "b/world"]).is_ok());
        let refusal = |names| check(names).unwrap_err().to_string();
        let expected = "sensor \"a_b\": its name in MCAP, \"a_b\", is that of sensor \"a b\" already";
        assert!(refusal(&["a_b", "a b"]).starts_with(expected));
        assert!(refusal(&["world"]).contains("is that of the world already"));
    }

    #[test]
    fn a_lidar_that_looks_along_the_scenes_z_has_the_axes_of_the_world() {
        let data = SensorData::Lidar(LidarCapture::default());
        let world_from_sensor = glam::DAffine3::from_translation(glam::DVec3::new(2.0, 3.0, 1.0));
        let entity = bevy_ecs::entity::Entity::PLACEHOLDER;
        let sensor = SensorCapture { entity, name: String::new(), world_from_sensor, first_column: None, data };
        let found = place("top", 5, &sensor.world_from_outputs());
        assert_eq!((found.translation, found.rotation), ([1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]));
        // A camera looks back from there, along −x, with y to the right.
        let sensor = SensorCapture { data: SensorData::Camera(CameraCapture::default()), ..sensor };
        let turn = DQuat::from_array(place("front", 5, &sensor.world_from_outputs()).rotation);
        let [right, down, forward] = [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z].map(|axis| turn * axis);
        for (found, expected) in [(right, glam::DVec3::Y), (down, -glam::DVec3::Z), (forward, -glam::DVec3::X)] {
            // A few roundings of numbers up to 1.
            assert!(found.abs_diff_eq(expected, 1e-15), "{found}");
        }
    }
}
