//! glTF and GLB: read, looked through, and brought to the point where they could be drawn.

use crate::{Place, repair};
use relief::import::load_model;
use relief::prelude::{Simulation, Transform};
use std::path::Path;
use systems::assets::Library;

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
        }
    }
}

/// What has been loaded can be drawn without another look at it.
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
