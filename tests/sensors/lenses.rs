//! Cameras whose lenses bend, against OpenCV and against what is known of their every pixel.

use crate::common::{self, dark_world, prelude::*, unlit};
use glam::dvec2;
use relief::renderer::RenderError;
use relief::sense::CameraCapture;
use systems::sensors::{CameraOutputs, Class};

const SIZE: (u32, u32) = (320, 240);
const INTRINSICS: Intrinsics = Intrinsics { fx: 190.0, fy: 185.0, cx: 157.0, cy: 122.5 };
/// Pixels that one of the faces has for one of the picture.
const DENSITY: f64 = 1.5;

fn all_outputs() -> CameraOutputs {
    CameraOutput::ALL.into_iter().map(|(_, output)| output).collect()
}

fn camera(lens: Lens) -> CameraSensor {
    CameraSensor { size: SIZE, lens, outputs: all_outputs(), ..CameraSensor::default() }
}

fn bent(coefficients: [f64; 8]) -> CameraSensor {
    camera(Lens::BrownConrady { intrinsics: INTRINSICS, coefficients })
}

/// Sees all around to 100° and more.
fn fisheye(coefficients: [f64; 4]) -> CameraSensor {
    let intrinsics = Intrinsics { fx: 70.0, fy: 71.0, cx: 158.0, cy: 121.0 };
    camera(Lens::KannalaBrandt { intrinsics, coefficients, largest_angle: 105f64.to_radians() })
}

fn is_round(camera: &CameraSensor) -> bool {
    matches!(camera.lens, Lens::KannalaBrandt { .. })
}

/// Barrels, a pincushion, tangents, and the denominator; of one face, and of several.
fn lenses() -> Vec<CameraSensor> {
    let wide = Intrinsics { fx: 90.0, fy: 92.0, ..INTRINSICS };
    vec![
        bent([-0.2, 0.05, 0.0, 0.0, -0.005, 0.0, 0.0, 0.0]),
        bent([0.1, 0.02, 0.004, -0.003, 0.0, 0.0, 0.0, 0.0]),
        bent([0.3, 0.1, 0.001, 0.002, 0.01, 0.5, 0.1, 0.005]),
        camera(Lens::BrownConrady { intrinsics: wide, coefficients: [0.02, 0.0, 0.001, 0.0, 0.0, 0.1, 0.0, 0.0] }),
        fisheye([0.0; 4]),
        fisheye([0.02, -0.004, 0.001, -0.0002]),
    ]
}

/// Captures of cameras at the origin, which look along −Z.
fn captured(simulation: &mut Simulation, cameras: &[CameraSensor]) -> Option<Result<Capture, RenderError>> {
    let gpu = common::gpu()?;
    let spawn = |(i, camera): (usize, &CameraSensor)| {
        let name = Name::new(i.to_string());
        simulation.world.spawn((Sensor::camera(camera.clone()), name)).id()
    };
    let entities: Vec<_> = cameras.iter().enumerate().map(spawn).collect();
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    // Meshes as they are.
    suite.settings.levels = LevelOfDetail::OFF;
    let capture = suite.capture(simulation);
    entities.into_iter().for_each(|entity| assert!(simulation.world.despawn(entity)));
    Some(capture)
}

/// Capture that nothing is wrong with.
fn seen(simulation: &mut Simulation, cameras: &[CameraSensor]) -> Option<Capture> {
    Some(captured(simulation, cameras)?.expect("captured"))
}

fn of(capture: &Capture, camera: usize) -> &CameraCapture {
    capture.sensors[camera].camera().expect("a camera")
}

/// From camera axes to the scene's, of a camera that stands at the origin and looks along −Z.
fn placed(point: DVec3) -> Vec3 {
    (point * DVec3::new(1.0, -1.0, -1.0)).as_vec3()
}

/// Pixels of the points that cameras see, camera axes, by OpenCV.
fn of_opencv(cameras: &[CameraSensor], points: &[Vec<DVec3>]) -> Option<Vec<Vec<DVec2>>> {
    let described = cameras.iter().zip(points).map(|(camera, points)| {
        let (model, d) = match &camera.lens {
            Lens::BrownConrady { coefficients, .. } => ("brown_conrady", &coefficients[..]),
            Lens::KannalaBrandt { coefficients, .. } => ("kannala_brandt", &coefficients[..]),
            lens => panic!("{lens:?} does not bend"),
        };
        let k = camera.intrinsics().expect("perspective");
        let points: Vec<[f64; 3]> = points.iter().map(|point| point.to_array()).collect();
        json!({ "model": model, "k": [k.fx, k.fy, k.cx, k.cy], "d": d, "points": points })
    });
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    let text = Value::from(described.collect::<Vec<_>>()).to_string();
    std::fs::write(file.path(), text).expect("written");
    let said = common::python("lenses.py", &["cv2", "numpy"], &[file.path().as_os_str()])?;
    let pixels: Vec<Vec<[f64; 2]>> = serde_json::from_slice(&said.stdout).expect("JSON");
    Some(pixels.into_iter().map(|pixels| pixels.into_iter().map(DVec2::from).collect()).collect())
}

#[test]
fn points_are_where_opencv_has_them() {
    let random = &mut random();
    let cameras = lenses();
    let mut point = || {
        // OpenCV's fisheye takes points behind the camera for points before it.
        let aside = dvec2(random.random::<f64>() * 3.0 - 1.5, random.random::<f64>() * 3.0 - 1.5);
        aside.extend(1.0) * (0.1 + 9.9 * random.random::<f64>())
    };
    let points: Vec<Vec<DVec3>> = cameras
        .iter()
        .map(|camera| {
            let seen = (0..1000).map(|_| point()).filter(|point| camera.project(*point).is_some());
            seen.collect()
        })
        .collect();
    let Some(pixels) = of_opencv(&cameras, &points) else { return };
    for ((camera, points), pixels) in cameras.iter().zip(&points).zip(&pixels) {
        assert!(points.len() > 300, "{}", points.len());
        for (point, pixel) in points.iter().zip(pixels) {
            let found = camera.project(*point).expect("seen");
            assert!(found.abs_diff_eq(*pixel, 1e-9), "{:?} {point}: {found} for {pixel}", camera.lens);
        }
    }
}

/// Small bright balls, alone each, at directions all over the picture: the centre of what each lights.
#[test]
fn balls_are_seen_where_opencv_has_them() {
    let cameras = lenses();
    let distance = 20.0;
    let mut centers = Vec::new();
    for camera in &cameras {
        let place = |row: u32, column: u32| dvec2(25.0 + 33.0 * f64::from(column), 22.0 + 32.0 * f64::from(row));
        let places = (0..7).flat_map(|row| (0..9).map(move |column| place(row, column)));
        // What OpenCV can say: in front.
        let rays = places.filter_map(|place| Some(camera.direction(place.x, place.y)?.normalize()));
        centers.push(rays.filter(|ray| ray.z > 0.05).map(|ray| ray * distance).collect::<Vec<DVec3>>());
    }
    let Some(pixels) = of_opencv(&cameras, &centers) else { return };
    for ((camera, centers), pixels) in cameras.iter().zip(&centers).zip(&pixels) {
        // Sums of light times place, and of light.
        let mut lit = vec![(DVec2::ZERO, 0.0); pixels.len()];
        // Of several sizes, whose borders fall between other samples.
        for radius in [1.5, 1.8, 2.1, 2.4] {
            let mut simulation = dark_world();
            let ball = simulation.world.resource_mut::<Library>().add_mesh(shapes::sphere(1.0, 32, 16));
            let white = unlit(&mut simulation, Vec3::ONE);
            for center in centers {
                // Pixels on the axis, and little more or less elsewhere: pictures of planes stretch angles.
                let stretch = if is_round(camera) { 1.0 } else { (center.z / distance).powi(2) };
                let radius = radius / camera.intrinsics().expect("perspective").fx * stretch * distance;
                let at = Transform::from_translation(placed(*center)).with_scale(Vec3::splat(radius as f32));
                simulation.world.spawn((ball, white, at));
            }
            let Some(capture) = seen(&mut simulation, std::slice::from_ref(camera)) else { return };
            let linear = &of(&capture, 0).linear;
            for (pixel, (sum, weight)) in pixels.iter().zip(&mut lit) {
                for (v, u) in (-9..=9).flat_map(|v| (-9..=9).map(move |u| (v, u))) {
                    let (u, v) = (pixel.x.round() as i32 + u, pixel.y.round() as i32 + v);
                    if (0..SIZE.0 as i32).contains(&u) && (0..SIZE.1 as i32).contains(&v) {
                        let light = linear[v as usize * SIZE.0 as usize + u as usize][1].to_f64();
                        *sum += dvec2(f64::from(u), f64::from(v)) * light;
                        *weight += light;
                    }
                }
            }
        }
        assert!(pixels.len() > 30, "{}", pixels.len());
        for (pixel, (sum, weight)) in pixels.iter().zip(lit) {
            // A ball's border is of some thirty samples, a sixth of a pixel apart.
            let found = sum / weight;
            assert!(found.distance(*pixel) < 0.1, "{:?}: {found} for {pixel}", camera.lens);
        }
    }
}

/// A plane that everything of the picture shows, through (0, 0, 5) in camera axes, tilted back by an angle about X.
fn tilted_plane(simulation: &mut Simulation, angle: f32, size: f32) {
    let plane = shapes::plane(Vec2::splat(size), UVec2::splat(40));
    let plane = simulation.world.resource_mut::<Library>().add_mesh(plane);
    let material = unlit(simulation, Vec3::new(0.25, 0.5, 1.0));
    let rotation = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2 - angle);
    let at = Transform::from_xyz(0.0, 0.0, -5.0).with_rotation(rotation);
    simulation.world.spawn((plane, material, at));
}

#[test]
fn depth_range_and_normals_of_planes_are_those_of_their_equations() {
    let Some(rounding) = common::gpu().map(|gpu| f64::from(gpu.vertex_rounding())) else { return };
    let cameras = lenses();
    for angle in [0.0_f32, 0.4] {
        let mut simulation = dark_world();
        tilted_plane(&mut simulation, angle, 100.0);
        let Some(capture) = seen(&mut simulation, &cameras) else { return };
        let (sin, cos) = f64::from(angle).sin_cos();
        let normal = DVec3::new(0.0, -sin, -cos);
        for (i, camera) in cameras.iter().enumerate() {
            let found = of(&capture, i);
            let (mut seen, mut unseen) = (0, 0);
            for place in 0..found.depth.len() {
                let (u, v) = (place % SIZE.0 as usize, place / SIZE.0 as usize);
                let Some(ray) = camera.direction(u as f64, v as f64) else {
                    unseen += 1;
                    assert_eq!((found.depth[place], found.instance[place]), (f32::INFINITY, 0));
                    assert_eq!(found.color[place], [0; 3]);
                    continue;
                };
                // (ray·t − (0, 0, 5))·normal = 0, where the plane is: well within its border.
                let t = 5.0 * normal.z / ray.dot(normal);
                let point = ray * t;
                if !(t > 0.0 && point.abs().max_element() < 40.0) {
                    continue;
                }
                seen += 1;
                let off = |found: f32, expected: f64| (f64::from(found) - expected).abs();
                // Floats of the depth buffer and of the vertices' places; and how much deeper the plane is, seen from
                // the nearest axis of a face, as far away as the rasterizer may move a vertex. No face is coarser.
                let axis =
                    if ray.z >= ray.truncate().abs().max_element() { DVec3::Z } else { ray.truncate().extend(0.0) };
                let focal = DENSITY * camera.intrinsics().expect("perspective").fx / 2.0;
                let aside = axis.normalize();
                let steepness = (normal - aside * normal.dot(aside)).length();
                let per_pixel = steepness / focal / (ray / ray.dot(aside)).dot(normal).abs();
                let room = 1e-5 + 2.0 * rounding * per_pixel;
                let (depth, range) = (point.z, point.length());
                // At right angles to the axis depth is 0, whatever the range: there it is exact as that is.
                let room_of_depth = room * if is_round(camera) { range } else { depth };
                let (own, lens) = (found.depth[place], &camera.lens);
                assert!(off(own, depth) < room_of_depth, "{lens:?} {u} {v}: {own} for {depth}, {room}");
                assert!(off(found.range[place], range) < room * range, "{lens:?} {u} {v}: range");
                let found = DVec3::from(found.normal[place].map(f64::from));
                // Half floats.
                assert!(found.abs_diff_eq(normal, 1e-3), "{:?}: {found}", camera.lens);
            }
            assert!(seen > SIZE.0 * SIZE.1 / 4 && is_round(camera) == (unseen > 0), "{seen} {unseen}");
        }
    }
}

/// Boxes and balls of several classes under a sun, all around.
fn crowd(simulation: &mut Simulation) {
    let random = &mut random();
    let mut library = simulation.world.resource_mut::<Library>();
    let meshes = [shapes::cube(Vec3::ONE), shapes::sphere(0.5, 24, 16)].map(|shape| library.add_mesh(shape));
    let materials = [Vec3::new(0.8, 0.2, 0.1), Vec3::new(0.1, 0.3, 0.9), Vec3::ONE]
        .map(|color| library.add_material(Material { base_factor: color.extend(1.0), ..Material::default() }));
    simulation.world.spawn((Light::directional(2.0), Transform::from_rotation(Quat::from_rotation_x(-0.9))));
    for i in 0..150 {
        let mut number = || random.random::<f32>() * 2.0 - 1.0;
        let place = Vec3::new(number(), number(), number()).normalize() * (6.0 + 3.0 * number());
        let turned = Quat::from_euler(EulerRot::XYZ, number() * 3.0, number() * 3.0, number() * 3.0);
        let at = Transform::from_translation(place).with_rotation(turned).with_scale(Vec3::splat(1.2));
        simulation.world.spawn((meshes[i % 2], materials[i % 3], at, Class((i % 30) as u8)));
    }
}

/// Tells if all pixels of the square of 3 × 3 around one have its value.
fn is_even<T: PartialEq>(values: &[T], u: usize, v: usize) -> bool {
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    let rows = v.saturating_sub(1)..(v + 2).min(height);
    let own = &values[v * width + u];
    rows.flat_map(|v| &values[v * width + u.saturating_sub(1)..v * width + (u + 2).min(width)])
        .all(|value| value == own)
}

#[test]
fn a_lens_that_does_not_bend_has_the_picture_of_a_pinhole() {
    let mut simulation = Simulation::new();
    crowd(&mut simulation);
    let cameras = [camera(Lens::Pinhole(INTRINSICS)), bent([0.0; 8])];
    let Some(capture) = seen(&mut simulation, &cameras) else { return };
    let (plain, zero) = (of(&capture, 0), of(&capture, 1));
    let mut edges = 0;
    for (v, u) in (0..SIZE.1 as usize).flat_map(|v| (0..SIZE.0 as usize).map(move |u| (v, u))) {
        let place = v * SIZE.0 as usize + u;
        // What the nearest pixel of a face sees is at most half of its side away, a third of a pixel. So a label may
        // differ where there is another one beside it, and nowhere else but where a corner is thinner than a pixel.
        if is_even(&plain.part, u, v) {
            assert_eq!(plain.part[place], zero.part[place], "{u} {v}");
            assert_eq!(plain.class[place], zero.class[place], "{u} {v}");
        } else {
            edges += 1;
        }
    }
    let same = plain.part.iter().zip(&zero.part).filter(|(a, b)| a == b).count();
    let pixels = plain.part.len();
    // Two thirds of what is at an edge are nearer to the pixel than the edge is.
    assert!(edges > pixels / 50 && same > pixels - edges / 2, "{edges} at edges, {} differ", pixels - same);
}

#[test]
fn straight_lines_bend_by_the_formula() {
    let lens = bent([-0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mut simulation = dark_world();
    // Light above a straight edge that is level, 0.5 above the axis at a distance of 1.
    let plane = simulation.world.resource_mut::<Library>().add_mesh(shapes::plane(Vec2::new(60.0, 20.0), UVec2::ONE));
    let white = unlit(&mut simulation, Vec3::ONE);
    let upright = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    simulation.world.spawn((plane, white, Transform::from_xyz(0.0, 5.0 + 10.0, -10.0).with_rotation(upright)));
    let Some(capture) = seen(&mut simulation, std::slice::from_ref(&lens)) else { return };
    let linear = &of(&capture, 0).linear;
    let mut rows = Vec::new();
    for u in (10..SIZE.0).step_by(20) {
        // A point of the edge that is seen in this column.
        let x = (0..60).fold((-2.0, 2.0), |(low, high), _| {
            let middle = (low + high) / 2.0;
            let at = lens.project(DVec3::new(middle, -0.5, 1.0));
            if at.map_or(middle < 0.0, |at| at.x < f64::from(u)) { (middle, high) } else { (low, middle) }
        });
        let expected = lens.project(DVec3::new(x.0, -0.5, 1.0)).expect("seen").y;
        let lit: f64 = (0..SIZE.1).map(|v| linear[(v * SIZE.0 + u) as usize][0].to_f64()).sum();
        // Rows from −½ on. These are r = 1.5 to 2.2 pixels of a face apart, of which bilinear ones see all but
        // (r − 1)/2 on either side; and the samples of a pixel of a face are an eighth of it from the edge.
        let room = 1.2 / 2.0 / 2.2 + 1.0 / 8.0 / 2.2;
        assert!((lit - 0.5 - expected).abs() < room, "column {u}: {} for {expected}", lit - 0.5);
        rows.push(expected);
    }
    assert!(rows.iter().copied().fold(0.0, f64::max) - rows[rows.len() / 2] > 5.0, "it bends: {rows:?}");
}

#[test]
fn a_lens_that_folds_within_the_picture_is_refused() {
    let mut simulation = dark_world();
    let cameras = [bent([-0.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])];
    let Some(capture) = captured(&mut simulation, &cameras) else { return };
    let said = capture.unwrap_err().to_string();
    // 1 + 3 k1 r² = 0.
    assert!(said.starts_with("sensor \"0\": lens: folds at a radius of 0.6086 times the distance"), "{said}");
}

#[test]
fn bits_depend_on_nothing_that_is_captured_beside() {
    let mut simulation = Simulation::new();
    crowd(&mut simulation);
    let cameras = lenses();
    let Some(all) = captured(&mut simulation, &cameras) else { return };
    let all = all.expect("captured");
    for (i, camera) in cameras.iter().enumerate() {
        let alone = seen(&mut simulation, std::slice::from_ref(camera)).expect("an adapter");
        assert!(of(&alone, 0) == of(&all, i), "{:?}", camera.lens);
    }
}

#[test]
fn the_tone_map_is_that_of_pictures() {
    for (name, tone_map) in ToneMap::ALL {
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(Environment { tone_map, exposure: 1.3, ..Environment::default() });
        crowd(&mut simulation);
        let camera = CameraSensor { samples: 1, ..camera(Lens::Pinhole(INTRINSICS)) };
        let Some(capture) = seen(&mut simulation, &[camera]) else { return };
        let found = of(&capture, 0);
        let mut shades = std::collections::BTreeSet::new();
        for (color, linear) in found.color.iter().zip(&found.linear) {
            let expected = tone_map.encoded(linear.map(half::f16::to_f32));
            // A device encodes to within 0.6 of a step.
            assert!(color.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1), "{name}: {color:?} for {expected:?}");
            shades.insert(expected);
        }
        assert!(shades.len() > 300, "{}", shades.len());
        // And it is what a lens that bends shows of its own linear colours, to the bit.
        let bent = seen(&mut simulation, &lenses()[..1]).expect("an adapter");
        let bent = of(&bent, 0);
        let expected = bent.linear.iter().map(|linear| tone_map.encoded(linear.map(half::f16::to_f32)));
        assert!(bent.color.iter().copied().eq(expected), "{name}");
    }
}
