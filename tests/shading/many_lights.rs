//! A scene of a hundred thousand lights: checked, loaded, drawn.

use crate::common::{self, prelude::*};
use relief::{check, scene};
use systems::assets::world_bounds;
use systems::lights::{LightTable, score};

const LIGHTS: usize = 100_000;

const SCENE: &str = r#"(
    environment: (ambient: (0, 0, 0), zenith: (0, 0, 0), horizon: (0, 0, 0), ground: (0, 0, 0), tone_map: clamp),
    meshes: { "tile": plane(size: (8, 8)) },
    entities: [
        (mesh: "tile"),
        (mesh: "tile", transform: (translation: (40, 0, 0))),
        (name: "above", transform: (translation: (0, 10, 0), rotation_degrees: (-90, 0, 0)), camera: ()),
    ],
    generators: [(
        name: "lamp",
        place: scatter(region: box(min: (-300, 0.5, -300), max: (300, 4, 300)), count: 100000),
        lights: [
            point(color: kelvin(2700), intensity: 0.2, range: 6),
            spot(outer_degrees: 40, intensity: 0.2, range: 8, attenuation: inverse_square),
        ],
    )],
)"#;

fn written(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("many.ron");
    std::fs::write(&path, SCENE).expect("a scene file");
    path
}

#[test]
fn a_hundred_thousand_lights_load_and_draw() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = written(folder.path());
    assert_eq!(check::check(&path, Simulation::new), []);
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let loaded = scene::load(&path, &mut simulation).expect("a scene");
    assert_eq!(loaded.warnings, [""; 0]);

    let mut headless = Headless { renderer: SingleView::new(&gpu), settings: Settings::default() };
    let camera = loaded.cameras[0].1;
    let picture = headless.draw(&mut simulation, camera, (32, 18)).expect("a picture");
    assert!(picture.get_pixel(16, 9).0[..3].iter().any(|&byte| byte > 10), "{:?}", picture.get_pixel(16, 9));
    assert_eq!(simulation.draw_list().lights.records.len(), LIGHTS);

    let mut tiles = simulation.world.query::<(&MeshId, &GlobalTransform, &SelectedLights)>();
    let scored = simulation.world.resource::<LightTable>().scored();
    for (&mesh, place, selected) in tiles.iter(&simulation.world) {
        let bounds = world_bounds(simulation.library(), mesh, place).expect("a mesh");
        let selection = selected.unpack(simulation.world.resource());
        let reaching = scored.iter().filter(|light| score(light, bounds) > 0.0).count();
        assert!(reaching > 3 && selection.reaching as usize == reaching, "{reaching} {selection:?}");
    }

    // Nothing moves: nothing is uploaded again.
    headless.draw(&mut simulation, camera, (32, 18)).expect("a picture");
    assert_eq!(headless.renderer.stats().uploaded_bytes(), 0);
}
