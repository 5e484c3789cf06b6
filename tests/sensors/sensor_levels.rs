//! Levels of detail and sensors: what is measured is of the meshes themselves, whatever a picture may be drawn of.
//!
//! Fine spheres at distances at which a camera draws coarse levels of them: each pixel's depth against the facets of
//! the mesh, by an intersection of its own in double precision, and each beam of a lidar.

use crate::common::{self, dark_world, prelude::*, unlit};
use systems::sensors::{Beam, Beams, CameraOutputs};

const SIDE: u32 = 81;
/// Pixels.
const FOCAL: f64 = 130.0;
/// Radius and distance, metres; the focal length in parts of [`FOCAL`].
const SPHERES: [(f32, f32, f64); 4] = [(1.0, 9.0, 1.0), (5.0, 60.0, 1.0), (20.0, 400.0, 1.0), (1.0, 9.0, 3.0)];

/// The docs' promise of depths, in parts of these.
const EXACT: f64 = 1e-5;
/// At steeper angles a pixel is moved along the surface by what rounding moves it in the picture, many times over.
const LEAST_COSINE: f64 = 0.5;

fn lens(zoom: f64) -> Intrinsics {
    let middle = f64::from(SIDE - 1) / 2.0;
    Intrinsics { fx: zoom * FOCAL, fy: zoom * FOCAL, cx: middle, cy: middle }
}

fn camera(zoom: f64, outputs: &[CameraOutput]) -> Sensor {
    let outputs: CameraOutputs = outputs.iter().copied().collect();
    let lens = Lens::Pinhole(lens(zoom));
    Sensor::camera(CameraSensor { size: (SIDE, SIDE), lens, outputs, samples: 1, ..CameraSensor::default() })
}

/// A sphere before the origin, toward −Z.
fn world(radius: f32, distance: f32) -> (Simulation, Mesh) {
    let mut simulation = dark_world();
    let mesh = shapes::sphere(radius, 128, 64);
    let id = simulation.world.resource_mut::<Library>().add_mesh(mesh.clone());
    let material = unlit(&mut simulation, Vec3::ONE);
    simulation.world.spawn((id, material, Transform::from_xyz(0.0, 0.0, -distance)));
    (simulation, mesh)
}

fn captured(simulation: &mut Simulation, suite: &mut SensorSuite, sensor: Sensor) -> Capture {
    let entity = simulation.world.spawn((sensor, Name::new("eye"))).id();
    register_all(&mut simulation.world);
    let capture = suite.look(simulation, |found| found == entity).expect("captured");
    simulation.world.despawn(entity);
    capture
}

/// The facets of a sphere before the origin, in camera axes, X right, Y down, Z forward.
struct Facets {
    triangles: Vec<[DVec3; 3]>,
    center: DVec3,
    radius: f64,
}

/// Distance along a ray, and the cosine of the angle of incidence.
type Met = Option<(f64, f64)>;

impl Facets {
    fn of(mesh: &Mesh, (radius, distance): (f32, f32)) -> Self {
        let place = |&corner: &u32| {
            let at = mesh.positions[corner as usize].as_dvec3();
            DVec3::new(at.x, -at.y, f64::from(distance) - at.z)
        };
        let corners: Vec<DVec3> = mesh.indices.iter().map(place).collect();
        let triangles = corners.as_chunks::<3>().0.to_vec();
        Self { triangles, center: DVec3::new(0.0, 0.0, distance.into()), radius: radius.into() }
    }

    /// The nearest that a ray from the origin meets.
    fn met(&self, direction: DVec3) -> Met {
        let aside = self.center - direction * (self.center.dot(direction) / direction.length_squared());
        if aside.length() > self.radius {
            return None;
        }
        let near = |triangle: &&[DVec3; 3]| {
            let [a, b, c] = triangle;
            let longest = a.distance(*b).max(b.distance(*c)).max(c.distance(*a));
            let aside = *a - direction * (a.dot(direction) / direction.length_squared());
            aside.length() <= longest
        };
        let met = self.triangles.iter().filter(near).filter_map(|triangle| meet(triangle, direction));
        met.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// By the plane of the triangle, and on which side of its edges the point lies.
fn meet([a, b, c]: &[DVec3; 3], direction: DVec3) -> Met {
    let normal = (*b - *a).cross(*c - *a);
    let slope = normal.dot(direction);
    if slope == 0.0 {
        return None;
    }
    let along = normal.dot(*a) / slope;
    let point = direction * along;
    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (*to - *from).cross(point - *from).dot(normal));
    // What goes through an edge is in one of its facets, however it is rounded.
    let is_within = sides.iter().all(|side| *side >= -1e-9 * normal.length_squared());
    let cosine = slope.abs() / (normal.length() * direction.length());
    (is_within && along > 0.0).then_some((along, cosine))
}

#[test]
fn depths_are_those_of_the_mesh_and_not_of_its_levels_of_detail() {
    let Some(gpu) = common::gpu() else { return };
    let rounding = f64::from(gpu.vertex_rounding());
    let mut suite = SensorSuite::new(&gpu);
    for (radius, distance, zoom) in SPHERES {
        let (mut simulation, mesh) = world(radius, distance);
        let facets = Facets::of(&mesh, (radius, distance));
        let intrinsics = lens(zoom);
        let rays = (0..SIDE * SIDE).map(|pixel| intrinsics.direction((pixel % SIDE).into(), (pixel / SIDE).into()));
        let met: Vec<Met> = rays.map(|ray| facets.met(ray)).collect();
        for outputs in [&[CameraOutput::Depth][..], &[CameraOutput::Color, CameraOutput::Depth, CameraOutput::Instance]]
        {
            let capture = captured(&mut simulation, &mut suite, camera(zoom, outputs));
            let found = capture["eye"].camera().expect("a camera");
            let mut compared = 0;
            for (pixel, (&depth, met)) in found.depth.iter().zip(&met).enumerate() {
                let Some((expected, cosine)) = met.filter(|met| met.1 >= LEAST_COSINE) else { continue };
                // And as much deeper as the facet is where the rasteriser may move a vertex.
                let tangent = (1.0 - cosine * cosine).sqrt() / cosine;
                let moved = 2.0 * rounding * tangent * expected / intrinsics.fx;
                let off = (f64::from(depth) - expected).abs();
                let room = EXACT * expected + moved;
                assert!(off < room, "{radius} m at {distance} m, pixel {pixel}: {depth} for {expected}");
                compared += 1;
            }
            assert!(compared > 50, "{radius} m at {distance} m: {compared} pixels");
        }
    }
}

#[test]
fn beams_of_a_lidar_are_as_long_as_depths_say() {
    let Some(gpu) = common::gpu() else { return };
    let mut suite = SensorSuite::new(&gpu);
    for (radius, distance, _) in SPHERES {
        let (mut simulation, mesh) = world(radius, distance);
        let facets = Facets::of(&mesh, (radius, distance));
        // All from one point, and a revolution in a step.
        let elevations = (-12..=12).map(|half| 0.5 * half as f32);
        let beams = elevations.map(|elevation_degrees| Beam { elevation_degrees, ..Beam::default() }).collect();
        let (beams, range) = (Beams::List(beams), (0.5, 1000.0));
        let lidar = LidarSensor { beams, columns: 1800, hz: 60.0, range, ..LidarSensor::default() };
        simulation.world.resource_mut::<Clock>().step = 1;
        let capture = captured(&mut simulation, &mut suite, Sensor::lidar(lidar));
        let found = &capture["eye"].lidar().expect("a lidar").scan;
        let from_sensor = capture["eye"].world_from_outputs().matrix3;
        let mut compared = 0;
        for (place, range) in found.xyz.iter().zip(&found.range).filter(|(_, range)| **range > 0.0) {
            let range = f64::from(*range);
            let way = from_sensor * DVec3::from(place.map(f64::from));
            let ray = DVec3::new(way.x, -way.y, -way.z).normalize();
            let Some((expected, cosine)) = facets.met(ray).filter(|met| met.1 >= LEAST_COSINE) else { continue };
            // Directions are those of the points, of floats.
            let aside = f64::from(f32::EPSILON) * expected / cosine;
            assert!((range - expected).abs() < EXACT * expected + aside, "{radius} m: {range} for {expected}");
            compared += 1;
        }
        assert!(compared > 5, "{radius} m at {distance} m: {compared} beams");
    }
}

#[test]
fn colours_are_of_levels_of_detail_as_pictures_are_whatever_else_is_measured() {
    let Some(gpu) = common::gpu() else { return };
    let mut suite = SensorSuite::new(&gpu);
    let (mut simulation, _) = world(1.0, 9.0);
    // What a picture draws of it has fewer triangles: the choice by the formula.
    let projection = Projection::Pinhole { intrinsics: lens(1.0), size: (SIDE, SIDE) };
    let view = View::new(&Affine3A::IDENTITY, &Camera { projection, ..Camera::default() }, SIDE, SIDE);
    simulation.frame();
    let levels: Vec<_> = simulation.library().meshes().map(|(_, entry)| entry.levels.clone()).collect();
    let coarsest = |levels: &Vec<_>| LevelOfDetail::default().choose(levels, 1.0, 8.0, view.pixels_at_1m());
    assert!(levels.iter().map(coarsest).max() > Some(0), "the sphere has levels to draw");
    let colors = [CameraOutput::Color, CameraOutput::Linear];
    let mut colors_of = |levels: LevelOfDetail, others: &[CameraOutput]| {
        suite.settings.levels = levels;
        let outputs = [&colors[..], others].concat();
        let capture = captured(&mut simulation, &mut suite, camera(1.0, &outputs));
        let found = capture["eye"].camera().expect("a camera");
        (found.color.clone(), found.linear.clone())
    };
    let [coarse, fine] = [LevelOfDetail::default(), LevelOfDetail::OFF].map(|levels| colors_of(levels, &[]));
    assert!(coarse != fine, "levels are seen at the sphere's edge");
    // What is measured beside it is of the meshes themselves (the tests above), and does not change a colour.
    for (name, output) in CameraOutput::ALL.into_iter().filter(|(_, output)| !colors.contains(output)) {
        assert!(colors_of(LevelOfDetail::default(), &[output]) == coarse, "{name}");
    }
}
