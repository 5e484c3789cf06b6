//! Tangents and levels that were kept from an earlier start.

use crate::common::{self, prelude::*};
use crate::models::{fine_torus, glb};
use glam::Vec2Swizzles;
use relief::import::cache::{Cache, Key};
use relief::import::meshes::finish_meshes;
use systems::assets::MeshEntry;

/// With both sets of UVs and with colours.
fn full() -> Mesh {
    let mut mesh = fine_torus(64, 32);
    mesh.tangents.clear();
    mesh.uvs[1] = mesh.uvs[0].iter().map(|uv| uv.yx() * 3.0).collect();
    mesh.colors = mesh.positions.iter().map(|p| p.abs().extend(1.0)).collect();
    mesh
}

fn finished(mesh: Mesh, cache: &Cache) -> MeshEntry {
    let mut library = Library::default();
    library.add_mesh(mesh);
    finish_meshes(&mut library, cache);
    library.mesh_in_slot(0).unwrap().1.clone()
}

fn by_itself(mesh: Mesh) -> MeshEntry {
    let mut library = Library::default();
    library.add_mesh(mesh);
    library.unfinished_meshes().for_each(MeshEntry::finish);
    library.mesh_in_slot(0).unwrap().1.clone()
}

fn assert_same(a: &MeshEntry, b: &MeshEntry) {
    assert!(a.is_finished() && b.is_finished());
    // As text, which no field can be left out of.
    assert!(format!("{a:?}") == format!("{b:?}"));
}

fn open(folder: &Path) -> Cache {
    Cache::new(folder.to_owned(), 1 << 30)
}

#[test]
fn the_second_time_comes_from_the_cache_and_is_what_is_made_without() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = full();
    let truth = by_itself(mesh.clone());
    assert!(truth.levels.len() > 2 && !truth.mesh.tangents.is_empty());
    for counts in [(0, 1), (1, 0), (1, 0)] {
        let cache = open(folder.path());
        assert_same(&finished(mesh.clone(), &cache), &truth);
        assert_eq!(cache.counts(), counts);
    }
    // Damaged files are worked out anew; so are those that are whole, but hold no mesh.
    let path = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
    let key = Key::from_hex(path.file_stem().unwrap().as_encoded_bytes()).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let contents = &whole[blake3::OUT_LEN..];
    let mut flipped = whole.clone();
    flipped[1000] ^= 1;
    std::fs::write(&path, flipped).unwrap();
    // An index beyond the vertices: the last of the levels'.
    let beyond = [&contents[..contents.len() - 4], &[255; 4]].concat();
    let longer = [contents, &[0; 4]].concat();
    for others in [None, Some(&[][..]), Some(&contents[..contents.len() - 4]), Some(&longer), Some(&beyond)] {
        if let Some(contents) = others {
            open(folder.path()).write(&key, contents);
        }
        let cache = open(folder.path());
        assert_same(&finished(mesh.clone(), &cache), &truth);
        assert_eq!(cache.counts(), (0, 1));
    }
    assert_eq!(std::fs::read(&path).unwrap(), whole);
}

#[test]
fn what_differs_in_anything_is_another_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = full();
    type Change = fn(&mut Mesh);
    let others: [(&str, Change); 8] = [
        ("position", |mesh| mesh.positions[7].x += 0.001),
        ("normal", |mesh| mesh.normals[7] = -mesh.normals[7]),
        ("UV", |mesh| mesh.uvs[0][7].x += 0.001),
        ("second UV", |mesh| mesh.uvs[1][7].x += 0.001),
        ("set of UVs", |mesh| mesh.tangent_uv_set = 1),
        ("colour", |mesh| mesh.colors[7].x = 0.25),
        ("indices", |mesh| mesh.indices.swap(3, 4)),
        ("tangents", |mesh| mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); mesh.positions.len()]),
    ];
    finished(mesh.clone(), &open(folder.path()));
    for (what, change) in others {
        let mut other = mesh.clone();
        change(&mut other);
        let cache = open(folder.path());
        let found = finished(other.clone(), &cache);
        assert_eq!(cache.counts(), (0, 1), "{what}");
        assert_same(&found, &by_itself(other));
    }
    // What it is called does not matter, and it keeps its name.
    let cache = open(folder.path());
    let named = finished(Mesh { name: "other".into(), ..mesh }, &cache);
    assert_eq!((cache.counts(), &*named.mesh.name), ((1, 0), "other"));
}

#[test]
fn equal_meshes_are_worked_out_once() {
    let folder = tempfile::tempdir().unwrap();
    let truth = by_itself(full());
    for counts in [(0, 1), (1, 0)] {
        let (mut library, cache) = (Library::default(), open(folder.path()));
        for name in ["a", "b", "c"] {
            library.add_mesh(Mesh { name: name.into(), ..full() });
        }
        finish_meshes(&mut library, &cache);
        assert_eq!(cache.counts(), counts);
        for ((_, entry), name) in library.meshes().zip(["a", "b", "c"]) {
            assert_eq!(entry.mesh.name, name);
            let unnamed = Mesh { name: truth.mesh.name.clone(), ..entry.mesh.clone() };
            assert_same(&MeshEntry { mesh: unnamed, ..entry.clone() }, &truth);
        }
    }
}

#[test]
fn a_mesh_that_is_to_have_no_levels_has_none_and_small_ones_are_left_to_the_systems() {
    let folder = tempfile::tempdir().unwrap();
    finished(full(), &open(folder.path()));
    for counts in [(0, 1), (1, 0)] {
        let (mut library, cache) = (Library::default(), open(folder.path()));
        library.add_mesh_without_levels(full());
        finish_meshes(&mut library, &cache);
        let (_, entry) = library.mesh_in_slot(0).unwrap();
        assert!(entry.is_finished() && entry.levels.len() == 1 && entry.level_indices.is_empty());
        assert_eq!(cache.counts(), counts);
    }
    let cache = open(folder.path());
    let small = finished(shapes::torus(1.0, 0.4, 16, 8), &cache);
    assert!(small.mesh.tangents.is_empty() && small.levels.is_empty());
    assert_eq!(cache.counts(), (0, 0));
}

/// The picture of a model, rendered with a folder for the cache.
fn picture(folder: &Path, out: &str, options: &[&str]) -> Option<Vec<u8>> {
    common::gpu()?;
    let args = [&["render", "torus.glb", "--size", "64x36", "-o", out], options].concat();
    let output = common::command(&args, folder).env("RELIEF_CACHE_DIR", folder.join("cache")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(std::fs::read(folder.join(out).join("color_00000.png")).unwrap())
}

#[test]
fn a_model_looks_the_same_the_second_time() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("torus.glb"), glb(&[(&full(), [1.0; 3])])).unwrap();
    let Some(without) = picture(folder.path(), "without", &["--no-cache"]) else { return };
    assert!(!folder.path().join("cache").exists());
    let first = picture(folder.path(), "first", &[]).unwrap();
    assert_eq!(std::fs::read_dir(folder.path().join("cache")).unwrap().count(), 1);
    let second = picture(folder.path(), "second", &[]).unwrap();
    assert!(without == first && first == second);
}
