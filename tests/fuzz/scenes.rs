//! Scenes and types of vehicles: loaded, moved some steps, brought to the point where they could be drawn, and drawn.

use crate::Place;
use bevy_ecs::entity::Entity;
use relief::frames::Headless;
use relief::prelude::{Simulation, Transform, Vehicle, VehicleTypes, load_vehicle_types};
use relief::renderer::{Gpu, Settings, SingleView};
use relief::scene::{self, LoadedScene};
use std::path::Path;
use std::sync::LazyLock;
use systems::run::registry::{EntityRegistry, register_all};
use systems::run::state_hash;
use systems::vehicles::VehicleTypeId;

/// A scene that is accepted may be a large one on purpose. Beyond so many entities it is loaded and no more.
const MOST_MOVED: usize = 20_000;

/// A scene file.
pub fn scene(place: &Place, bytes: &[u8]) {
    let mut simulation = Simulation::new();
    if load(&place.write("scenes", ".ron", bytes), &mut simulation).is_none() {
        return;
    }
    move_on(&mut simulation);
}

fn load(path: &Path, simulation: &mut Simulation) -> Option<LoadedScene> {
    match scene::load(path, simulation) {
        Ok(loaded) => (simulation.world.resource::<EntityRegistry>().iter().count() <= MOST_MOVED).then_some(loaded),
        Err(error) => {
            assert!(!error.problems.is_empty());
            let text = error.to_string();
            assert!(text.starts_with(&*path.to_string_lossy()), "which file? {text}");
            None
        }
    }
}

fn move_on(simulation: &mut Simulation) {
    simulation.frame();
    (0..4).for_each(|_| simulation.step());
    simulation.frame();
    state_hash::hash(&mut simulation.world);
}

/// A file of types of vehicles, and one vehicle of each.
pub fn vehicle_types(place: &Place, bytes: &[u8]) {
    let path = place.write("", ".vehicles.ron", bytes);
    let mut simulation = Simulation::new();
    if let Err(error) = load_vehicle_types(&path, &mut simulation) {
        let text = error.to_string();
        assert!(text.starts_with(&*path.to_string_lossy()), "which file? {text}");
        return;
    }
    let types = simulation.world.resource::<VehicleTypes>().iter().count();
    for kind in (0..types).filter_map(|kind| u16::try_from(kind).ok()) {
        let at = Transform::from_xyz(f32::from(kind) * 10.0, 0.0, 0.0);
        simulation.world.spawn((at, Vehicle::of(VehicleTypeId(kind))));
    }
    register_all(&mut simulation.world);
    move_on(&mut simulation);
}

/// A scene or model that is drawn, where there is an adapter.
pub fn drawn(place: &Place, bytes: &[u8]) {
    static GPU: LazyLock<Option<Gpu>> = LazyLock::new(|| {
        let gpu = Gpu::headless();
        let strict = std::env::var_os("RELIEF_STRICT").is_some_and(|strict| strict != "0");
        assert!(!strict || gpu.is_ok(), "no graphics adapter to draw with");
        gpu.ok()
    });
    let is_model = bytes.starts_with(b"glTF") || bytes.trim_ascii_start().starts_with(b"{");
    let (folder, suffix) = if is_model { ("models", ".gltf") } else { ("scenes", ".ron") };
    let mut simulation = Simulation::new();
    let Some(loaded) = load(&place.write(folder, suffix, bytes), &mut simulation) else { return };
    let (Some(gpu), Some(&(_, camera))) = (&*GPU, loaded.cameras.first()) else { return };
    let mut headless = Headless { renderer: SingleView::new(gpu), settings: Settings::default() };
    for _ in 0..2 {
        draw(&mut headless, &mut simulation, camera);
        simulation.step();
    }
}

fn draw(headless: &mut Headless, simulation: &mut Simulation, camera: Entity) {
    // What the adapter does not take is refused, and no more.
    if let Ok(picture) = headless.draw(simulation, camera, (16, 16)) {
        assert_eq!(picture.dimensions(), (16, 16));
    }
}
