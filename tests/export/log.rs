//! A log with every kind of message, and what its readers must find.

use crate::{Files, SIZE, Seen, list, number};
use relief::export::array::Column;
use relief::export::mcap;
use relief::export::ros::{
    BoxInPicture, BoxInSpace, CameraInfo, Clock, Distortion, Header, Image, ImageAnnotations, Imu, NavSatFix, Pixels,
    PointCloud2, SceneUpdate, TfMessage, TransformStamped,
};
use serde_json::{Value, json};

fn xyz([x, y, z]: [f64; 3]) -> Value {
    json!({"x": x, "y": y, "z": z})
}

fn xyzw([x, y, z, w]: [f64; 4]) -> Value {
    json!({"x": x, "y": y, "z": z, "w": w})
}

fn rgba([r, g, b, a]: [f64; 4]) -> Value {
    json!({"r": r, "g": g, "b": b, "a": a})
}

pub fn add_log(files: &mut Files, seen: &Seen) {
    let mut log = mcap::Log::new(Vec::new()).expect("begun");
    let mut expected = Vec::new();
    // Two and a half seconds; no picture of 1.5 MiB fits into a chunk with the next.
    for (count, time) in [0, 16_666_667, 2_500_000_000].into_iter().enumerate() {
        let stamp = json!({"sec": time / 1_000_000_000, "nanosec": time % 1_000_000_000});
        let header = Header { nanoseconds: time, frame: "ego/front" };
        let said = json!({"stamp": stamp, "frame_id": "ego/front"});
        let mut found = |topic: &str, content: Value| {
            expected.push(json!({"topic": topic, "time": time, "sequence": count, "content": content}));
        };

        log.write("/clock", time, &Clock(time)).expect("written");
        found("/clock", json!({"clock": stamp}));
        let large = list(1024 * 512 * 3, |i| number(i + count) as u8);
        let pictures: [(&str, &str, (u32, u32), Pixels, Vec<u8>); 5] = [
            ("/large", "rgb8", (1024, 512), Pixels::Rgb(&large), large.clone()),
            ("/depth", "32FC1", SIZE, Pixels::Float32(&seen.depth), bytemuck::cast_slice(&seen.depth).to_vec()),
            ("/class", "mono8", SIZE, Pixels::Mono8(&seen.class), seen.class.clone()),
            ("/ids", "32SC1", SIZE, Pixels::Signed32(&seen.instance), bytemuck::cast_slice(&seen.instance).to_vec()),
            ("/ring", "16UC1", (8, 5), Pixels::Unsigned16(&seen.ring), bytemuck::cast_slice(&seen.ring).to_vec()),
        ];
        for (topic, encoding, size, pixels, bytes) in pictures {
            log.write(topic, time, &Image { header, size, pixels }).expect("written");
            let step = bytes.len() as u32 / size.1;
            let data = files.raw(&format!("log{count}{}", topic.replace('/', ".")), &[bytes.len()], &bytes[..]);
            found(
                topic,
                json!({
                    "header": said, "height": size.1, "width": size.0, "encoding": encoding, "is_bigendian": 0,
                    "step": step, "data": data,
                }),
            );
        }

        let distortions = [
            ("plumb_bob", Distortion::PlumbBob([0.1, -0.2, 0.01, 0.02, 0.3])),
            ("rational_polynomial", Distortion::RationalPolynomial([0.1; 8])),
            ("equidistant", Distortion::Equidistant([0.25; 4])),
        ];
        let (name, distortion) = distortions[count];
        let [fx, fy, cx, cy] = [72.5, 71.5, 11.0, 9.25];
        let camera = CameraInfo { header, size: SIZE, intrinsics: [fx, fy, cx, cy], distortion };
        log.write("/camera_info", time, &camera).expect("written");
        let d = match distortion {
            Distortion::PlumbBob(d) => d.to_vec(),
            Distortion::RationalPolynomial(d) => d.to_vec(),
            Distortion::Equidistant(d) => d.to_vec(),
        };
        found(
            "/camera_info",
            json!({
                "header": said, "height": SIZE.1, "width": SIZE.0, "distortion_model": name, "d": d,
                "k": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
                "r": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
                "p": [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
                "binning_x": 0, "binning_y": 0,
                "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": false},
            }),
        );

        let columns = [Column::new("intensity", &[], &seen.intensity[..]), Column::new("ring", &[], &seen.ring[..])];
        let cloud = PointCloud2 { header, points: &seen.points, columns: &columns };
        log.write("/points", time, &cloud).expect("written");
        let field = |(name, offset, datatype): (&str, u32, u8)| json!({"name": name, "offset": offset, "datatype": datatype, "count": 1});
        let fields = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("ring", 16, 4)].map(field);
        let data: Vec<u8> = (0..40)
            .flat_map(|i| {
                let place = seen.points[i].map(f32::to_le_bytes);
                [place.as_flattened(), &seen.intensity[i].to_le_bytes(), &seen.ring[i].to_le_bytes()].concat()
            })
            .collect();
        let data = files.raw(&format!("log{count}.points"), &[data.len()], &data[..]);
        found(
            "/points",
            json!({
                "header": said, "height": 1, "width": 40, "fields": fields, "is_bigendian": false, "point_step": 18,
                "row_step": 720, "data": data, "is_dense": true,
            }),
        );

        let turn = [0.5, -0.5, 0.5, 0.5];
        let orientation = (count > 0).then_some(turn);
        let covariances = [[0.0; 9], [1.0; 9], [2.0; 9]];
        let [velocity, acceleration] = [[0.1, 0.2, 0.3], [0.0, 0.25, 9.81]];
        let imu =
            Imu { header, orientation, angular_velocity: velocity, linear_acceleration: acceleration, covariances };
        log.write("/imu", time, &imu).expect("written");
        let unknown = if count == 0 { -1.0 } else { 0.0 };
        found(
            "/imu",
            json!({
                "header": said, "orientation": xyzw(orientation.unwrap_or([0.0, 0.0, 0.0, 1.0])),
                "orientation_covariance": [unknown, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                "angular_velocity": xyz(velocity), "angular_velocity_covariance": covariances[1],
                "linear_acceleration": xyz(acceleration), "linear_acceleration_covariance": covariances[2],
            }),
        );

        let covariance = (count > 0).then_some([3.0; 9]);
        let fix = NavSatFix { header, latitude: 48.25, longitude: -11.5, altitude: 519.75, covariance };
        log.write("/gnss", time, &fix).expect("written");
        found(
            "/gnss",
            json!({
                "header": said, "status": {"status": 0, "service": 1}, "latitude": 48.25, "longitude": -11.5,
                "altitude": 519.75, "position_covariance": covariance.unwrap_or_default(),
                "position_covariance_type": if count > 0 { 3 } else { 0 },
            }),
        );

        let transform = |child| TransformStamped { header, child, translation: [1.5, 2.5, 3.5], rotation: turn };
        let transforms = ["ego", "ego/top lidar"].map(transform);
        log.write("/tf", time, &TfMessage(&transforms[..count.min(2)])).expect("written");
        let moved = json!({"translation": xyz([1.5, 2.5, 3.5]), "rotation": xyzw(turn)});
        let child = |child| json!({"header": said, "child_frame_id": child, "transform": moved});
        let transforms = &["ego", "ego/top lidar"].map(child)[..count.min(2)];
        found("/tf", json!({"transforms": transforms}));

        let (color, clear) = ([1.0, 0.5, 0.25, 1.0], rgba([0.0; 4]));
        let boxes = [BoxInPicture { edges: [1.0, 2.0, 8.0, 9.5], color, label: "car 7" }];
        log.write("/boxes", time, &ImageAnnotations { nanoseconds: time, boxes: &boxes[..count.min(1)] })
            .expect("written");
        let corner = |[x, y]: [f64; 2]| json!({"x": x, "y": y});
        let corners = [[1.0, 2.0], [8.0, 2.0], [8.0, 9.5], [1.0, 9.5]].map(corner);
        let outline = json!({
            "timestamp": stamp, "type": 2, "points": corners,
            "outline_color": rgba(color), "outline_colors": [], "fill_color": clear, "thickness": 1.0,
        });
        let text = json!({
            "timestamp": stamp, "position": corner([1.0, 2.0]), "text": "car 7", "font_size": 12.0,
            "text_color": rgba(color), "background_color": clear,
        });
        let shown = |value| if count > 0 { json!([value]) } else { json!([]) };
        found("/boxes", json!({"circles": [], "points": shown(outline), "texts": shown(text)}));

        let solid =
            BoxInSpace { id: 7, class: "car", center: [1.0, 2.0, 3.0], rotation: turn, size: [4.5, 1.75, 1.5], color };
        log.write("/objects", time, &SceneUpdate { header, boxes: &[solid, solid][..count] }).expect("written");
        let pose = json!({"position": xyz([1.0, 2.0, 3.0]), "orientation": xyzw(turn)});
        let entity = json!({
            "timestamp": stamp, "frame_id": "ego/front", "id": "7", "lifetime": {"sec": 0, "nanosec": 0},
            "frame_locked": false, "metadata": [{"key": "class", "value": "car"}], "arrows": [],
            "cubes": [{"pose": pose, "size": xyz([4.5, 1.75, 1.5]), "color": rgba(color)}], "spheres": [],
            "cylinders": [], "lines": [], "triangles": [], "texts": [], "models": [],
        });
        let deletions = json!([{"timestamp": stamp, "type": 1, "id": ""}]);
        found("/objects", json!({"deletions": deletions, "entities": vec![entity; count]}));
    }
    files.add("log.mcap", log.finish().expect("written"));
    files.expect("mcap", "log.mcap", json!(expected));
}
