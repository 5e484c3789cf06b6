//! The debug view of cells: surfaces in the colours of their cells, and portals as outlines.

use crate::common::{self, prelude::*};
use systems::cells::{Cell, Cells, OUTSIDE, Opening, Portal};
use systems::space::Aabb;

const SIZE: (u32, u32) = (160, 120);

/// Seen from above: two rooms of four metres on a floor that goes beyond them, with a portal between them at x = 0 and
/// one out of the second at x = 4. The first has a box above one half of the first portal.
struct Rooms {
    simulation: Simulation,
    headless: Headless,
    camera: Entity,
    portals: [Entity; 2],
}

const EYE: Vec3 = Vec3::new(1.5, 9.0, 0.0);

impl Rooms {
    fn new(projection: Projection, samples: u32) -> Option<Self> {
        let settings = Settings { debug: DebugView::Cells, samples, ..Settings::default() };
        let headless = Headless { renderer: SingleView::new(&common::gpu()?), settings };
        let mut simulation = Simulation::new();
        let world = &mut simulation.world;
        let cube = world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        world.spawn((cube, Transform::from_xyz(0.0, -0.5, 0.0).with_scale(Vec3::new(13.0, 1.0, 9.0))));
        world.spawn((cube, Transform::from_xyz(0.0, 2.75, 1.0).with_scale(Vec3::new(1.0, 0.5, 1.0))));
        let camera = Camera { projection, ..Camera::default() };
        let eye = Transform::from_translation(EYE).looking_at(EYE - Vec3::Y, Vec3::NEG_Z);
        let camera = world.spawn((camera, eye)).id();
        let portals = [(); 2].map(|()| world.spawn(Portal::default()).id());
        let room = |x: f32| Aabb { min: Vec3::new(x, -0.5, -2.0), max: Vec3::new(x + 4.0, 4.0, 2.0) };
        let opening = |x: f32, between, portal| {
            let corners = [(0.01, -1.5), (2.0, -1.5), (2.0, 1.5), (0.01, 1.5)];
            let polygon = corners.map(|(y, z)| Vec3::new(x, y, z)).to_vec();
            Opening { between, polygon, portal: Some(portal) }
        };
        let openings = vec![opening(0.0, [1, 2], portals[0]), opening(4.0, [OUTSIDE, 2], portals[1])];
        world.insert_resource(Cells::new([-4.0, 0.0].map(|x| Cell::new_box("", room(x))).to_vec(), openings));
        Some(Self { simulation, headless, camera, portals })
    }

    /// Linear colours at places of the world, as they were tone-mapped from.
    fn at(&mut self, places: &[Vec3]) -> Vec<Vec3> {
        self.headless.draw(&mut self.simulation, self.camera, SIZE).expect("a picture");
        let world = &self.simulation.world;
        let camera = world.get::<Camera>(self.camera).expect("a camera");
        let place = world.get::<GlobalTransform>(self.camera).expect("a place");
        let clip_from_world = View::new(&place.affine(), camera, SIZE.0, SIZE.1).clip_from_world();
        let pixels = self.headless.renderer.read_linear().expect("linear colours");
        let at = |place: &Vec3| {
            let pixel = (clip_from_world.project_point3(*place).truncate() * Vec2::new(0.5, -0.5) + 0.5)
                * Vec2::new(SIZE.0 as f32, SIZE.1 as f32);
            Vec3::from_slice(&pixels[pixel.y as usize * SIZE.0 as usize + pixel.x as usize])
        };
        places.iter().map(at).collect()
    }

    fn open(&mut self, portals: [f32; 2]) {
        for (portal, open) in self.portals.into_iter().zip(portals) {
            self.simulation.world.get_mut::<Portal>(portal).expect("a portal").open = open;
        }
    }
}

/// Brightness of a white horizontal surface in the debug view.
fn headlight(place: Vec3, projection: Projection) -> f32 {
    let toward_eye = (EYE - place).normalize();
    let cosine = if matches!(projection, Projection::Orthographic { .. }) { 1.0 } else { toward_eye.y };
    0.25 + 0.75 * cosine
}

#[track_caller]
fn assert_near(got: Vec3, wanted: Vec3, tolerance: f32) {
    assert!((got - wanted).abs().max_element() <= tolerance, "got {got}, wanted {wanted}");
}

#[test]
fn surfaces_have_the_colours_of_their_cells_and_portals_are_outlines() {
    let (first, second) = (DebugView::cell_color(1), DebugView::cell_color(2));
    assert!(first.distance(second) > 0.5, "{first} {second}");
    let perspective = Projection::Perspective { fov_y: 0.9, aspect: None };
    for projection in [perspective, Projection::Orthographic { half_height: 4.4, aspect: None }] {
        for samples in [1, 4] {
            let Some(mut rooms) = Rooms::new(projection, samples) else { return };
            rooms.open([1.0, 0.0]);
            let floor = [-4.2, -3.0, -0.7, 0.7, 3.0, 5.2].map(|x| Vec3::new(x, 0.0, -1.0));
            let found = rooms.at(&floor);
            for (i, cell) in [Vec3::ONE, first, first, second, second, Vec3::ONE].into_iter().enumerate() {
                // A pixel is 5 to 8 cm wide: the light from the eye changes by less than 0.002 over it. Half floats
                // round by 2⁻¹¹.
                assert_near(found[i], cell * headlight(floor[i], projection), 0.004);
            }
            // On the upper edges, of which the outlines hide what is below them; and below the box.
            let edges = [(0.0, -1.0), (4.0, -1.0), (4.0, 1.0)].map(|(x, z)| Vec3::new(x, 2.0, z));
            let outlines = |rooms: &mut Rooms| rooms.at(&edges);
            let (open, shut) = (DebugView::OPEN_PORTAL, DebugView::SHUT_PORTAL);
            for (got, wanted) in outlines(&mut rooms).into_iter().zip([open, shut, shut]) {
                assert_near(got, wanted, 0.002);
            }
            let hidden = Vec3::new(0.0, 2.0, 0.8);
            let box_top = |cell: Vec3| cell * headlight(Vec3::new(0.0, 3.0, 0.8), projection);
            let got = rooms.at(&[hidden])[0];
            // In parallel projection the lower edge lies behind the upper one.
            let opacity = if projection == perspective { 0.25 } else { 1.0 - 0.75 * 0.75 };
            let faint = [first, second].map(|cell| box_top(cell).lerp(open, opacity));
            let is_one = |wanted: &Vec3| (got - *wanted).abs().max_element() < 0.02;
            // The edge lies where the cells meet: a pixel's samples are in either.
            let between = got.distance(faint[0]) + got.distance(faint[1]) < faint[0].distance(faint[1]) + 0.02;
            assert!(faint.iter().any(is_one) || between, "{got}: {faint:?}");
            // A portal that nothing else depends on opens.
            rooms.open([0.0, 0.1]);
            for (got, wanted) in outlines(&mut rooms).into_iter().zip([shut, open, open]) {
                assert_near(got, wanted, 0.002);
            }
            // Nothing of it is left in other views, or without cells.
            rooms.headless.settings.debug = DebugView::Base;
            let base = rooms.at(&[floor[1]])[0];
            assert!(base.x > 0.1);
            assert_near(base, Vec3::splat(base.x), 0.0);
            rooms.headless.settings.debug = DebugView::Cells;
            rooms.simulation.world.insert_resource(Cells::default());
            assert_near(rooms.at(&[floor[1]])[0], Vec3::splat(headlight(floor[1], projection)), 0.004);
        }
    }
}
