//! Cells, portals and doors: from files and from models, and what is said of them.

use super::*;
use systems::cells::{Cells, Door, OUTSIDE, Portal};
use systems::run::inputs::Inputs;
use systems::run::registry::EntityRegistry;
use systems::run::standard_inputs::{SetPortal, push_for};

/// Two rooms, a door that moves, and a window.
const ROOMS: &str = r#"(
    meshes: { "leaf": cube(size: (0.04, 2, 0.9)), "block": cube(size: (4, 3, 4)) },
    cells: { "hall": (box: ((0, 0, 0), (5, 2.8, 8))), "store": (hull: "block", translation: (7, 1.5, 2)) },
    portals: [
        (between: ("hall", "store"), polygon: [(5, 0, 1), (5, 0, 2), (5, 2.1, 2), (5, 2.1, 1)],
         door: (leaf: "leaf", swing_degrees: -90, slide: (0.5, 0, 0), period_seconds: 8, phase_seconds: 0.5)),
        (name: "window", between: ("store", "outside"), polygon: [(9, 1, 1), (9, 1, 2), (9, 2, 2), (9, 2, 1)], open: 0.25),
    ],
    entities: [(name: "leaf", mesh: "leaf", transform: (translation: (5, 1, 1), rotation_degrees: (0, 30, 0)))],
)"#;

#[test]
fn rooms_doors_and_windows() {
    let (mut simulation, loaded) = load(ROOMS);
    assert_eq!(loaded.warnings, [] as [String; 0]);
    let world = &mut simulation.world;
    let cells = world.resource::<Cells>().clone();
    let names: Vec<&str> = cells.cells().iter().map(|cell| cell.name.as_str()).collect();
    assert_eq!(names, ["hall", "store"]);
    assert_eq!([1.0, 6.0, 10.0].map(|x| cells.at(Vec3::new(x, 1.0, 1.0))), [1, 2, OUTSIDE]);
    let between: Vec<[u32; 2]> = cells.openings().iter().map(|opening| opening.between).collect();
    assert_eq!(between, [[1, 2], [2, OUTSIDE]]);
    let [door, window] = ["hall – store", "window"].map(|name| named(world, name));
    assert_eq!([door, window].map(Some), [0, 1].map(|i: usize| cells.openings()[i].portal));
    assert_eq!(world.get::<Portal>(window), Some(&Portal { open: 0.25 }));
    let leaf = named(world, "leaf");
    let shut = *world.get::<Transform>(leaf).unwrap();
    assert_eq!(world.get::<Door>(door).unwrap().leaf, Some(leaf));
    // At 3.5 s it is in the middle of its period: open.
    (0..210).for_each(|_| simulation.step());
    let world = &mut simulation.world;
    assert_eq!(world.get::<Portal>(door), Some(&Portal { open: 1.0 }));
    let open = *world.get::<Transform>(leaf).unwrap();
    assert_eq!(open.translation, shut.translation + Vec3::X * 0.5);
    assert!(open.rotation.angle_between(Quat::from_rotation_y((30f32 - 90.0).to_radians())) < 1e-3);
    // An input ends that, and the leaf follows.
    assert!(world.resource::<EntityRegistry>().id(door).is_some());
    push_for(world, door, |entity| SetPortal { entity, open: 0.0 });
    assert!(!world.resource::<Inputs>().is_empty());
    (0..3).for_each(|_| simulation.step());
    let world = &simulation.world;
    assert_eq!(world.get::<Portal>(door), Some(&Portal { open: 0.0 }));
    assert_eq!(world.get::<Transform>(leaf), Some(&shut));
}

#[test]
fn far_from_zero_they_count_from_the_origin() {
    let far = ROOMS.replace("(5, ", "(500005, ").replace("(0, 0, 0), (500005", "(500000, 0, 0), (500005");
    let far = far.replace("(9, ", "(500009, ").replace("translation: (7", "translation: (500007");
    let cells = |text: &str| {
        let (simulation, _) = load(text);
        let cells = simulation.world.resource::<Cells>();
        cells
            .openings()
            .iter()
            .map(|o| o.polygon.clone())
            .zip(cells.cells().iter().map(|c| c.aabb()))
            .collect::<Vec<_>>()
    };
    assert_eq!(cells(&far.replacen('(', "(origin: (500000, 0, 0),", 1)), cells(ROOMS));
}

/// Scenes with a fault or a doubt each; `A` stands for a cell, `P` for a polygon on its border.
const PROBLEMS: &str = r##"
    (cells: {"a": ()}) → cells["a"]: expected either box or hull
    (cells: {"a": (box: ((0, 0, 0), (4, 0, 4)))})
    → cells["a"].box: expected the least and the largest corner, found [0.0, 0.0, 0.0] and [4.0, 0.0, 4.0]
    (cells: {"a": (hull: "b")}) → cells["a"].hull: unknown mesh "b"; none are defined
    (cells: {"outside": (box: ((0, 0, 0), (4, 3, 4)))})
    → cells["outside"]: reserved name: outside is what lies in no cell
    (cells: {A}, portals: [(between: ("a", "aa"), P)])
    → portals[0].between: unknown cell "aa"; did you mean "a"?
    (cells: {A}, portals: [(between: ("a", "a"), P)]) → portals[0].between: expected two different cells
    (cells: {A}, portals: [(between: ("a", "outside"), polygon: [(4, 0, 1)])])
    → portals[0].polygon: expected from 3 to 64 corners, found 1
    (cells: {A}, portals: [(between: ("a", "outside"), P, door: (leaf: "b"))])
    → portals[0].door.leaf: unknown entity "b"; none are defined
    (cells: {A}, entities: [(name: "b", camera: ())], portals: [
        (between: ("a", "outside"), P, door: (leaf: "b")),
        (between: ("a", "outside"), P, door: ()),
        (between: ("outside", "a"), P, door: (leaf: "b", slide: (0, 1, 0)))])
    → portals[2].door.leaf: expected a leaf of its own: another door moves it, too
    (origin: (0, 0, 0), cells: {"a": (box: ((0, 0, 0), (4, 3, 40000)))})
    → warning: cells[0] is up to 40.0 km from the origin (0, 0, 0): positions there are rounded to 3.9e-3 m; within 20
      km they are precise
    (cells: {A, "b": (box: ((3, 0, 0), (8, 3, 4)))})
    → warning: cells["b"]: overlaps cells["a"] by 1.00 m; cells have to be disjoint
    (meshes: {"ring": torus()}, cells: {"a": (hull: "ring")})
    → warning: cells["a"]: expected a convex mesh, found one that is not, by
    (meshes: {"m": cube(size: (0.01, 3, 4))}, cells: {A, "b": (box: ((4, 0, 0), (8, 3, 4)))},
        entities: [(name: "wall", mesh: "m", transform: (translation: (4, 1.5, 2)))])
    → warning: "wall" lies where cells "a" and "b" meet, and light of both reaches it; end cells within walls
"##;

#[test]
fn what_cannot_be_is_refused_and_what_is_doubtful_told() {
    let folder = Folder::with_model();
    let cell = "\"a\": (box: ((0, 0, 0), (4, 3, 4)))";
    let polygon = "polygon: [(4, 0, 1), (4, 0, 2), (4, 2, 2), (4, 2, 1)]";
    for (text, expected) in cases(PROBLEMS) {
        let problems = folder.problems(&text.replace('A', cell).replace('P', polygon));
        assert!(problems.len() == 1 && problems[0].contains(&expected), "{text}\n{problems:?}");
    }
}

/// The quad of `MODEL` as a portal, and a tetrahedron as a cell.
#[test]
fn nodes_of_models_are_cells_and_portals_by_their_extras() {
    let folder = Folder::with_model();
    let model = |extras: &str| {
        MODEL.replace(r#""name": "panel", "mesh": 0,"#, &format!(r#""name": "panel", "mesh": 0, "extras": {extras},"#))
    };
    let load = |extras: &str| {
        folder.file("rooms.gltf", model(extras));
        let text = r#"(
            meshes: { "rooms": model(file: "rooms.gltf") },
            cells: { "a": (box: ((-1, -1, 1), (1, 1, 3))), "b": (box: ((-1, -1, 3), (1, 1, 5))) },
            entities: [(mesh: "rooms")],
        )"#;
        let (mut simulation, loaded) = folder.load(text);
        let drawn = all::<MeshId>(&mut simulation.world).len();
        let openings = simulation.world.resource::<Cells>().openings().to_vec();
        (openings, drawn, loaded.warnings)
    };
    let none: [String; 0] = [];
    for names in ["[\"a\", \"b\"]", "[]"] {
        let (openings, drawn, warnings) = load(&format!(r#"{{"relief": {{"portal": {names}}}}}"#));
        assert_eq!((openings.len(), drawn, &warnings[..]), (1, 1, &none[..]), "a portal is not drawn");
        let mut between = openings[0].between;
        between.sort_unstable();
        assert_eq!(between, [1, 2]);
        assert_eq!(openings[0].polygon.len(), 4);
    }
    let (openings, drawn, _) = load(r#"{"other": 1}"#);
    assert_eq!((openings.len(), drawn), (0, 2));
    let (_, _, warnings) = load(r#"{"relief": {"cell": "c"}}"#);
    assert_eq!(warnings, ["cells[\"c\"]: expected a mesh with a volume; it counts as outside"]);
    let (openings, drawn, warnings) = load(r#"{"relief": {"portal": ["a"]}}"#);
    assert_eq!((openings.len(), drawn), (0, 2));
    assert!(warnings.iter().any(|w| w.contains("expected the names of two cells, or none, found 1")), "{warnings:?}");
}
