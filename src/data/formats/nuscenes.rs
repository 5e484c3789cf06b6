//! The boxes of a run as the tables of nuScenes (Caesar and others, "nuScenes: A Multimodal Dataset for Autonomous
//! Driving", CVPR 2020), of pinhole cameras with colours and boxes, and of lidars.
//!
//! ```text
//! DIR/nuscenes/sample.json …        the tables, for NuScenes(version="nuscenes", dataroot="DIR")
//! DIR/nuscenes/map.png              a map with nothing on it, which its development kit asks for
//! DIR/ego/front/color_00012.png     the pictures
//! DIR/ego/top/points_00012.pcd.bin  returns of lidars: x, y, z, intensity from 0 to 255, ring
//! ```
//!
//! A step after which a camera is due is a sample. The global frame has Z up. The ego frame of each measurement is its
//! sensor's place, X forward, Y left, Z up: of vehicles, a run knows no place that is equal in all of its parts.

use super::files;
use super::format::{FileFormat, Makes, Poses, RunInfo, RunWriter};
use super::parts::{Merge, append_all};
use super::run_folder::RunFolder;
use crate::export::array::{Column, interleave};
use crate::export::{coco, picture};
use crate::frames::FrameError;
use crate::output::{self, OutputError};
use crate::sense::captures::axes::{ENTITY_FROM_LIDAR, ROS_FROM_WORLD};
use crate::sense::captures::boxes::ObjectBox;
use crate::sense::captures::capture::{Capture, SensorCapture, SensorData};
use crate::sense::captures::lidar::LidarCapture;
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};
use systems::sensors::{CameraOutput, Class, Classes, SensorKind};

/// Sensor without which there is no sample.
const NEEDS: &str = "a camera with color and boxes and the lens of a pinhole";
/// The map's picture.
const MAP: &str = "nuscenes/map.png";
/// The tables, by the names of their files.
const TABLES: [&str; 13] = [
    "nuscenes/attribute.json",
    "nuscenes/calibrated_sensor.json",
    "nuscenes/category.json",
    "nuscenes/ego_pose.json",
    "nuscenes/instance.json",
    "nuscenes/log.json",
    "nuscenes/map.json",
    "nuscenes/sample.json",
    "nuscenes/sample_annotation.json",
    "nuscenes/sample_data.json",
    "nuscenes/scene.json",
    "nuscenes/sensor.json",
    "nuscenes/visibility.json",
];
/// Shares that are seen: the least of each level, with its name.
const VISIBILITIES: [(f32, &str); 4] = [(0.0, "v0-40"), (0.4, "v40-60"), (0.6, "v60-80"), (0.8, "v80-100")];
/// From a camera's outputs (X right, Y down, Z forward) to X forward, Y left, Z up.
const EGO_FROM_CAMERA: DMat3 = DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X);

impl FileFormat {
    /// Tables of boxes of the whole run.
    pub const NUSCENES: Self = Self {
        name: "nuscenes",
        help: "nuscenes/*.json for the run: boxes in space of pinhole cameras with color and boxes; with the color \
               pictures, and the returns of lidars",
        endings: &["json", "png", "bin"],
        needs: Some(NEEDS),
        accepts: |kind, output| match (kind, output) {
            (SensorKind::Camera(camera), Some(CameraOutput::Color | CameraOutput::Boxes)) => {
                let is_labelled = camera.outputs.has(CameraOutput::Color) && camera.outputs.has(CameraOutput::Boxes);
                is_labelled && camera.intrinsics().is_some() && !camera.lens.has_distortion()
            }
            _ => matches!(kind, SensorKind::Lidar(_)),
        },
        check: |run| {
            let camera = run.held_by(Self::NUSCENES, true).next();
            camera.map(drop).ok_or(FrameError::NothingToHold { format: Self::NUSCENES.name, needs: NEEDS })
        },
        makes: Makes::Run(|run| Ok(Box::new(NuscenesWriter::new(run)))),
    };
}

/// The files of parts, put together.
pub(super) fn merged_files() -> impl Iterator<Item = (&'static str, Merge)> {
    let merge: Merge = |parts, path| append_all(parts, path, Table::append);
    TABLES.into_iter().map(move |name| (name, merge)).chain([(MAP, map_picture as Merge)])
}

/// A single pixel on which nothing is: the same for all runs.
fn map_picture(_: &[PathBuf], path: &Path) -> Result<Vec<u8>, FrameError> {
    let picture = picture::of_numbers((1, 1), [0].into_iter()).ok_or_else(|| io::Error::other("there are no pixels"));
    let encoded = picture.and_then(|picture| output::encode_png(&picture).map_err(io::Error::other));
    Ok(encoded.map_err(|error| OutputError::io(path, error))?)
}

type Row = Map<String, Value>;

/// Rows, each with a token of its own. Those of measurements are linked to the ones before and after.
#[derive(Default, Serialize, Deserialize)]
#[serde(from = "Vec<Row>", into = "Vec<Row>")]
struct Table {
    rows: Vec<Row>,
    /// Places of rows by their tokens.
    places: HashMap<String, usize>,
    /// The last row of each chain, by what its rows are of.
    ends: HashMap<String, usize>,
}

impl Clone for Table {
    fn clone(&self) -> Self {
        Self::from(self.rows.clone())
    }
}

impl From<Vec<Row>> for Table {
    fn from(rows: Vec<Row>) -> Self {
        let mut table = Self::default();
        rows.into_iter().for_each(|row| table.add(row));
        table
    }
}

impl From<Table> for Vec<Row> {
    fn from(table: Table) -> Self {
        table.rows
    }
}

impl Table {
    /// Adds a row. Of one that is there, counts are added up, and the last of what is counted is the new one's.
    fn add(&mut self, mut row: Row) {
        let text = |row: &Row, name: &str| row.get(name).and_then(Value::as_str).map(str::to_owned);
        let token = text(&row, "token").unwrap_or_default();
        if let Some(&place) = self.places.get(&token) {
            let known = &mut self.rows[place];
            for (name, more) in row {
                if name.starts_with("nbr_") {
                    let sum = known.get(&name).and_then(Value::as_u64).unwrap_or(0) + more.as_u64().unwrap_or(0);
                    known.insert(name, sum.into());
                } else if name.starts_with("last_") {
                    known.insert(name, more);
                }
            }
            return;
        }
        let place = self.rows.len();
        if row.contains_key("prev") {
            let of = ["instance_token", "calibrated_sensor_token", "scene_token"].iter().find_map(|of| text(&row, of));
            if let Some(before) = self.ends.insert(of.unwrap_or_default(), place) {
                let before = &mut self.rows[before];
                row.insert("prev".into(), text(before, "token").into());
                before.insert("next".into(), token.clone().into());
            }
        }
        self.places.insert(token, place);
        self.rows.push(row);
    }

    fn append(&mut self, more: Self) {
        more.rows.into_iter().for_each(|row| self.add(row));
    }
}

/// Name of a row: the same in every run.
fn token(table: &str, row: impl Display) -> String {
    blake3::hash(format!("{table} {row}").as_bytes()).to_hex()[..32].to_owned()
}

/// Tables that are being collected, which are written at the end; files of measurements are written at once.
struct NuscenesWriter {
    folder: RunFolder,
    cameras: BTreeSet<String>,
    classes: Classes,
    /// Colours have no other format that writes their pictures.
    writes_colors: bool,
    /// By the names of their files.
    tables: BTreeMap<&'static str, Table>,
}

impl NuscenesWriter {
    fn new(run: &RunInfo) -> Self {
        let mut writer = Self {
            folder: RunFolder::new(run.folder),
            cameras: run.held_by(FileFormat::NUSCENES, true).map(str::to_owned).collect(),
            classes: run.classes.clone(),
            writes_colors: !run.formats.contains(&FileFormat::PNG),
            tables: TABLES.map(|name| (name, Table::default())).into(),
        };
        let log = token("log", "");
        writer.add(
            "nuscenes/map.json",
            token("map", ""),
            json!({
                "log_tokens": [log],
                "category": "semantic_prior",
                "filename": MAP,
            }),
        );
        // Time counts from the beginning of the run.
        writer.add(
            "nuscenes/log.json",
            log,
            json!({
                "logfile": "",
                "vehicle": "",
                "date_captured": "1970-01-01",
                "location": "simulation",
            }),
        );
        for (i, (least, level)) in VISIBILITIES.into_iter().enumerate() {
            let description = format!("at least {:.0} % of the object is seen", least * 100.0);
            writer.add(
                "nuscenes/visibility.json",
                visibility_token(i),
                json!({
                    "level": level,
                    "description": description,
                }),
            );
        }
        for class in run.classes.0.iter().filter(|class| class.is_thing) {
            writer.add(
                "nuscenes/category.json",
                token("category", class.id),
                json!({
                    "name": class.name,
                    "description": class.name,
                    "index": class.id,
                }),
            );
        }
        for is_camera in [true, false] {
            for name in run.held_by(FileFormat::NUSCENES, is_camera) {
                let intrinsics = match run.sensors.get(name).map(|sensor| &sensor.kind) {
                    Some(SensorKind::Camera(camera)) => camera.intrinsics(),
                    _ => None,
                };
                let matrix = intrinsics.map(|intrinsics| intrinsics.matrix());
                let rows = matrix.map_or(json!([]), |k| json!([0, 1, 2].map(|row| k.row(row).to_array())));
                let axes = if is_camera { EGO_FROM_CAMERA } else { DMat3::IDENTITY };
                let sensor = token("sensor", name);
                writer.add(
                    "nuscenes/calibrated_sensor.json",
                    token("calibrated_sensor", name),
                    json!({
                        "sensor_token": sensor,
                        "translation": [0.0, 0.0, 0.0],
                        "rotation": quaternion(axes),
                        "camera_intrinsic": rows,
                    }),
                );
                writer.add(
                    "nuscenes/sensor.json",
                    sensor,
                    json!({
                        "channel": name,
                        "modality": if is_camera { "camera" } else { "lidar" },
                    }),
                );
            }
        }
        writer
    }

    fn add(&mut self, table: &'static str, token: String, row: Value) {
        let Value::Object(mut row) = row else { return };
        row.insert("token".into(), token.into());
        self.tables.entry(table).or_default().add(row);
    }

    /// A measurement, with the place of its sensor; its file has been written.
    fn measurement(&mut self, sensor: &SensorCapture, at: Sample, file: &str, size: (u32, u32)) {
        let global_from_outputs = ROS_FROM_WORLD * sensor.world_from_outputs().matrix3;
        let is_camera = self.cameras.contains(&sensor.name);
        let ego_from_outputs = if is_camera { EGO_FROM_CAMERA } else { DMat3::IDENTITY };
        let (sample, microseconds) = (at.token(), at.microseconds());
        let own = token("sample_data", format!("{} {}", sensor.name, at.step));
        self.add(
            "nuscenes/ego_pose.json",
            own.clone(),
            json!({
                "timestamp": microseconds,
                "translation": (ROS_FROM_WORLD * sensor.world_from_sensor.translation).to_array(),
                "rotation": quaternion(global_from_outputs * ego_from_outputs.transpose()),
            }),
        );
        self.add(
            "nuscenes/sample_data.json",
            own.clone(),
            json!({
                "sample_token": sample,
                "ego_pose_token": own,
                "calibrated_sensor_token": token("calibrated_sensor", &sensor.name),
                "timestamp": microseconds,
                "fileformat": if is_camera { "png" } else { "pcd" },
                "is_key_frame": true,
                "width": size.0,
                "height": size.1,
                "filename": file,
                "prev": "",
                "next": "",
            }),
        );
    }

    fn annotation(&mut self, thing: &Annotation, at: Sample) {
        let instance = token("instance", thing.shown.id);
        let own = token("sample_annotation", format!("{} {}", thing.shown.id, at.step));
        let Place { translation, rotation, size } = Place::of(&thing.shown);
        let level = VISIBILITIES.iter().rposition(|(least, _)| thing.shown.visible >= *least).unwrap_or(0);
        self.add(
            "nuscenes/instance.json",
            instance.clone(),
            json!({
                "category_token": token("category", thing.shown.class),
                "nbr_annotations": 1,
                "first_annotation_token": own,
                "last_annotation_token": own,
            }),
        );
        self.add(
            "nuscenes/sample_annotation.json",
            own,
            json!({
                "sample_token": at.token(),
                "instance_token": instance,
                "visibility_token": visibility_token(level),
                "attribute_tokens": [],
                "translation": translation,
                "size": size,
                "rotation": rotation,
                "num_lidar_pts": thing.points,
                "num_radar_pts": 0,
                "prev": "",
                "next": "",
            }),
        );
    }
}

impl RunWriter for NuscenesWriter {
    fn write(&mut self, capture: &Capture, _: &Poses) -> Result<(), FrameError> {
        if !capture.sensors.iter().any(|sensor| self.cameras.contains(&sensor.name)) {
            return Ok(());
        }
        let at = Sample { step: capture.step, nanoseconds: capture.nanoseconds };
        let (own, scene) = (at.token(), token("scene", ""));
        self.add(
            "nuscenes/scene.json",
            scene.clone(),
            json!({
                "name": "scene-0001",
                "description": "",
                "log_token": token("log", ""),
                "nbr_samples": 1,
                "first_sample_token": own,
                "last_sample_token": own,
            }),
        );
        let sample = json!({ "timestamp": at.microseconds(), "scene_token": scene, "prev": "", "next": "" });
        self.add("nuscenes/sample.json", own, sample);
        let mut things: BTreeMap<u32, Annotation> = BTreeMap::new();
        for sensor in &capture.sensors {
            match &sensor.data {
                SensorData::Camera(camera) if self.cameras.contains(&sensor.name) => {
                    let file = format!("{}/color_{:05}.png", sensor.name, at.step);
                    if self.writes_colors {
                        self.folder.write(&file, files::png(camera, CameraOutput::Color))?;
                    }
                    self.measurement(sensor, at, &file, (camera.width, camera.height));
                    let is_thing = |class| self.classes.get(Class(class)).is_some_and(|class| class.is_thing);
                    for shown in camera.boxes.iter().filter(|shown| shown.pixels > 0 && is_thing(shown.class)) {
                        let thing = things.entry(shown.id).or_insert(Annotation { shown: *shown, points: 0 });
                        thing.shown.visible = thing.shown.visible.max(shown.visible);
                    }
                }
                SensorData::Lidar(lidar) => {
                    let file = format!("{}/points_{:05}.pcd.bin", sensor.name, at.step);
                    self.folder.write(&file, points(lidar, &sensor.world_from_outputs()))?;
                    self.measurement(sensor, at, &file, (0, 0));
                }
                _ => {}
            }
        }
        for instance in capture.sensors.iter().filter_map(SensorCapture::lidar).flat_map(|lidar| &lidar.instance) {
            if let Some(thing) = things.get_mut(instance) {
                thing.points += 1;
            }
        }
        things.values().for_each(|thing| self.annotation(thing, at));
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Vec<PathBuf>, FrameError> {
        for (name, table) in std::mem::take(&mut self.tables) {
            let mut bytes = Vec::new();
            let encoded = coco::write(&mut bytes, &table);
            self.folder.write(name, encoded.map(|()| bytes))?;
        }
        let map = map_picture(&[], &self.folder.path.join(MAP))?;
        self.folder.write(MAP, Ok(map))?;
        Ok(self.folder.written)
    }
}

/// Moment of a sample.
#[derive(Clone, Copy)]
struct Sample {
    step: u64,
    nanoseconds: u64,
}

impl Sample {
    fn token(self) -> String {
        token("sample", self.step)
    }

    fn microseconds(self) -> u64 {
        self.nanoseconds / 1000
    }
}

/// A thing in a sample: its box, with the largest share of it that a camera sees, and returns of lidars on it.
struct Annotation {
    shown: ObjectBox,
    points: u32,
}

/// A box in the global frame.
#[derive(Debug, PartialEq)]
struct Place {
    translation: [f64; 3],
    /// From its own axes, X forward, Y left, Z up: w, x, y, z.
    rotation: [f64; 4],
    /// Width, length, height.
    size: [f32; 3],
}

impl Place {
    fn of(shown: &ObjectBox) -> Self {
        let [w, x, y, z] = shown.world_quaternion;
        let world_from_thing = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w));
        let [length, width, height] = shown.size;
        Self {
            translation: (ROS_FROM_WORLD * DVec3::from(shown.world_center)).to_array(),
            rotation: quaternion(ROS_FROM_WORLD * world_from_thing * ENTITY_FROM_LIDAR),
            size: [width, length, height],
        }
    }
}

fn visibility_token(level: usize) -> String {
    (level + 1).to_string()
}

/// A rotation as w, x, y, z; of the two that there are, that of the positive w.
fn quaternion(rotation: DMat3) -> [f64; 4] {
    let rotation = DQuat::from_mat3(&rotation).normalize();
    let DQuat { w, x, y, z } = if rotation.w < 0.0 { -rotation } else { rotation };
    [w, x, y, z]
}

/// Returns in the axes that the lidar's outputs have at the capture, wherever it was when a column was fired.
fn points(lidar: &LidarCapture, scene_from_outputs: &DAffine3) -> io::Result<Vec<u8>> {
    let (scan, outputs_from_scene) = (&lidar.scan, scene_from_outputs.inverse());
    let place = |(i, xyz): (usize, &[f32; 3])| {
        let outputs_from_column = outputs_from_scene * lidar.scene_from_column((i / lidar.rings()) as u64);
        outputs_from_column.transform_point3(Vec3::from_array(*xyz).as_dvec3()).as_vec3().to_array()
    };
    let places = match lidar.sweep {
        true => scan.returns(&scan.xyz.iter().enumerate().map(place).collect::<Vec<_>>()),
        false => scan.returns(&scan.xyz),
    };
    let intensity: Vec<f32> = scan.returns(&scan.intensity).iter().map(|share| share * 255.0).collect();
    let ring: Vec<f32> = scan.returns(&scan.ring).iter().map(|ring| f32::from(*ring)).collect();
    let columns = [
        Column::new("xyz", &[3], places.as_flattened()),
        Column::new("intensity", &[], &intensity[..]),
        Column::new("ring", &[], &ring[..]),
    ];
    interleave(places.len(), &columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sense::captures::lidar::LidarScan;
    use crate::sense::captures::pose::Pose;
    use systems::sensors::LidarSensor;

    fn row(fields: Value) -> Row {
        serde_json::from_value(fields).expect("a row")
    }

    /// A lidar that drives 2 m ahead in a sweep of four columns, each with a return 5 m ahead.
    #[test]
    fn points_of_a_sweep_are_where_they_are_at_the_capture() {
        let sensor = LidarSensor { columns: 4, hz: 10.0, sweep: true, ..LidarSensor::default() };
        let moved = Pose { translation: DVec3::Z * 2.0, ..Pose::default() };
        let scan = LidarScan {
            xyz: vec![[5.0, 0.0, 0.0]; 4],
            intensity: vec![1.0; 4],
            ring: vec![0; 4],
            hit: vec![1; 4],
            ..LidarScan::default()
        };
        let columns = sensor.columns_between(0, 1, 0.1);
        let lidar = LidarCapture { scan, columns, sweep: true, poses: [Pose::default(), moved], ..Default::default() };
        let ahead = |lidar: &LidarCapture| {
            let bytes = points(lidar, &moved.world_from_points()).expect("bytes");
            let number = |point: &[u8]| f32::from_le_bytes(point[..4].try_into().expect("a number"));
            bytes.chunks(20).map(number).collect::<Vec<_>>()
        };
        assert_eq!(ahead(&lidar), [3.0, 3.5, 4.0, 4.5]);
        assert_eq!(ahead(&LidarCapture { sweep: false, ..lidar }), [5.0; 4]);
    }

    /// A car that looks along the scene's +X, 5 m ahead along the scene's +Z: global +Y and +X.
    #[test]
    fn a_box_is_turned_into_the_global_frame() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let shown = ObjectBox {
            id: 3,
            class: 26,
            box_visible: [0.0; 4],
            box_full: [0.0; 4],
            visible: 1.0,
            truncated: None,
            pixels: 1,
            center: [0.0; 3],
            size: [4.0, 1.8, 1.5],
            quaternion: [1.0, 0.0, 0.0, 0.0],
            world_center: [-2.0, 0.75, 5.0],
            // A quarter turn about Y: forward, +Z, becomes +X.
            world_quaternion: [half, 0.0, half, 0.0],
            motion: None,
            corners_uv: [None; 8],
        };
        let Place { translation, rotation, size } = Place::of(&shown);
        assert_eq!((translation, size), ([5.0, -2.0, 0.75], [1.8, 4.0, 1.5]));
        // A quarter turn about Z: forward, +X, becomes +Y.
        let off = rotation.iter().zip([half, 0.0, 0.0, half]).map(|(found, expected)| (found - expected).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12, "{rotation:?}");
    }

    /// A picture's right is the ego frame's −Y, its lower side −Z.
    #[test]
    fn cameras_are_calibrated_as_those_of_nuscenes() {
        assert_eq!(quaternion(EGO_FROM_CAMERA), [0.5, -0.5, 0.5, -0.5]);
        assert_eq!(quaternion(DMat3::IDENTITY), [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn rows_are_linked_by_what_they_are_of_and_counted() {
        let seen = |token: &str, of: &str| row(json!({ "token": token, "instance_token": of, "prev": "", "next": "" }));
        let counted = |only: &str| {
            row(json!({
                "token": "car",
                "nbr_annotations": 1,
                "first_annotation_token": only,
                "last_annotation_token": only,
            }))
        };
        let rows = [seen("a0", "a"), seen("b0", "b"), seen("a1", "a"), seen("a2", "a")];
        let whole = Table::from(rows.to_vec());
        let links = |table: &Table| -> Vec<String> {
            table.rows.iter().map(|row| format!("{}<{}>{}", row["prev"], row["token"], row["next"])).collect()
        };
        assert_eq!(links(&whole).join(" ").replace('"', ""), "<a0>a1 <b0> a0<a1>a2 a1<a2>");
        // Parts, put together.
        for cut in 0..=rows.len() {
            let mut merged = Table::from(rows[..cut].to_vec());
            merged.append(Table::from(rows[cut..].to_vec()));
            assert_eq!(links(&merged), links(&whole), "{cut}");
        }
        let mut counts = Table::from(vec![counted("x")]);
        counts.append(Table::from(vec![counted("y"), counted("z")]));
        let expected = json!({
            "token": "car", "nbr_annotations": 3, "first_annotation_token": "x", "last_annotation_token": "z",
        });
        assert_eq!(counts.rows, [row(expected)]);
    }
}
