//! Nothing pops: an object that passes lamps changes from one sub-frame to the next as it does under all of them.
//!
//! The lamps move and the object stays: only light changes its pixels, not how their edges and texels are rounded.
//! Between two places of the row, a pixel's jump is the change of its luminance beyond that by all lights, over the
//! mean luminance by all lights, in linear HDR. The search begins with coarse steps, and halves each in which some
//! pixel jumps by more than [`BOUND`] or the three lights change, down to [`SUB_FRAME`]. A smooth change becomes small
//! by that, a jump stays.
//!
//! Through portals light comes and goes by shares, whatever the policy. There the reference is all lights without
//! walls, and a jump is over the mean luminance of the picture itself.

use crate::common::{self, prelude::*};
use relief::tools::compare::luminance;
use systems::cells::{Cell, Cells, Opening, Portal};
use systems::space::Aabb;

/// Pixels along a side; what is compared are means of two by two, which half floats round half as much.
const SIZE: usize = 48;
/// No jump may be larger, in mean luminances of the reference.
const BOUND: f32 = 0.01;
/// Metres; at 20 m/s and 60 frames a second, a frame is a thousand times as long.
const SUB_FRAME: f32 = 0.0003;
/// Metres that the object drives.
const ROAD: f32 = 14.0;

/// An object, a camera before it, and a row of lamps that moves past.
struct Drive {
    simulation: Simulation,
    renderer: SingleView,
    /// Unread target of tone-mapped pictures.
    target: wgpu::TextureView,
    object: Entity,
    camera: Entity,
    row: Entity,
}

/// The policies that are compared with all lights.
const POLICIES: [LightPolicy; COUNT] =
    [LightPolicy::Three, LightPolicy::ENOUGH, LightPolicy::Enough(0.05), LightPolicy::Hard];
const COUNT: usize = 4;

/// The object at one place along the row.
struct Place {
    x: f32,
    /// Luminances by all lights, and by each policy.
    all: Vec<f32>,
    by_policy: [Vec<f32>; COUNT],
    lights: [u32; 3],
}

impl Place {
    /// By each policy, the largest change of a pixel to another place beyond its change by all lights.
    fn jumps(&self, to: &Self) -> [f32; COUNT] {
        let mean = self.all.iter().sum::<f32>() / self.all.len() as f32;
        let changes =
            |from: &[f32], to: &[f32]| -> Vec<f32> { from.iter().zip(to).map(|(a, b)| (a - b).abs()).collect() };
        let reference = changes(&self.all, &to.all);
        std::array::from_fn(|policy| {
            let changes = changes(&self.by_policy[policy], &to.by_policy[policy]);
            changes.iter().zip(&reference).map(|(change, all)| change - all).fold(0.0, f32::max) / mean
        })
    }
}

/// Measurements of a drive.
#[derive(Debug, Default)]
struct Found {
    /// By each policy, between places at most [`SUB_FRAME`] apart.
    largest: [f32; COUNT],
    /// Number of changes of the set of three.
    changes: usize,
    places: usize,
}

/// A normal map of four by four waves.
fn waves() -> Image {
    let side = 64;
    let texel = |i: u32| {
        let slope = |texel: u32| 0.4 * (texel as f32 * 4.0 / side as f32 * std::f32::consts::TAU).sin();
        let normal = Vec3::new(slope(i % side), slope(i / side), 1.0).normalize();
        (normal * 127.5 + 127.5).to_array().map(|c| c.round() as u8).into_iter().chain([255])
    };
    Image::rgba8("waves", side, side, ImageKind::Normal, (0..side * side).flat_map(texel).collect())
}

impl Drive {
    fn new(lamps: Vec<(Light, Transform)>) -> Option<Self> {
        let gpu = common::gpu()?;
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(Environment { ambient: Vec3::splat(0.05), ..Environment::default() });
        let mut library = simulation.world.resource_mut::<Library>();
        let normal_map = Some(Map::new(library.add_image(waves())));
        let mesh = library.add_mesh(shapes::sphere(0.6, 24, 12));
        let material = library.add_material(Material {
            base_factor: Vec4::new(0.8, 0.7, 0.6, 1.0),
            normal_map,
            specular_factor: Vec3::splat(0.15),
            shininess: 20.0,
            ..Material::default()
        });
        let object = simulation.world.spawn((mesh, material, Transform::default())).id();
        let eye = Transform::from_xyz(0.6, 0.8, 1.4).looking_at(Vec3::ZERO, Vec3::Y);
        let camera = simulation.world.spawn((Camera::default(), eye)).id();
        let row = simulation.world.spawn(Transform::default()).id();
        simulation.world.spawn_batch(lamps.into_iter().map(move |lamp| (lamp, ChildOf(row))).collect::<Vec<_>>());
        let target = picture_texture(&gpu, (SIZE as u32, SIZE as u32)).create_view(&Default::default());
        Some(Self { simulation, renderer: SingleView::new(&gpu), target, object, camera, row })
    }

    fn luminances(&mut self, policy: LightPolicy) -> Vec<f32> {
        self.simulation.world.insert_resource(LightPolicies::forced(policy));
        self.simulation.frame();
        let view = Viewpoint::Camera(self.camera).view(&self.simulation.world, (SIZE as u32, SIZE as u32));
        let settings = Settings { samples: 1, ..Settings::default() };
        self.simulation.with_frame(|frame| self.renderer.prepare(frame, &view, &settings)).expect("room for it");
        self.renderer.draw(&self.target, PICTURE_FORMAT);
        let pixels = self.renderer.read_linear().expect("linear colours");
        let at = |x: usize, y: usize| luminance(pixels[y * SIZE + x]);
        let corners = (0..SIZE).step_by(2).flat_map(|y| (0..SIZE).step_by(2).map(move |x| (x, y)));
        corners.map(|(x, y)| (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) / 4.0).collect()
    }

    fn at(&mut self, x: f32) -> Place {
        self.simulation.world.entity_mut(self.row).insert(Transform::from_xyz(-x, 0.0, 0.0));
        self.here(x)
    }

    /// With everything as it is.
    fn here(&mut self, x: f32) -> Place {
        let all = self.luminances(LightPolicy::All);
        let by_policy = POLICIES.map(|policy| self.luminances(policy));
        let world = &self.simulation.world;
        let mut lights = world.get::<SelectedLights>(self.object).expect("selected").unpack(world.resource()).lights;
        lights.sort_unstable();
        Place { x, all, by_policy, lights }
    }

    /// Drives along the whole row.
    fn drive(&mut self) -> Found {
        let (mut found, steps) = (Found::default(), 100);
        let mut from = self.at(0.0);
        for i in 1..=steps {
            let to = self.at(ROAD * i as f32 / steps as f32);
            self.search(&from, &to, &mut found);
            from = to;
        }
        found
    }

    fn search(&mut self, from: &Place, to: &Place, found: &mut Found) {
        found.places += 1;
        let jumps = from.jumps(to);
        let change = from.lights != to.lights;
        if to.x - from.x <= SUB_FRAME {
            found.changes += usize::from(change);
            found.largest = std::array::from_fn(|policy| found.largest[policy].max(jumps[policy]));
        } else if change || jumps.iter().any(|&jump| jump > BOUND) {
            let middle = self.at((from.x + to.x) / 2.0);
            self.search(from, &middle, found);
            self.search(&middle, to, found);
        }
    }
}

/// Points and spots by turns over 14 m, of several strengths, ranges and heights; every third with a twin across the
/// road, just as far away.
fn street(spot: LightKind) -> Vec<(Light, Transform)> {
    let down = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let mut lamps = Vec::new();
    for i in 0..14 {
        let kind = if i % 2 == 0 { LightKind::Point } else { spot };
        let light = Light { kind, ..Light::point(3.0 + (i * 5 % 7) as f32, 7.0 + (i % 5) as f32) };
        let place = Vec3::new(i as f32 * ROAD / 13.0, 2.0 + (i % 4) as f32 * 0.5, 1.2 - (i % 3) as f32 * 0.7);
        let across = place * Vec3::new(1.0, 1.0, -1.0);
        let places = if i % 3 == 0 { &[place, across][..] } else { &[place] };
        lamps.extend(places.iter().map(|&at| (light.clone(), Transform::from_translation(at).with_rotation(down))));
    }
    lamps
}

const SOFT: LightKind = LightKind::Spot { outer: 1.1, inner: Some(0.6), exponent: 0.0 };

/// The edge of a classic spot's cone is hard, for the reference too; nothing else changes all at once.
#[test]
fn nothing_pops_past_points_and_spots() {
    for spot in [SOFT, LightKind::Spot { outer: 0.7, inner: None, exponent: 4.0 }] {
        let Some(mut drive) = Drive::new(street(spot)) else { return };
        let found = drive.drive();
        println!("{found:?}");
        let [smooth @ .., hard] = found.largest;
        assert!(found.changes >= 10, "{spot:?}: {found:?}");
        assert!(smooth.iter().all(|jump| *jump <= BOUND), "{spot:?}: {found:?}");
        assert!(hard > 10.0 * BOUND, "{spot:?}: {found:?}");
    }
}

/// Sudden changes of a lamp are steps for the reference, too. Lights that leave out next to nothing follow it with no
/// more than [`BOUND`] beside that. Three lights do not: what they leave out is another then.
#[test]
fn lamps_that_are_switched_turned_and_spawned_are_no_larger_steps_than_by_all_lights() {
    let Some(mut drive) = Drive::new(street(SOFT)) else { return };
    let lamps: Vec<Entity> = drive.simulation.world.get::<Children>(drive.row).expect("lamps").to_vec();
    let mut from = drive.at(ROAD / 2.0);
    let mut largest = [0.0f32; COUNT];
    let mut steps = 0;
    for (i, &lamp) in lamps.iter().enumerate() {
        for change in 0..4 {
            let mut lamp = drive.simulation.world.entity_mut(lamp);
            match change {
                0 | 1 => lamp.get_mut::<Light>().expect("a light").enabled = change == 1,
                2 => lamp.get_mut::<Transform>().expect("a place").rotate(Quat::from_rotation_x(0.3 + i as f32 * 0.1)),
                _ => {
                    let light = (lamp.get::<Light>().cloned(), lamp.get::<Transform>().copied());
                    let (Some(light), Some(at)) = light else { continue };
                    let (row, at) = (drive.row, at.with_scale(Vec3::ONE));
                    drive.simulation.world.spawn((light, at, ChildOf(row)));
                }
            }
            let to = drive.here(0.0);
            let jumps = from.jumps(&to);
            largest = std::array::from_fn(|policy| largest[policy].max(jumps[policy]));
            steps += usize::from(from.all != to.all);
            from = to;
        }
    }
    println!("{largest:?} in {steps} steps");
    let [three, enough, ..] = largest;
    assert!(steps >= 30, "{steps}");
    assert!(enough <= BOUND, "{largest:?}");
    assert!(three > BOUND, "{largest:?}");
}

/// Two rooms of 5 by 6 metres, a lamp that moves, and others: two in the object's room, two behind the door.
struct Rooms {
    drive: Drive,
    portal: Entity,
    lamp: Entity,
}

impl Rooms {
    fn new() -> Option<Self> {
        let lamp =
            |at: [f32; 3], intensity: f32| (Light::point(intensity, 12.0), Transform::from_translation(at.into()));
        let lamps = vec![
            lamp([1.5, 1.2, -1.5], 4.0),
            lamp([-0.5, 1.2, 2.4], 3.0),
            lamp([-3.5, 1.0, 2.4], 6.0),
            lamp([-5.0, 0.5, -1.0], 9.0),
        ];
        let mut drive = Drive::new(lamps)?;
        let world = &mut drive.simulation.world;
        let portal = world.spawn(Portal::default()).id();
        let lamp = world.spawn((Light { enabled: false, ..Light::point(5.0, 12.0) }, Transform::default())).id();
        let mut rooms = Self { drive, portal, lamp };
        rooms.shift(0.0);
        Some(rooms)
    }

    /// Moves everything but the object and the eye along X: as if these went through the door.
    fn shift(&mut self, x: f32) {
        let room = |from: f32| Aabb { min: Vec3::new(from + x, -1.5, -3.0), max: Vec3::new(from + 5.0 + x, 1.5, 3.0) };
        let corners = [(-1.5, -0.45), (-1.5, 0.45), (0.6, 0.45), (0.6, -0.45)];
        let polygon = corners.map(|(y, z)| Vec3::new(x - 2.0, y, z)).to_vec();
        let opening = Opening { between: [1, 2], polygon, portal: Some(self.portal) };
        let cells = [room(-7.0), room(-2.0)].map(|room| Cell::new_box("", room)).to_vec();
        let world = &mut self.drive.simulation.world;
        world.insert_resource(Cells::new(cells, vec![opening]));
        world.entity_mut(self.drive.row).insert(Transform::from_xyz(x, 0.0, 0.0));
    }

    /// The picture's luminances; and those by all lights, without walls.
    fn luminances(&mut self) -> [Vec<f32>; 2] {
        let own = self.drive.luminances(LightPolicy::Three);
        let cells = std::mem::take(&mut *self.drive.simulation.world.resource_mut::<Cells>());
        let all = self.drive.luminances(LightPolicy::All);
        self.drive.simulation.world.insert_resource(cells);
        [own, all]
    }

    /// The largest jump of a pixel over [`SUB_FRAME`] of a way, and its change over all of it, in mean luminances.
    fn jumps(&mut self, metres: f32, mut go: impl FnMut(&mut Self, f32)) -> (f32, f32) {
        let change = |[a, _]: &[Vec<f32>; 2], [b, _]: &[Vec<f32>; 2], beside: &dyn Fn(usize) -> f32| {
            let mean = a.iter().sum::<f32>() / a.len() as f32;
            let beyond = |(i, (a, b)): (usize, (&f32, &f32))| (a - b).abs() - beside(i);
            a.iter().zip(b).enumerate().map(beyond).fold(0.0, f32::max) / mean
        };
        let mut at = |rooms: &mut Self, x: f32| {
            go(rooms, x);
            (x, rooms.luminances())
        };
        let steps = 40;
        let mut ends: Vec<_> = (0..=steps).rev().map(|i| at(self, metres * i as f32 / steps as f32)).collect();
        let whole = change(&ends[0].1, &ends[steps].1, &|_| 0.0);
        let (mut largest, mut from) = (0.0f32, ends.pop().expect("the first"));
        while let Some(to) = ends.pop() {
            let jump = change(&from.1, &to.1, &|i| (from.1[1][i] - to.1[1][i]).abs());
            let step = to.0 - from.0;
            if step > SUB_FRAME && jump > BOUND {
                let middle = at(self, (from.0 + to.0) / 2.0);
                ends.extend([to, middle]);
            } else {
                // The last halves are shorter.
                largest = largest.max(jump * (SUB_FRAME / step).max(1.0));
                from = to;
            }
        }
        (largest, whole)
    }
}

/// A sliding door, 90 cm wide.
#[test]
fn nothing_pops_as_a_door_opens() {
    let Some(mut rooms) = Rooms::new() else { return };
    let (largest, whole) = rooms.jumps(0.9, |rooms, x| {
        let mut portal = rooms.drive.simulation.world.get_mut::<Portal>(rooms.portal).expect("a portal");
        portal.open = x / 0.9;
    });
    println!("{largest} {whole}");
    assert!(whole > 0.2, "{whole}");
    assert!(largest <= BOUND, "{largest}");
}

/// Past the doorway, a metre behind it, and through it.
#[test]
fn nothing_pops_as_a_lamp_passes_a_doorway_or_goes_through() {
    let Some(mut rooms) = Rooms::new() else { return };
    rooms.drive.simulation.world.get_mut::<Light>(rooms.lamp).expect("a lamp").enabled = true;
    for (from, along, metres) in [([-3.0, 0.3, -2.9], Vec3::Z, 5.8), ([-3.4, 0.3, 0.2], Vec3::X, 2.4)] {
        let from = Vec3::from(from);
        let (largest, whole) = rooms.jumps(metres, |rooms, x| {
            let mut place = rooms.drive.simulation.world.get_mut::<Transform>(rooms.lamp).expect("a lamp");
            place.translation = from + along * x;
        });
        println!("{largest} {whole}");
        assert!(largest <= BOUND, "{largest}");
    }
}

#[test]
fn nothing_pops_as_an_object_goes_through_a_doorway() {
    let Some(mut rooms) = Rooms::new() else { return };
    let (largest, whole) = rooms.jumps(3.5, Rooms::shift);
    println!("{largest} {whole}");
    assert!(whole > 0.2, "{whole}");
    assert!(largest <= BOUND, "{largest}");
}
