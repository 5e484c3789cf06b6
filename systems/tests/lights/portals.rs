//! Cells and portals: what light comes through them, and that it is chosen as the plain search chooses.

use super::*;
use systems::assets::world_box;
use systems::cells::{Cell, Cells, Door, Flood, OUTSIDE, Occupied, Opening, Portal, Source};
use systems::run::registry::register_all;
use systems::run::snapshot;
use systems::run::standard_inputs::{SetPortal, push_for};
use systems::run::state_hash::hash;
use systems::space::Aabb;

fn aabb(min: [f32; 3], max: [f32; 3]) -> Aabb {
    Aabb { min: min.into(), max: max.into() }
}

/// A rectangle across the X axis, or across Z: where, from and to along the other of the two, and from height to height.
fn opening(across_x: bool, at: f32, along: [f32; 2], height: [f32; 2], between: [u32; 2]) -> Opening {
    let corner = |(along, y)| if across_x { Vec3::new(at, y, along) } else { Vec3::new(along, y, at) };
    let [from, to] = along;
    let [low, high] = height;
    let polygon = [(from, low), (to, low), (to, high), (from, high)].map(corner).to_vec();
    Opening { between, polygon, portal: None }
}

/// Metres of a room.
const ROOM: f32 = 5.0;
const HEIGHT: f32 = 3.0;

#[derive(Clone, Debug)]
struct Plan {
    rooms: [usize; 2],
    /// Openings of the walls in the order of [`Plan::cells`], repeated: place along the wall and openness, both 0..1.
    openings: Vec<Option<(f32, f32)>>,
}

impl Plan {
    /// Rooms side by side, and how far their openings are open.
    fn cells(&self) -> (Cells, Vec<f32>) {
        let [columns, rows] = self.rooms;
        let number = |column: usize, row: usize| (row * columns + column + 1) as u32;
        let (mut cells, mut openings, mut open) = (Vec::new(), Vec::new(), Vec::new());
        for row in 0..rows {
            for column in 0..columns {
                let min = Vec3::new(column as f32 * ROOM, 0.0, row as f32 * ROOM);
                cells.push(Cell::new_box("", Aabb { min, max: min + Vec3::new(ROOM, HEIGHT, ROOM) }));
            }
        }
        let mut walls = Vec::new();
        for row in 0..rows {
            for edge in 0..=columns {
                let side = |column: Option<usize>| column.filter(|&c| c < columns).map_or(OUTSIDE, |c| number(c, row));
                walls.push((true, edge, row, [side(edge.checked_sub(1)), side(Some(edge))]));
            }
        }
        for column in 0..columns {
            for edge in 0..=rows {
                let side = |row: Option<usize>| row.filter(|&r| r < rows).map_or(OUTSIDE, |r| number(column, r));
                walls.push((false, edge, column, [side(edge.checked_sub(1)), side(Some(edge))]));
            }
        }
        for ((across_x, edge, along, between), own) in walls.into_iter().zip(self.openings.iter().cycle()) {
            let &Some((place, how_far)) = own else { continue };
            let from = along as f32 * ROOM + 0.3 + place * (ROOM - 1.6);
            // Doors from the floor, windows above a sill.
            let height = if between.contains(&OUTSIDE) { [0.9, 2.2] } else { [0.0, 2.1] };
            openings.push(opening(across_x, edge as f32 * ROOM, [from, from + 1.0], height, between));
            open.push(how_far);
        }
        (Cells::new(cells, openings), open)
    }

    fn extent(&self) -> Vec3 {
        Vec3::new(self.rooms[0] as f32 * ROOM, HEIGHT, self.rooms[1] as f32 * ROOM)
    }
}

fn any_open() -> impl Strategy<Value = f32> {
    prop_oneof![1 => Just(0.0f32), 1 => 0.0f32..1.0, 2 => Just(1.0f32)]
}

fn any_plan() -> impl Strategy<Value = Plan> {
    let openings = prop::collection::vec(prop::option::weighted(0.6, (0.0f32..1.0, any_open())), 12..24);
    ([1usize..5, 1usize..4], openings).prop_map(|(rooms, openings)| Plan { rooms, openings })
}

/// Tests the line of sight between two points: through open portals only.
fn is_seen(cells: &Cells, open: &[f32], from: Vec3, to: Vec3) -> bool {
    let (way, mut t, mut cell) = (to - from, 0.0f32, cells.at(from));
    for _ in 0..100 {
        // Where the line leaves the cell, or enters one.
        let mut next = 1.0f32;
        let spans = |number: u32| {
            let Aabb { min, max } = cells.cell(number).expect("a cell").aabb();
            let (a, b) = ((min - from) / way, (max - from) / way);
            (a.min(b).max_element(), a.max(b).min_element())
        };
        if cell == OUTSIDE {
            for number in 1..=cells.cells().len() as u32 {
                let (enters, leaves) = spans(number);
                if enters < leaves && enters > t {
                    next = next.min(enters);
                }
            }
        } else {
            next = next.min(spans(cell).1);
        }
        if next >= 1.0 {
            return cells.at(to) == cell;
        }
        let at = from + way * next;
        let through = cells.openings().iter().zip(open).find(|(opening, open)| {
            let Aabb { min, max } = Aabb::around(&opening.polygon);
            // Off its edges by more than what rounding does.
            let inside = (at - min).min(max - at);
            let thin = (max - min).cmplt(Vec3::splat(1e-3));
            let is_in = (inside.cmpgt(Vec3::splat(1e-3)) | (thin & inside.abs().cmplt(Vec3::splat(2e-3)))).all();
            **open > 0.0 && opening.between.contains(&cell) && is_in
        });
        let Some((opening, _)) = through else { return false };
        cell = opening.between[usize::from(opening.between[0] == cell)];
        t = next;
    }
    // It runs along a wall, to and fro in what rounding leaves of it.
    false
}

proptest! {
    #![proptest_config(cases(500))]

    /// Lights in the line of sight are never left out; only what is tiny, or nearly shut, is dimmed.
    #[test]
    fn no_light_that_an_object_sees_is_left_out(
        plan in any_plan(),
        lights in prop::collection::vec(any_place(1.0), 4),
        places in prop::collection::vec((any_place(1.0), any_place(1.0)), 60),
        parallel in any_place(1.0),
    ) {
        let (cells, open) = plan.cells();
        let (middle, half) = (plan.extent() * 0.5, plan.extent() * 0.5 + Vec3::new(3.0, 0.0, 3.0));
        let boxed = |(center, size): &(Vec3, Vec3)| {
            let (center, half) = (middle + *center * half * 0.98, size.abs() * 0.6);
            (center, Occupied::new(&cells, Aabb { min: center - half, max: center + half }))
        };
        let objects: Vec<(Vec3, Occupied)> = places.iter().map(boxed).collect();
        for light in lights {
            let from = middle + light * half;
            let flood = Flood::new(&cells, &open, Source::Point(from, 50.0));
            let least = flood.windows.iter().map(|window| window.share).fold(1.0, f32::min);
            for (place, occupied) in &objects {
                if is_seen(&cells, &open, from, *place) {
                    prop_assert!(flood.share(occupied) >= least, "{from} {place} {occupied:?} {flood:?}");
                }
            }
        }
        let along = parallel.try_normalize().unwrap_or(Vec3::X);
        let flood = Flood::new(&cells, &open, Source::Parallel(along));
        let least = flood.windows.iter().map(|window| window.share).fold(1.0, f32::min);
        for (place, occupied) in &objects {
            // From beyond everything.
            if is_seen(&cells, &open, *place - along * 100.0, *place) {
                prop_assert!(flood.share(occupied) >= least, "{along} {place} {occupied:?} {flood:?}");
            }
        }
    }
}

/// Two rooms along X, of 4 and 6 metres, with a door between them at z = 3 to 4.
fn two_rooms(portal: Option<Entity>) -> Cells {
    let rooms = vec![
        Cell::new_box("a", aabb([0.0, 0.0, 0.0], [4.0, 3.0, 8.0])),
        Cell::new_box("b", aabb([4.0, 0.0, 0.0], [10.0, 3.0, 8.0])),
    ];
    Cells::new(rooms, vec![Opening { portal, ..opening(true, 4.0, [3.0, 4.0], [0.0, 2.1], [1, 2]) }])
}

/// The line from the lamp along the door's frame is where pieces of the far wall begin to be lit.
#[test]
fn a_lamp_lights_what_lies_behind_the_door() {
    let cells = two_rooms(None);
    let lamp = Vec3::new(1.0, 1.5, 4.0);
    let flood = Flood::new(&cells, &[1.0], Source::Point(lamp, 50.0));
    assert_eq!(flood.windows.len(), 2);
    // Pieces of 20 cm of a wall's face, 10 cm within the cell.
    let share = |z: f32| flood.share(&Occupied::new(&cells, aabb([9.9, 0.5, z - 0.1], [9.9, 1.0, z + 0.1])));
    // From the lamp by the frame at (4, 3): one along Z for three along X.
    let edge = 4.0 - 8.9 / 3.0;
    // The distance of a point of the wall from the plane is so much of its distance along the wall.
    let slant = (1.0f32 + 1.0 / 9.0).sqrt().recip();
    let mut passed_half = false;
    for i in 0..8000 {
        let z = i as f32 * 0.001;
        // A tenth of how far the piece's farthest corner is, over how far the frame is.
        let reach = Vec3::new(8.9, 1.0, (z - 4.0).abs() + 0.1).length();
        let fade = 0.1 * reach / 3.0;
        // Of the piece's nearer end, with the millimetre that planes are moved.
        let beyond = ((edge - (z + 0.1)) * slant).max((z - 0.1) - 4.0);
        let share = share(z);
        assert!(beyond > -1e-4 || share == 1.0, "{z}: {share}");
        assert!(beyond < fade + 0.002 || share == 0.0, "{z}: {share}");
        let half_way = (beyond - 0.5 * fade).abs() < 0.002;
        passed_half |= half_way;
        assert!(!half_way || (share - 0.5).abs() < 0.02, "{z}: {share}");
    }
    assert!(passed_half);
}

#[test]
fn light_comes_smoothly_through_a_door_that_opens() {
    let cells = two_rooms(None);
    let object = Occupied::new(&cells, aabb([8.0, 0.0, 3.0], [9.0, 1.0, 4.0]));
    let share = |open: f32| Flood::new(&cells, &[open], Source::Point(Vec3::new(3.0, 1.5, 3.5), 50.0)).share(&object);
    assert_eq!((share(0.0), share(0.5), share(1.0)), (0.0, 1.0, 1.0));
    // The step is steepest in its middle: 1.5 over half a door.
    assert!((0..1000).all(|i| (share((i + 1) as f32 / 1e3) - share(i as f32 / 1e3)).abs() <= 0.0031));
}

#[test]
fn the_sun_shines_in_through_windows() {
    let room = vec![Cell::new_box("", aabb([0.0, 0.0, 0.0], [5.0, 3.0, 5.0]))];
    let cells = Cells::new(room, vec![opening(true, 0.0, [2.0, 3.0], [1.0, 2.0], [OUTSIDE, 1])]);
    let sun = |along: Vec3| Flood::new(&cells, &[1.0], Source::Parallel(along.normalize()));
    let share = |flood: &Flood, x: f32, y: f32, z: f32| {
        flood.share(&Occupied::new(&cells, aabb([x - 0.1, y - 0.1, z - 0.1], [x + 0.1, y + 0.1, z + 0.1])))
    };
    let low = sun(Vec3::new(1.0, -0.25, 0.0));
    assert_eq!(share(&low, 3.0, 0.75, 2.5), 1.0);
    assert_eq!([share(&low, 3.0, 2.5, 2.5), share(&low, 3.0, 0.75, 4.0), share(&low, -3.0, 1.0, 1.0)], [0.0, 0.0, 1.0]);
    let behind = sun(Vec3::new(-1.0, -0.25, 0.0));
    assert_eq!([share(&behind, 3.0, 0.75, 2.5), share(&behind, 9.0, 1.0, 1.0)], [0.0, 1.0]);
}

/// Four rooms in a ring, and a row of many with doors in line: floods end, and go as far as one sees.
#[test]
fn floods_end() {
    let plan = Plan { rooms: [2, 2], openings: vec![Some((0.5, 1.0)); 12] };
    let (cells, open) = plan.cells();
    let flood = Flood::new(&cells, &open, Source::Point(Vec3::new(2.6, 1.5, 2.6), 100.0));
    // Doors are opposite each other: the room across the corner is seen through none.
    assert_eq!([1, 2, 3, 4].map(|cell| flood.reaches(cell)), [true, true, true, false]);
    let row = Plan { rooms: [40, 1], openings: vec![Some((0.5, 1.0)); 200] };
    let (cells, open) = row.cells();
    let flood = Flood::new(&cells, &open, Source::Point(Vec3::new(2.5, 1.5, 2.5), 150.0));
    assert!(flood.reaches(20) && !flood.reaches(40), "{:?}", flood.windows.len());
    // In a doorway all of both rooms is seen.
    let cells = two_rooms(None);
    for x in [3.97, 4.0, 4.03] {
        let flood = Flood::new(&cells, &[1.0], Source::Point(Vec3::new(x, 1.0, 3.5), 50.0));
        let corner = Occupied::new(&cells, aabb([4.2, 0.0, 7.8], [4.4, 1.0, 7.9]));
        assert_eq!(flood.share(&corner), 1.0, "{x}");
    }
    // Beside the door, next to its plane, next to nothing of the other room is.
    let flood = Flood::new(&cells, &[1.0], Source::Point(Vec3::new(3.999, 1.0, 6.0), 50.0));
    assert!(flood.windows.iter().all(|window| window.cell == 1 || window.share < 1e-3), "{flood:?}");
}

/// Change of a building between two frames.
#[derive(Clone, Debug)]
enum Event {
    Nothing,
    MoveObject(Index, Vec3),
    MoveLight(Index, Vec3),
    Open(Index, f32),
    Paint(Index, f32),
    SpawnObject(Vec3, Vec3),
    SpawnLight(Light, Vec3),
    DespawnLight(Index),
    DespawnObject(Index),
    Policy(LightPolicy),
    Rebuild(Plan),
}

fn any_event() -> impl Strategy<Value = Event> {
    let place = || any_place(1.0);
    prop_oneof![
        2 => Just(Event::Nothing),
        10 => (any::<Index>(), place()).prop_map(|(object, to)| Event::MoveObject(object, to)),
        10 => (any::<Index>(), place()).prop_map(|(light, to)| Event::MoveLight(light, to)),
        12 => (any::<Index>(), any_open()).prop_map(|(portal, open)| Event::Open(portal, open)),
        4 => (any::<Index>(), 0.1f32..2.0).prop_map(|(light, intensity)| Event::Paint(light, intensity)),
        6 => (place(), place()).prop_map(|(at, size)| Event::SpawnObject(at, size)),
        4 => (any_light(), place()).prop_map(|(light, at)| Event::SpawnLight(light, at)),
        3 => any::<Index>().prop_map(Event::DespawnLight),
        3 => any::<Index>().prop_map(Event::DespawnObject),
        2 => any_policy().prop_map(Event::Policy),
        1 => any_plan().prop_map(Event::Rebuild),
    ]
}

/// An object with what it gets of each light: the light, and the share where its score is above 0.
type Gets = (Entity, Sphere, Aabb, Vec<(ScoredLight, f32)>);

/// A world of rooms, objects and lights.
struct Building {
    simulation: Simulation,
    plan: Plan,
    cube: MeshId,
    objects: Vec<Entity>,
    lights: Vec<Entity>,
}

impl Building {
    fn new(plan: Plan) -> Self {
        let mut simulation = Simulation::new();
        let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        let mut building = Self { simulation, plan: plan.clone(), cube, objects: Vec::new(), lights: Vec::new() };
        building.build(plan);
        building
    }

    fn build(&mut self, plan: Plan) {
        let world = &mut self.simulation.world;
        let (cells, open) = plan.cells();
        let with_portal = |(opening, open): (&Opening, f32)| {
            let portal = Some(world.spawn(Portal { open }).id());
            Opening { portal, ..opening.clone() }
        };
        let openings = cells.openings().iter().zip(open).map(with_portal).collect();
        let cells = Cells::new(cells.cells().to_vec(), openings);
        world.insert_resource(cells);
        self.plan = plan;
    }

    /// A place around the building, from −1 to 1.
    fn place(&self, at: Vec3) -> Vec3 {
        let half = self.plan.extent() * 0.5;
        half + at * (half + Vec3::new(4.0, 0.0, 4.0))
    }

    fn happen(&mut self, event: &Event) {
        let at = |place: &Vec3| Transform::from_translation(self.place(*place));
        match event {
            Event::MoveObject(index, to) if !self.objects.is_empty() => {
                let to = self.place(*to);
                let object = *index.get(&self.objects);
                self.simulation.world.get_mut::<Transform>(object).unwrap().translation = to;
            }
            Event::MoveLight(index, to) if !self.lights.is_empty() => {
                let to = self.place(*to);
                let light = *index.get(&self.lights);
                self.simulation.world.get_mut::<Transform>(light).unwrap().translation = to;
            }
            Event::Open(index, open) => {
                let portals: Vec<Entity> =
                    self.simulation.world.resource::<Cells>().openings().iter().filter_map(|o| o.portal).collect();
                if !portals.is_empty() {
                    self.simulation.world.get_mut::<Portal>(*index.get(&portals)).unwrap().open = *open;
                }
            }
            Event::Paint(index, intensity) if !self.lights.is_empty() => {
                let light = *index.get(&self.lights);
                self.simulation.world.get_mut::<Light>(light).unwrap().intensity = *intensity;
            }
            Event::SpawnObject(center, size) => {
                let rotation = Quat::from_rotation_y(size.x * 3.0);
                let place = Transform { scale: size.abs() * 2.0 + 0.05, rotation, ..at(center) };
                self.objects.push(self.simulation.world.spawn((self.cube, place)).id());
            }
            Event::SpawnLight(light, place) => {
                let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, place.try_normalize().unwrap_or(Vec3::Y));
                let place = Transform { rotation, ..at(place) };
                self.lights.push(self.simulation.world.spawn((light.clone(), place)).id());
            }
            Event::DespawnLight(index) if !self.lights.is_empty() => {
                let index = index.index(self.lights.len());
                self.simulation.world.despawn(self.lights.swap_remove(index));
            }
            Event::DespawnObject(index) if !self.objects.is_empty() => {
                let index = index.index(self.objects.len());
                self.simulation.world.despawn(self.objects.swap_remove(index));
            }
            Event::Policy(policy) => self.simulation.world.insert_resource(LightPolicies::same(*policy)),
            Event::Rebuild(plan) => self.build(plan.clone()),
            _ => {}
        }
    }

    /// Share of each light for every object, straight from the definition.
    fn gets(&mut self) -> Vec<Gets> {
        let world = &mut self.simulation.world;
        let mut objects = world.query::<(Entity, &MeshId, &GlobalTransform)>();
        let cells = world.resource::<Cells>();
        let open =
            |opening: &Opening| opening.portal.and_then(|portal| world.get::<Portal>(portal)).map_or(1.0, |p| p.open);
        let open: Vec<f32> = cells.openings().iter().map(open).collect();
        let scored = world.resource::<LightTable>().scored();
        let flood = |light: &ScoredLight| match light.kind {
            LightRecord::OFF => Flood::default(),
            LightRecord::DIRECTIONAL => Flood::new(cells, &open, Source::Parallel(light.axis)),
            _ => Flood::new(cells, &open, Source::Point(light.position, light.range)),
        };
        let floods: Vec<Flood> = scored.iter().map(flood).collect();
        let library = world.resource::<Library>();
        let of_object = |(entity, &mesh, place): (Entity, &MeshId, &GlobalTransform)| {
            let (sphere, aabb) =
                (world_bounds(library, mesh, place).unwrap(), world_box(library, mesh, place).unwrap());
            let occupied = Occupied::new(cells, aabb);
            let share = |light: &ScoredLight, flood: &Flood| {
                if score(light, sphere) > 0.0 { flood.share(&occupied) } else { 0.0 }
            };
            let gets = scored.iter().zip(&floods).map(|(light, flood)| (*light, share(light, flood))).collect();
            (entity, sphere, aabb, gets)
        };
        objects.iter(world).map(of_object).collect()
    }

    /// Compares the selection of every object with that of the plain search.
    fn compare(&mut self, gets: &[Gets]) {
        let world = &mut self.simulation.world;
        let policy = world.resource::<LightPolicies>().objects;
        let scored = world.resource::<LightTable>().scored().to_vec();
        let lists = world.resource::<LightLists>();
        for (object, sphere, _, gets) in gets {
            let mut expected = [Selection::default()];
            let share = |_, slot: u32| gets[slot as usize].1;
            let policies = Policies::Same(policy);
            let further = brute_force::select_shares(&scored, policies, &[*sphere], share, &mut expected);
            let selected = world.get::<SelectedLights>(*object).unwrap();
            assert_kept(lists, selected, &expected[0], &further.lights);
        }
    }
}

proptest! {
    #![proptest_config(cases(150))]

    /// In random buildings things move, doors open, lights come and go: what is kept equals what the plain search finds,
    /// and only those objects choose again for which a light is another than before.
    #[test]
    fn what_is_kept_equals_the_plain_search(
        plan in any_plan(),
        objects in prop::collection::vec((any_place(1.0), any_place(0.6)), 0..40),
        lights in prop::collection::vec((any_light(), any_place(1.0)), 0..16),
        policy in any_policy(),
        events in prop::collection::vec(any_event(), 0..40),
    ) {
        let mut building = Building::new(plan);
        building.simulation.world.insert_resource(LightPolicies::same(policy));
        objects.iter().for_each(|&(at, size)| building.happen(&Event::SpawnObject(at, size)));
        lights.iter().for_each(|(light, at)| {
            // Most of them indoors.
            let light = if light.kind == LightKind::Directional && at.y > -0.5 {
                Light { kind: LightKind::Point, ..light.clone() }
            } else {
                light.clone()
            };
            building.happen(&Event::SpawnLight(light, *at));
        });
        building.simulation.frame();
        let mut before = building.gets();
        building.compare(&before);
        for event in &events {
            building.happen(event);
            building.simulation.frame();
            let now = building.gets();
            building.compare(&now);
            let FrameStats { selected, floods, .. } = building.simulation.world.resource::<FrameStats>();
            if let Event::Nothing = event {
                prop_assert_eq!((*selected, *floods), (0, 0));
            }
            if let Event::MoveLight(..) | Event::Open(..) | Event::Paint(..) = event {
                let is_other = |(a, b): &(&Gets, &Gets)| {
                    a.3.iter().zip(&b.3).any(|(a, b)| a.1 != b.1 || a.0 != b.0 && b.1 > 0.0)
                };
                prop_assert_eq!(*selected, before.iter().zip(&now).filter(is_other).count(), "{:?}", event);
            }
            if let Event::Paint(..) = event {
                prop_assert_eq!(*floods, 0);
            }
            before = now;
        }
    }
}

/// Behind a shut door it is as if the lamp were not there, to the bit.
#[test]
fn a_shut_door_keeps_all_light_out() {
    let mut simulation = Simulation::new();
    let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
    let portal = simulation.world.spawn(Portal::default()).id();
    simulation.world.insert_resource(two_rooms(Some(portal)));
    let object = simulation.world.spawn((cube, Transform::from_xyz(8.0, 0.6, 3.5))).id();
    simulation.world.spawn((Light::point(1.0, 20.0), Transform::from_xyz(7.0, 2.5, 6.0)));
    let lamp = simulation.world.spawn((Light::point(1.0, 20.0), Transform::from_xyz(3.0, 1.5, 3.5))).id();
    let mut lights = |edit: &dyn Fn(&mut World)| {
        edit(&mut simulation.world);
        simulation.frame();
        let floods = simulation.world.resource::<FrameStats>().floods;
        let selected = *simulation.world.get::<SelectedLights>(object).unwrap();
        (selected.unpack(simulation.world.resource()), floods)
    };
    let set = |open: f32| move |world: &mut World| world.get_mut::<Portal>(portal).unwrap().open = open;
    let (open, floods) = lights(&|_| {});
    assert_eq!((open.reaching, floods), (2, 2));
    let (half, _) = lights(&set(0.25));
    assert!((half.weights[half.lights.iter().position(|&slot| slot == 1).unwrap()] - 0.5).abs() < 1e-3, "{half:?}");
    let (shut, floods) = lights(&set(0.0));
    assert_eq!((shut.reaching, floods), (1, 2));
    assert_eq!(lights(&|_| {}), (shut, 0));
    let without = lights(&|world| _ = world.despawn(lamp));
    assert_eq!(without, (shut, 0));
}

/// Doors are state: a run that goes on from a snapshot is the run that was saved, an input among its steps.
#[test]
fn a_door_goes_on_from_a_snapshot() {
    let with_doors = || {
        let mut simulation = Simulation::new();
        let world = &mut simulation.world;
        let doors = [3.0f32, 0.0].map(|period| {
            let leaf = world.spawn(Transform::from_xyz(1.0, 0.0, 0.0)).id();
            let door = Door { leaf: Some(leaf), swing: 1.5, slide: Vec3::X, period, ..Door::default() };
            (world.spawn(door).id(), leaf)
        });
        register_all(world);
        (simulation, doors)
    };
    let (mut whole, [moving, still]) = with_doors();
    (0..70).for_each(|_| whole.step());
    push_for(&mut whole.world, still.0, |entity| SetPortal { entity, open: 0.4 });
    whole.step();
    assert_eq!(whole.world.get::<Portal>(still.0).unwrap().open, 0.4);
    let saved = snapshot::save(&mut whole.world);
    let (mut continued, _) = with_doors();
    snapshot::restore(&mut continued.world, &saved).expect("a snapshot of this world");
    let mut hashes = Vec::new();
    for _ in 0..100 {
        whole.step();
        continued.step();
        let now = hash(&mut whole.world);
        assert_eq!(now, hash(&mut continued.world));
        hashes.push(now);
    }
    assert!(hashes.windows(2).all(|pair| pair[0] != pair[1]), "the clock is state");
    for (portal, leaf) in [moving, still] {
        let open = whole.world.get::<Portal>(portal).unwrap().open;
        let place = whole.world.get::<Transform>(leaf).unwrap();
        // As far as the portal is open, from its place when shut.
        assert_eq!(place.translation, Vec3::X * open);
        assert!(place.rotation.angle_between(Quat::from_rotation_y(1.5 * open)) < 1e-3);
    }
    // Not beyond what a portal can be.
    push_for(&mut whole.world, still.0, |entity| SetPortal { entity, open: 2.0 });
    whole.step();
    assert_eq!(whole.world.get::<Portal>(still.0).unwrap().open, 0.4);
}
