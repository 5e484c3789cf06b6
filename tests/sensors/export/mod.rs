//! Files of `relief::export` read by others' programs in Python (`tests/python/export.py`): numpy, OpenEXR, MCAP's and
//! ROS 2's decoders, pycocotools. They must find what was written, to the bit.

mod log;

use crate::common::{self, prelude::*};
use half::f16;
use relief::export::array::{Array, Column, Values};
use relief::export::{coco, exr, kitti, middlebury, npy, npz, semantic_kitti};
use systems::sensors::{Class, ClassInfo, Classes};

/// The size of pictures: neither square nor a multiple of the 16 rows that OpenEXR compresses together.
const SIZE: (u32, u32) = (23, 19);
const PIXELS: usize = 23 * 19;

/// Numbers that look random and are always the same (Knuth, "The Art of Computer Programming" 6.4).
fn number(i: usize) -> u32 {
    (i as u32 + 1).wrapping_mul(2_654_435_761)
}

/// Between −1 and 1, with 24 bits.
fn fraction(i: usize) -> f32 {
    (number(i) >> 8) as f32 / 8_388_608.0 - 1.0
}

fn list<T>(count: usize, value: impl Fn(usize) -> T) -> Vec<T> {
    (0..count).map(value).collect()
}

/// Invented data of a camera and a lidar.
struct Seen {
    color: Vec<u8>,
    linear: Vec<f16>,
    depth: Vec<f32>,
    normal: Vec<f32>,
    flow: Vec<[f32; 2]>,
    instance: Vec<u32>,
    class: Vec<u8>,
    points: Vec<[f32; 3]>,
    intensity: Vec<f32>,
    ring: Vec<u16>,
}

impl Seen {
    fn new() -> Self {
        // Blocks of things, and ground between them.
        let block = |i: usize| [0, 0, 7, 70_000, 0, 300][(i % 23 / 5 + i / 23 / 6) % 6];
        Self {
            color: list(3 * PIXELS, |i| number(i) as u8),
            linear: list(3 * PIXELS, |i| f16::from_f32(fraction(i) * 9.0)),
            depth: list(PIXELS, |i| if i % 11 == 3 { f32::INFINITY } else { 50.0 + 49.0 * fraction(i) }),
            normal: list(3 * PIXELS, fraction),
            flow: list(PIXELS, |i| [fraction(i) * 40.0, fraction(i + 9) * 40.0]),
            instance: list(PIXELS, block),
            class: list(PIXELS, |i| if block(i) == 0 { 7 } else { 26 }),
            points: list(40, |i| [fraction(i), fraction(i + 50), fraction(i + 100)]),
            intensity: list(40, |i| fraction(i).abs()),
            ring: list(40, |i| i as u16 % 16),
        }
    }
}

/// Files, and what their readers must find in them.
#[derive(Default)]
struct Files {
    files: Vec<(String, Vec<u8>)>,
    expected: Vec<Value>,
}

impl Files {
    fn add(&mut self, name: &str, bytes: Vec<u8>) {
        self.files.push((name.to_owned(), bytes));
    }

    /// Values that Python reads as they are, in numpy's name of their type.
    fn raw<'a>(&mut self, name: &str, shape: &[usize], values: impl Into<Values<'a>>) -> Value {
        let (kind, bytes): (&str, Vec<u8>) = match values.into() {
            Values::U8(values) => ("u1", values.to_vec()),
            Values::U16(values) => ("<u2", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Values::U32(values) => ("<u4", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Values::I32(values) => ("<i4", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Values::F16(values) => ("<f2", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Values::F32(values) => ("<f4", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Values::F64(values) => ("<f8", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
        };
        let file = format!("{name}.raw");
        self.add(&file, bytes);
        json!({"raw": file, "dtype": kind, "shape": shape})
    }

    fn expect(&mut self, reader: &str, file: &str, content: Value) {
        self.expected.push(json!({"reader": reader, "file": file, "content": content}));
    }
}

fn add_arrays(files: &mut Files, seen: &Seen) {
    let signed = list(12, |i| number(i) as i32);
    let double = [f64::MIN_POSITIVE];
    let (height, width) = (SIZE.1 as usize, SIZE.0 as usize);
    let arrays: [(&str, &[usize], Values); 8] = [
        ("color", &[height, width, 3], (&seen.color[..]).into()),
        ("linear", &[height, width, 3], (&seen.linear[..]).into()),
        ("depth", &[height, width], (&seen.depth[..]).into()),
        ("instance", &[height, width], (&seen.instance[..]).into()),
        ("ring", &[40], (&seen.ring[..]).into()),
        ("signed", &[2, 1, 6], (&signed[..]).into()),
        ("double", &[], (&double[..]).into()),
        ("empty", &[0, 4], Values::F32(&[])),
    ];
    let mut encoded = Vec::new();
    let mut all = json!({});
    for (name, shape, values) in arrays {
        let bytes = npy::encode(&Array::new(shape, values)).expect("fits");
        let raw = files.raw(name, shape, values);
        files.expect("npy", &format!("{name}.npy"), raw.clone());
        files.add(&format!("{name}.npy"), bytes.clone());
        all[name] = raw;
        encoded.push((name, bytes));
    }
    let encoded: Vec<(&str, &[u8])> = encoded.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    let mut archive = Vec::new();
    npz::write(&mut archive, &encoded).expect("written");
    files.add("all.npz", archive);
    files.expect("npz", "all.npz", all);

    let (ids, boxes) = (list(5, number), list(20, fraction));
    let (classes, corners) = (list(5, |i| i as u8), list(80, |i| f64::from(fraction(i))));
    for rows in [5, 0] {
        let columns = [
            Column::new("id", &[], &ids[..rows]),
            Column::new("class", &[], &classes[..rows]),
            Column::new("box_full", &[4], &boxes[..4 * rows]),
            Column::new("corners", &[8, 2], &corners[..16 * rows]),
        ];
        let name = format!("records{rows}.npy");
        files.add(&name, npy::encode_records(rows, &columns).expect("fits"));
        let content = json!({
            "id": files.raw(&format!("{name}.id"), &[rows], &ids[..rows]),
            "class": files.raw(&format!("{name}.class"), &[rows], &classes[..rows]),
            "box_full": files.raw(&format!("{name}.box_full"), &[rows, 4], &boxes[..4 * rows]),
            "corners": files.raw(&format!("{name}.corners"), &[rows, 8, 2], &corners[..16 * rows]),
        });
        files.expect("records", &name, content);
    }
}

fn add_exr(files: &mut Files, seen: &Seen) {
    let mut channels = exr::Channel::parts(["R", "G", "B"], &seen.linear[..]).to_vec();
    channels.extend(exr::Channel::parts(["N.X", "N.Y", "N.Z"], &seen.normal[..]));
    channels.extend(exr::Channel::parts(["flow.U", "flow.V"], seen.flow.as_flattened()));
    channels.extend([exr::Channel::new("Z", &seen.depth[..]), exr::Channel::new("id", &seen.instance[..])]);
    files.add("frame.exr", exr::encode(SIZE, &channels).expect("encoded"));
    let (height, width) = (SIZE.1 as usize, SIZE.0 as usize);
    let content = json!({
        "R G B": files.raw("exr.rgb", &[height, width, 3], &seen.linear[..]),
        "N.X N.Y N.Z": files.raw("exr.n", &[height, width, 3], &seen.normal[..]),
        "flow.U flow.V": files.raw("exr.flow", &[height, width, 2], seen.flow.as_flattened()),
        "Z": files.raw("exr.z", &[height, width, 1], &seen.depth[..]),
        "id": files.raw("exr.id", &[height, width, 1], &seen.instance[..]),
    });
    files.expect("exr", "frame.exr", content);
}

fn add_labels(files: &mut Files, seen: &Seen) {
    let (height, width) = (SIZE.1 as usize, SIZE.0 as usize);
    let shape = [height, width];
    let instance = files.raw("coco.instance", &shape, &seen.instance[..]);
    let class = files.raw("coco.class", &shape, &seen.class[..]);
    let classes = Classes::cityscapes();
    let info = |id| classes.get(Class(id)).expect("a class");
    let is_thing = |id| info(id).is_thing;
    let category = |id: u8| {
        let ClassInfo { name, is_thing, color, .. } = info(id).clone();
        coco::Category { id, supercategory: name.clone(), name, isthing: is_thing.into(), color }
    };
    let categories: Vec<coco::Category> = [7, 26].into_iter().map(category).collect();
    let picture = |id: u64| coco::Picture { id, file_name: format!("{id}.png"), width: SIZE.0, height: SIZE.1 };

    let mut instances = coco::Instances { categories: categories.clone(), ..Default::default() };
    for id in 1..3 {
        instances.add(picture(id), &seen.instance, |_| Some(26)).expect("fits");
    }
    let mut bytes = Vec::new();
    coco::write(&mut bytes, &instances).expect("written");
    files.add("instances.json", bytes);
    files.expect("coco", "instances.json", json!({"instance": instance, "category": 26, "pictures": [1, 2]}));

    let (ids, segments_info) = coco::segments(SIZE, &seen.class, &seen.instance, is_thing).expect("fits");
    let segments = coco::Segments { image_id: 1, file_name: "1.png".into(), segments_info };
    let panoptic = coco::Panoptic { images: vec![picture(1)], annotations: vec![segments], categories };
    let mut bytes = Vec::new();
    coco::write(&mut bytes, &panoptic).expect("written");
    files.add("panoptic.json", bytes);
    let rgb: Vec<u8> = ids.iter().flat_map(|id| coco::rgb_of_id(*id)).collect();
    let rgb = files.raw("panoptic.rgb", &[height, width, 3], &rgb[..]);
    files.expect("panoptic", "panoptic.json", json!({"rgb": rgb, "instance": instance, "class": class}));
}

fn add_kitti(files: &mut Files, seen: &Seen) {
    let points = files.raw("kitti.points", &[40, 3], seen.points.as_flattened());
    let intensity = files.raw("kitti.intensity", &[40], &seen.intensity[..]);
    files.add("velodyne.bin", kitti::velodyne(&seen.points, &seen.intensity).expect("fits"));
    files.expect("velodyne", "velodyne.bin", json!({"points": points, "intensity": intensity}));

    let small: Vec<u32> = seen.instance.iter().map(|id| id % 65_536).collect();
    files.add("scan.label", semantic_kitti::encode(&seen.class, &small).expect("fits"));
    let content = json!({
        "class": files.raw("label.class", &[PIXELS], &seen.class[..]),
        "instance": files.raw("label.instance", &[PIXELS], &small[..]),
    });
    files.expect("semantic_kitti", "scan.label", content);

    let label = kitti::Label {
        class: "traffic light",
        truncated: 0.25,
        occluded: 2,
        alpha: -1.5,
        bbox: [0.5, 1.25, 99.75, 50.0],
        size: [1.5, 1.75, 4.5],
        location: [-3.5, 1.625, 20.125],
        rotation_y: 3.125,
    };
    files.add("label_2.txt", label.line().repeat(2).into_bytes());
    let expected =
        json!(["traffic_light", 0.25, 2, -1.5, 0.5, 1.25, 99.75, 50.0, 1.5, 1.75, 4.5, -3.5, 1.625, 20.125, 3.125]);
    files.expect("label_2", "label_2.txt", json!([expected, expected]));

    let matrix = |first: usize| std::array::from_fn(|i| f64::from(number(first + i) >> 8) / 1024.0 - 0.1);
    let calibration = kitti::Calibration {
        projections: [matrix(0), matrix(20), matrix(40), matrix(60)],
        rectification: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        camera_from_lidar: matrix(80),
        lidar_from_imu: matrix(100),
    };
    files.add("calib.txt", calibration.text().into_bytes());
    let [p0, p1, p2, p3] = calibration.projections;
    let content = json!({
        "P0": p0, "P1": p1, "P2": p2, "P3": p3, "R0_rect": calibration.rectification,
        "Tr_velo_to_cam": calibration.camera_from_lidar, "Tr_imu_to_velo": calibration.lidar_from_imu,
    });
    files.expect("calib", "calib.txt", content);

    files.add("frame.flo", middlebury::encode(SIZE, &seen.flow, |_| true).expect("fits"));
    let shape = [SIZE.1 as usize, SIZE.0 as usize, 2];
    let flow = files.raw("flow", &shape, seen.flow.as_flattened());
    files.expect("flo", "frame.flo", flow);
}

fn all_files() -> Files {
    let (mut files, seen) = (Files::default(), Seen::new());
    add_arrays(&mut files, &seen);
    add_exr(&mut files, &seen);
    add_labels(&mut files, &seen);
    add_kitti(&mut files, &seen);
    log::add_log(&mut files, &seen);
    files
}

#[test]
fn the_same_is_written_twice() {
    let (first, second) = (all_files().files, all_files().files);
    assert!(first.len() > 30);
    for ((name, first), (_, second)) in first.iter().zip(&second) {
        assert!(first == second, "{name} differs");
    }
}

#[test]
fn others_read_what_was_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Files { files, expected } = all_files();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).expect("written");
    }
    fs::write(folder.path().join("expected.json"), Value::from(expected.clone()).to_string()).expect("written");
    let modules = ["numpy", "OpenEXR", "mcap", "mcap_ros2", "pycocotools", "rosbags"];
    let Some(output) = common::python("export.py", &modules, &[folder.path().as_os_str()]) else { return };
    // So that nothing passes for want of being read.
    let read = common::text(&output.stdout);
    assert_eq!(read.lines().last(), Some(&*format!("{} files", expected.len())), "{read}");
}
