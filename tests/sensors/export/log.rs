//! A log with every kind of message, and what its readers must find.

use super::{Files, SIZE, Seen, list, number};
use crate::common::prelude::*;
use relief::export::array::Column;
use relief::export::mcap;
use relief::export::ros::{
    BoxInPicture, BoxInSpace, CameraInfo, Clock, Distortion, FluidPressure, Header, Image, ImageAnnotations, Imu,
    Message, NavSatFix, Pixels, PointCloud2, SceneUpdate, TfMessage, TransformStamped,
};

const FRAME: &str = "ego/front";
const TURN: [f64; 4] = [0.5, -0.5, 0.5, 0.5];
const COLOR: [f64; 4] = [1.0, 0.5, 0.25, 1.0];

fn xyz([x, y, z]: [f64; 3]) -> Value {
    json!({"x": x, "y": y, "z": z})
}

fn xyzw([x, y, z, w]: [f64; 4]) -> Value {
    json!({"x": x, "y": y, "z": z, "w": w})
}

fn rgba([r, g, b, a]: [f64; 4]) -> Value {
    json!({"r": r, "g": g, "b": b, "a": a})
}

/// A topic, the name of the form, the size, the values, and the bytes that they are.
type Picture<'a> = (&'a str, &'a str, (u32, u32), Pixels<'a>, &'a [u8]);

/// A log, and what is expected of it.
struct Logged<'a> {
    log: mcap::Log<Vec<u8>>,
    expected: Vec<Value>,
    files: &'a mut Files,
    seen: &'a Seen,
    /// Number of this capture, from 0, and its time in nanoseconds.
    count: usize,
    time: u64,
}

impl Logged<'_> {
    fn header(&self) -> Header<'static> {
        Header { nanoseconds: self.time, frame: FRAME }
    }

    fn stamp(&self) -> Value {
        json!({"sec": self.time / 1_000_000_000, "nanosec": self.time % 1_000_000_000})
    }

    fn said_header(&self) -> Value {
        json!({"stamp": self.stamp(), "frame_id": FRAME})
    }

    fn write(&mut self, topic: &str, message: &impl Message, content: Value) {
        self.log.write(topic, self.time, message).expect("written");
        let (time, sequence) = (self.time, self.count);
        self.expected.push(json!({"topic": topic, "time": time, "sequence": sequence, "content": content}));
    }

    fn raw(&mut self, topic: &str, bytes: &[u8]) -> Value {
        self.files.raw(&format!("log{}{}", self.count, topic.replace('/', ".")), &[bytes.len()], bytes)
    }

    fn pictures(&mut self) {
        // Of 1.5 MiB, so that chunks end.
        let large = list(1024 * 512 * 3, |i| number(i + self.count) as u8);
        let Seen { depth, class, instance, ring, .. } = self.seen;
        let pictures: [Picture; 5] = [
            ("/large", "rgb8", (1024, 512), Pixels::Rgb(&large), &large),
            ("/depth", "32FC1", SIZE, Pixels::Float32(depth), bytemuck::cast_slice(depth)),
            ("/class", "mono8", SIZE, Pixels::Mono8(class), class),
            ("/instance", "32SC1", SIZE, Pixels::Signed32(instance), bytemuck::cast_slice(instance)),
            ("/ring", "16UC1", (8, 5), Pixels::Unsigned16(ring), bytemuck::cast_slice(ring)),
        ];
        for (topic, encoding, size, pixels, bytes) in pictures {
            let content = json!({
                "header": self.said_header(), "height": size.1, "width": size.0, "encoding": encoding,
                "is_bigendian": 0, "step": bytes.len() as u32 / size.1, "data": self.raw(topic, bytes),
            });
            self.write(topic, &Image { header: self.header(), size, pixels }, content);
        }
    }

    fn camera(&mut self) {
        let (brown, rational, equidistant) = ([0.1, -0.2, 0.01, 0.02, 0.3], [0.1; 8], [0.25; 4]);
        let (name, distortion, d) = [
            ("plumb_bob", Distortion::PlumbBob(brown), &brown[..]),
            ("rational_polynomial", Distortion::RationalPolynomial(rational), &rational),
            ("equidistant", Distortion::Equidistant(equidistant), &equidistant),
        ][self.count];
        let [fx, fy, cx, cy] = [72.5, 71.5, 11.0, 9.25];
        let content = json!({
            "header": self.said_header(), "height": SIZE.1, "width": SIZE.0, "distortion_model": name, "d": d,
            "k": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            "r": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            "p": [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            "binning_x": 0, "binning_y": 0,
            "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": false},
        });
        let camera = CameraInfo { header: self.header(), size: SIZE, intrinsics: [fx, fy, cx, cy], distortion };
        self.write("/camera_info", &camera, content);
    }

    fn points(&mut self) {
        let Seen { points, intensity, ring, .. } = self.seen;
        let columns = [Column::new("intensity", &[], &intensity[..]), Column::new("ring", &[], &ring[..])];
        let cloud = PointCloud2 { header: self.header(), points, columns: &columns };
        let field = |(name, offset, datatype): (&str, u32, u8)| json!({"name": name, "offset": offset, "datatype": datatype, "count": 1});
        let fields = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("ring", 16, 4)].map(field);
        let record = |i: usize| {
            let place = points[i].map(f32::to_le_bytes);
            [place.as_flattened(), &intensity[i].to_le_bytes(), &ring[i].to_le_bytes()].concat()
        };
        let data: Vec<u8> = (0..points.len()).flat_map(record).collect();
        let content = json!({
            "header": self.said_header(), "height": 1, "width": 40, "fields": fields, "is_bigendian": false,
            "point_step": 18, "row_step": 720, "data": self.raw("/points", &data), "is_dense": true,
        });
        self.write("/points", &cloud, content);
    }

    fn motion(&mut self) {
        let header = self.header();
        let is_known = self.count > 0;
        let orientation = is_known.then_some(TURN);
        let covariances = [[0.0; 9], [1.0; 9], [2.0; 9]];
        let [velocity, acceleration] = [[0.1, 0.2, 0.3], [0.0, 0.25, 9.81]];
        let unknown = if is_known { 0.0 } else { -1.0 };
        let content = json!({
            "header": self.said_header(), "orientation": xyzw(orientation.unwrap_or([0.0, 0.0, 0.0, 1.0])),
            "orientation_covariance": [unknown, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            "angular_velocity": xyz(velocity), "angular_velocity_covariance": covariances[1],
            "linear_acceleration": xyz(acceleration), "linear_acceleration_covariance": covariances[2],
        });
        let imu =
            Imu { header, orientation, angular_velocity: velocity, linear_acceleration: acceleration, covariances };
        self.write("/imu", &imu, content);

        let covariance = is_known.then_some([3.0; 9]);
        let content = json!({
            "header": self.said_header(), "status": {"status": 0, "service": 1}, "latitude": 48.25,
            "longitude": -11.5, "altitude": 519.75, "position_covariance": covariance.unwrap_or_default(),
            "position_covariance_type": if is_known { 3 } else { 0 },
        });
        let fix = NavSatFix { header, latitude: 48.25, longitude: -11.5, altitude: 519.75, covariance };
        self.write("/gnss", &fix, content);

        let content = json!({"header": self.said_header(), "fluid_pressure": 101_325.5, "variance": 144.0});
        self.write("/air", &FluidPressure { header, pressure: 101_325.5, variance: 144.0 }, content);
    }

    /// None, one, and two frames.
    fn frames(&mut self) {
        let (translation, header) = ([1.5, 2.5, 3.5], self.header());
        let names = &["ego", "ego/top lidar"][..self.count];
        let transform = |child: &&'static str| TransformStamped { header, child, translation, rotation: TURN };
        let transforms: Vec<TransformStamped> = names.iter().map(transform).collect();
        let moved = json!({"translation": xyz(translation), "rotation": xyzw(TURN)});
        let said = |child| json!({"header": self.said_header(), "child_frame_id": child, "transform": moved});
        let content = json!({"transforms": names.iter().map(said).collect::<Vec<_>>()});
        self.write("/tf", &TfMessage(&transforms), content);
        self.write("/clock", &Clock(self.time), json!({"clock": self.stamp()}));
    }

    /// None, one, and two boxes.
    fn boxes(&mut self) {
        let (count, stamp, nanoseconds) = (self.count, self.stamp(), self.time);
        let flat = BoxInPicture { edges: [1.0, 2.0, 8.0, 9.5], color: COLOR, label: "car 7" };
        let corner = |[x, y]: [f64; 2]| json!({"x": x, "y": y});
        let corners = [[1.0, 2.0], [8.0, 2.0], [8.0, 9.5], [1.0, 9.5]].map(corner);
        let outline = json!({
            "timestamp": stamp, "type": 2, "points": corners, "outline_color": rgba(COLOR), "outline_colors": [],
            "fill_color": rgba([0.0; 4]), "thickness": 1.0,
        });
        let text = json!({
            "timestamp": stamp, "position": corner([1.0, 2.0]), "text": "car 7", "font_size": 12.0,
            "text_color": rgba(COLOR), "background_color": rgba([0.0; 4]),
        });
        let content = json!({"circles": [], "points": vec![outline; count], "texts": vec![text; count]});
        self.write("/boxes", &ImageAnnotations { nanoseconds, boxes: &[flat; 2][..count] }, content);

        let (center, size) = ([1.0, 2.0, 3.0], [4.5, 1.75, 1.5]);
        let solid = BoxInSpace { id: 7, class: "car", center, rotation: TURN, size, color: COLOR };
        let pose = json!({"position": xyz(center), "orientation": xyzw(TURN)});
        let entity = json!({
            "timestamp": stamp, "frame_id": FRAME, "id": "7", "lifetime": {"sec": 0, "nanosec": 0},
            "frame_locked": false, "metadata": [{"key": "class", "value": "car"}], "arrows": [],
            "cubes": [{"pose": pose, "size": xyz(size), "color": rgba(COLOR)}], "spheres": [], "cylinders": [],
            "lines": [], "triangles": [], "texts": [], "models": [],
        });
        let deletions = json!([{"timestamp": stamp, "type": 1, "id": ""}]);
        let content = json!({"deletions": deletions, "entities": vec![entity; count]});
        self.write("/objects", &SceneUpdate { header: self.header(), boxes: &[solid; 2][..count] }, content);
    }
}

/// A log of three captures within two and a half seconds.
pub fn add_log(files: &mut Files, seen: &Seen) {
    let log = mcap::Log::new(Vec::new()).expect("begun");
    let mut logged = Logged { log, expected: Vec::new(), files, seen, count: 0, time: 0 };
    for (count, time) in [0, 16_666_667, 2_500_000_000].into_iter().enumerate() {
        (logged.count, logged.time) = (count, time);
        logged.pictures();
        logged.camera();
        logged.points();
        logged.motion();
        logged.frames();
        logged.boxes();
    }
    let Logged { log, expected, files, .. } = logged;
    files.add("log.mcap", log.finish().expect("written"));
    files.expect("mcap", "log.mcap", json!(expected));
}
