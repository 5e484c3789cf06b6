//! The captures of a run as folders of KITTI, one for each camera with colours: `DIR/ego/front/kitti`.
//!
//! ```text
//! image_2/000012.png    colours after step 12         calib/000012.txt      P2, and where the lidar is
//! depth/000012.png      16 bits, 1/256 m              semantic/000012.png   classes
//! label_2/000012.txt    things that are seen          flow/000012.png       to the next capture
//! velodyne/000012.bin   returns of the first lidar on the same thing, where it is due, too
//! labels/000012.label   classes and instances of these, as SemanticKITTI has them
//! ```
//!
//! A lidar with no camera beside it has a folder of its own. Classes have the scene's ids.

use super::files;
use super::format::{FileFormat, Makes, Poses, RunInfo, RunWriter};
use crate::export::kitti::{self, Calibration, Label, velodyne};
use crate::export::semantic_kitti;
use crate::frames::FrameError;
use crate::output::{self, OutputError};
use crate::sense::captures::axes::{ENTITY_FROM_CAMERA, ENTITY_FROM_LIDAR};
use crate::sense::captures::boxes::ObjectBox;
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::capture::{Capture, SensorCapture, SensorData};
use crate::sense::captures::lidar::LidarCapture;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use systems::draw::Intrinsics;
use systems::sensors::{CameraOutput, Class, Classes, SensorKind};

impl FileFormat {
    /// Folder of that data set for each camera.
    pub const KITTI: Self = Self {
        name: "kitti",
        help: "NAME/kitti for each camera with color: image_2, label_2 (boxes), calib, depth, semantic (class), flow, \
               and velodyne and labels of the lidar beside it",
        endings: &["png", "txt", "bin", "label"],
        needs: Some("a camera with color and the lens of a pinhole, or a lidar"),
        accepts: |kind, output| match (kind, output) {
            // Its pictures are those of pinholes.
            (SensorKind::Camera(camera), Some(output)) => {
                use CameraOutput::{Boxes, Class, Color, Depth, Flow};
                let is_pinhole = camera.intrinsics().is_some() && !camera.lens.has_distortion();
                is_pinhole && camera.outputs.has(Color) && matches!(output, Color | Depth | Class | Boxes | Flow)
            }
            _ => matches!(kind, SensorKind::Lidar(_)),
        },
        check: Self::accept_all,
        makes: Makes::Run(|run| Ok(Box::new(KittiWriter::new(run)))),
    };
}

/// Folders that are being filled.
struct KittiWriter {
    folder: PathBuf,
    /// Cameras, and the lidar beside each.
    cameras: BTreeMap<String, Option<String>>,
    /// Cameras with boxes, of which there may be none in a picture.
    labelled: BTreeSet<String>,
    /// Lidars beside no camera.
    alone: BTreeSet<String>,
    classes: Classes,
    /// The first frame whose captures are in the data set.
    first: u64,
    /// Steps from capture to capture of each camera.
    every: BTreeMap<String, u64>,
    written: Vec<PathBuf>,
}

impl KittiWriter {
    fn new(run: &RunInfo) -> Self {
        let lidars: Vec<&str> = run.held_by(FileFormat::KITTI, false).collect();
        // Those that stand by themselves are on nothing together.
        let is_beside =
            |lidar: &str, camera: &str| mounted_on(lidar) == mounted_on(camera) && !mounted_on(camera).is_empty();
        let beside = |camera: &str| lidars.iter().find(|lidar| is_beside(lidar, camera));
        let cameras = run.held_by(FileFormat::KITTI, true);
        let cameras: BTreeMap<String, Option<String>> =
            cameras.map(|camera| (camera.to_owned(), beside(camera).map(ToString::to_string))).collect();
        let is_alone = |lidar: &&str| !cameras.values().flatten().any(|beside| beside == lidar);
        let alone = lidars.iter().copied().filter(is_alone).map(str::to_owned).collect();
        Self {
            folder: run.folder.to_owned(),
            labelled: run.labelled(),
            cameras,
            alone,
            classes: run.classes.clone(),
            first: run.first,
            every: run.sensors.iter().map(|(name, sensor)| (name.clone(), sensor.every.into())).collect(),
            written: Vec::new(),
        }
    }

    fn camera(
        &mut self,
        name: &str,
        camera: &CameraCapture,
        file: &CaptureFile,
        camera_from_lidar: &DAffine3,
    ) -> Result<(), FrameError> {
        self.write_file(file, "image_2", "png", files::png(camera, CameraOutput::Color))?;
        if !camera.depth.is_empty() {
            self.write_file(file, "depth", "png", files::png(camera, CameraOutput::Depth))?;
        }
        if !camera.class.is_empty() {
            self.write_file(file, "semantic", "png", files::png(camera, CameraOutput::Class))?;
        }
        if self.labelled.contains(name) {
            let labels: String = camera.boxes.iter().filter_map(|seen| self.label(seen, camera)).collect();
            self.write_file(file, "label_2", "txt", Ok(labels.into_bytes()))?;
        }
        // It begins at the picture before, whose files it is beside.
        let before = self.every.get(name).and_then(|every| file.step.checked_sub(*every));
        if let Some(step) = before.filter(|step| *step >= self.first)
            && !camera.flow.flags.is_empty()
        {
            let before = CaptureFile { home: file.home.clone(), step };
            self.write_file(&before, "flow", "png", files::png(camera, CameraOutput::Flow))?;
        }
        let Some(intrinsics) = camera.intrinsics else { return Ok(()) };
        let calibration = calibration(intrinsics, camera_from_lidar);
        self.write_file(file, "calib", "txt", Ok(calibration.text().into_bytes()))
    }

    /// The line of a thing; `None` of what is no thing, or not seen.
    fn label(&self, thing: &ObjectBox, camera: &CameraCapture) -> Option<String> {
        let class = self.classes.get(Class(thing.class)).filter(|class| class.is_thing && thing.pixels > 0)?;
        Some(label(thing, name_of_class(&class.name), (camera.width, camera.height)).line())
    }

    fn scan(&mut self, lidar: &LidarCapture, file: &CaptureFile) -> Result<(), FrameError> {
        let LidarCapture { scan, instance, class, .. } = lidar;
        let points = scan.returns(&scan.xyz);
        self.write_file(file, "velodyne", "bin", velodyne(&points, &scan.returns(&scan.intensity)))?;
        let labels = semantic_kitti::encode(&scan.returns(class), &scan.returns(instance));
        self.write_file(file, "labels", "label", labels)
    }

    fn write_file(
        &mut self,
        CaptureFile { home, step }: &CaptureFile,
        kind: &str,
        extension: &str,
        bytes: io::Result<Vec<u8>>,
    ) -> Result<(), FrameError> {
        let folder = home.join(kind);
        let path = folder.join(format!("{step:06}.{extension}"));
        let bytes = bytes.map_err(|error| OutputError::io(&path, error))?;
        output::make_folder(&folder)?;
        output::write_whole(&path, &bytes)?;
        self.written.push(path);
        Ok(())
    }
}

/// Place of a capture's files.
struct CaptureFile {
    home: PathBuf,
    step: u64,
}

impl CaptureFile {
    fn of(folder: &Path, sensor: &SensorCapture, step: u64) -> Self {
        Self { home: folder.join(&sensor.name).join("kitti"), step }
    }
}

impl RunWriter for KittiWriter {
    fn write(&mut self, capture: &Capture, poses: &Poses) -> Result<(), FrameError> {
        for sensor in &capture.sensors {
            let file = CaptureFile::of(&self.folder, sensor, capture.step);
            match &sensor.data {
                SensorData::Camera(camera) => {
                    let Some(beside) = self.cameras.get(&sensor.name) else { continue };
                    let lidar = beside.as_ref().and_then(|name| capture.get(name));
                    let own = &sensor.world_from_sensor;
                    let due = lidar.map(|lidar| camera_from_lidar(own, &lidar.world_from_sensor));
                    let from_lidar = due.or_else(|| {
                        // It is there all the same.
                        let [camera, lidar] = [poses.get(&sensor.name)?, poses.get(beside.as_ref()?)?];
                        Some(camera_from_lidar(camera, lidar))
                    });
                    let from_lidar = from_lidar.unwrap_or_else(looking_ahead);
                    self.camera(&sensor.name, camera, &file, &from_lidar)?;
                    if let Some(lidar) = lidar.and_then(SensorCapture::lidar) {
                        self.scan(lidar, &file)?;
                    }
                }
                SensorData::Lidar(lidar) if self.alone.contains(&sensor.name) => self.scan(lidar, &file)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError> {
        Ok(self.written)
    }
}

/// KITTI's name of a class of Cityscapes; other names stay.
fn name_of_class(name: &str) -> &str {
    match name {
        "car" => "Car",
        "truck" => "Truck",
        "person" => "Pedestrian",
        "rider" | "bicycle" => "Cyclist",
        "train" => "Tram",
        _ => name,
    }
}

/// The label of a thing: its whole outline within the picture, the lower face of its box, and how it is turned.
fn label<'a>(thing: &ObjectBox, class: &'a str, (width, height): (u32, u32)) -> Label<'a> {
    let [w, x, y, z] = thing.quaternion;
    let camera_from_thing = DQuat::from_xyzw(x, y, z, w);
    let [length, breadth, tall] = thing.size.map(f64::from);
    let location = DVec3::from(thing.center) - camera_from_thing * DVec3::Y * (tall / 2.0);
    let location = location.to_array();
    let rotation_y = kitti::rotation_y((camera_from_thing * DVec3::Z).to_array());
    let [left, top, right, bottom] = thing.box_full.map(f64::from);
    let (width, height) = (f64::from(width), f64::from(height));
    let within = [left.clamp(0.0, width), top.clamp(0.0, height), right.clamp(0.0, width), bottom.clamp(0.0, height)];
    Label {
        class,
        // Of pinholes it is always known.
        truncated: thing.truncated.unwrap_or_default().into(),
        occluded: kitti::occluded(thing.visible),
        alpha: kitti::alpha(rotation_y, location),
        bbox: kitti::inclusive(within),
        size: [tall, breadth, length],
        location,
        rotation_y,
    }
}

/// The name of the thing that a sensor is on; empty where it stands by itself.
fn mounted_on(sensor: &str) -> &str {
    sensor.rsplit_once('/').map_or("", |(thing, _)| thing)
}

/// From the axes of a lidar's points to those of a camera's outputs; both poses are of the entities.
fn camera_from_lidar(world_from_camera: &DAffine3, world_from_lidar: &DAffine3) -> DAffine3 {
    let world_from_outputs = *world_from_camera * DAffine3::from_mat3(ENTITY_FROM_CAMERA);
    world_from_outputs.inverse() * *world_from_lidar * DAffine3::from_mat3(ENTITY_FROM_LIDAR)
}

/// Without a lidar: as if one were in the camera, and looked along it.
fn looking_ahead() -> DAffine3 {
    let about = DAffine3::from_rotation_y(std::f64::consts::PI);
    camera_from_lidar(&DAffine3::IDENTITY, &about)
}

/// All four cameras of KITTI are this one.
fn calibration(k: Intrinsics, camera_from_lidar: &DAffine3) -> Calibration {
    let projection = rows(&DAffine3::from_mat3(k.matrix()));
    let [x, y, z] =
        [DMat3::IDENTITY.x_axis, DMat3::IDENTITY.y_axis, DMat3::IDENTITY.z_axis].map(|axis| axis.to_array());
    Calibration {
        projections: [projection; 4],
        rectification: [x, y, z].as_flattened().try_into().unwrap_or_default(),
        camera_from_lidar: rows(camera_from_lidar),
        lidar_from_imu: rows(&DAffine3::IDENTITY),
    }
}

/// The three rows of a matrix of four columns.
fn rows(matrix: &DAffine3) -> [f64; 12] {
    let mut rows = [0.0; 12];
    let columns = matrix.to_cols_array();
    rows.iter_mut().enumerate().for_each(|(i, value)| *value = columns[i % 4 * 3 + i / 4]);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_lidar_looks_along_the_cars_front_and_a_camera_back_until_it_is_turned() {
        let turned = DAffine3::from_rotation_y(std::f64::consts::PI);
        let camera = DAffine3::from_translation(DVec3::new(0.0, 1.65, 1.3)) * turned;
        let lidar = DAffine3::from_translation(DVec3::new(0.0, 1.73, 1.03));
        let found = camera_from_lidar(&camera, &lidar);
        // 10 m before the lidar, 2 m to its left, 1 m above: KITTI's `Tr_velo_to_cam` has x = −y, y = −z, z = x.
        let point = found.transform_point3(DVec3::new(10.0, 2.0, 1.0));
        assert!(point.abs_diff_eq(DVec3::new(-2.0, -1.08, 9.73), 1e-12), "{point}");
        // Without a lidar the camera's own axes, named as a lidar's.
        let point = looking_ahead().transform_point3(DVec3::new(10.0, 2.0, 1.0));
        assert!(point.abs_diff_eq(DVec3::new(-2.0, -1.0, 10.0), 1e-12), "{point}");
        assert_eq!((mounted_on("ego/front"), mounted_on("a/b/c"), mounted_on("top")), ("ego", "a/b", ""));
    }

    #[test]
    fn a_box_that_is_seen_from_behind_has_the_numbers_of_kitti() {
        // 2 wide, 1 high, 1 long, 10 m ahead with its middle on the axis, of 100 × 80 pixels with f = 100 and the axis
        // at the corner of four pixels: its near face, 9.5 m away, is 21.05 pixels wide. It looks as the camera does.
        let half = [1.0, 0.5].map(|metres| metres * 100.0 / 9.5);
        let thing = ObjectBox {
            id: 1,
            class: 26,
            box_visible: [39.0, 34.0, 61.0, 46.0],
            box_full: [50.0 - half[0], 40.0 - half[1], 50.0 + half[0], 40.0 + half[1]],
            visible: 0.75,
            truncated: Some(0.25),
            pixels: 264,
            center: [0.0, 0.0, 10.0],
            size: [1.0, 2.0, 1.0],
            // Half a turn about the optical axis: X left, Y up, Z forward.
            quaternion: [0.0, 0.0, 0.0, 1.0],
            world_center: [0.0; 3],
            world_quaternion: [1.0, 0.0, 0.0, 0.0],
            motion: None,
            corners_uv: [None; 8],
        };
        let line = label(&thing, name_of_class("car"), (100, 80)).line();
        let expected = "Car 0.2500 1 -1.5708 39.4737 34.7368 59.5263 44.2632 1.0000 2.0000 1.0000 0.0000 0.5000 \
                        10.0000 -1.5708\n";
        assert_eq!(line, expected);
        // What reaches out of the picture ends there, at the middle of its last pixel.
        let cut = ObjectBox { box_full: [-5.0, 34.0, 120.0, 46.0], ..thing };
        assert_eq!(label(&cut, "Car", (100, 80)).bbox, [0.0, 34.0, 99.0, 45.0]);
    }

    #[test]
    fn matrices_are_written_row_by_row() {
        let k = Intrinsics { fx: 2.0, fy: 3.0, cx: 4.0, cy: 5.0 };
        let moved = DAffine3::from_translation(DVec3::new(7.0, 8.0, 9.0));
        let Calibration { projections, rectification, camera_from_lidar, .. } = calibration(k, &moved);
        assert_eq!(projections[2], [2.0, 0.0, 4.0, 0.0, 0.0, 3.0, 5.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        assert_eq!(rectification, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(camera_from_lidar, [1.0, 0.0, 0.0, 7.0, 0.0, 1.0, 0.0, 8.0, 0.0, 0.0, 1.0, 9.0]);
    }
}
