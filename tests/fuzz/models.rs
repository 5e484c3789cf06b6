//! glTF and GLB: read, looked through, and brought to the point where they could be drawn.

use crate::{Place, repair};
use glam::{DQuat, DVec3};
use relief::import::load_model;
use relief::prelude::{Simulation, Transform};
use relief::sense::{Pose, RayScene, lidar};
use std::path::Path;
use systems::assets::Library;
use systems::sensors::philox::Noise;
use systems::sensors::{Beam, Beams, LidarSensor};

/// A document.
pub fn gltf(place: &Place, bytes: &[u8]) {
    read(&place.write("models", ".gltf", bytes));
}

/// A document with its buffer.
pub fn glb(place: &Place, bytes: &[u8]) {
    read(&place.write("models", ".glb", &repair::mostly(bytes, repair::glb)));
}

fn read(path: &Path) {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let before = library.sizes();
    match load_model(path, &mut library) {
        Err(error) => {
            assert_eq!(library.sizes(), before, "refused, yet something joined the library: {error}");
            assert!(error.to_string().starts_with(&*path.to_string_lossy()), "which file? {error}");
        }
        Ok(model) => {
            look_through(&model, &library);
            model.spawn(&mut simulation.world, Transform::IDENTITY);
            simulation.frame();
            scan(&simulation);
        }
    }
}

/// Beams in all directions go through its trees.
fn scan(simulation: &Simulation) {
    let beam = |elevation_degrees: f32| Beam { elevation_degrees, ..Beam::default() };
    let beams = Beams::List([-60.0, -20.0, 0.0, 30.0].map(beam).to_vec());
    let sensor = LidarSensor { beams, columns: 30, ..LidarSensor::default() };
    let mut rays = RayScene::default();
    rays.update(simulation);
    let pose = Pose { translation: DVec3::new(0.1, 2.0, 0.3), rotation: DQuat::IDENTITY };
    let found = lidar::scan(&rays, &sensor, &[pose; 2], sensor.revolution(), Noise::new(1, 2, 3));
    assert!(found.range.iter().all(|range| range.is_finite()), "a range is no number");
}

/// Asserts that a loaded model can be drawn without further checks.
fn look_through(model: &relief::import::Model, library: &Library) {
    for (_, place) in model.placed() {
        assert!(place.is_finite(), "a node's place is not finite");
    }
    for (_, entry) in library.meshes() {
        let mesh = &entry.mesh;
        let count = mesh.positions.len();
        assert!(mesh.indices.len().is_multiple_of(3) && mesh.indices.iter().all(|&i| (i as usize) < count));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.normals.len() == count && mesh.normals.iter().all(|n| n.is_normalized()));
        for length in [mesh.tangents.len(), mesh.uvs[0].len(), mesh.uvs[1].len(), mesh.colors.len()] {
            assert!(length == 0 || length == count, "{length} of {count}");
        }
    }
}
