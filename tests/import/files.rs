//! The files that models name, and several models at once.

use crate::common::prelude::*;
use crate::support::*;
use relief::import::{ImportError, Model, load_models};

#[test]
fn files_above_a_model_are_read_where_the_file_that_names_it_spans_them() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("project");
    for sub in ["models", "textures", "scenes"] {
        std::fs::create_dir_all(root.join(sub)).unwrap();
    }
    let red = |path: &Path| image::RgbImage::from_pixel(4, 4, image::Rgb([250, 0, 0])).save(path).unwrap();
    red(&root.join("textures/wood.png"));
    red(&folder.path().join("secret.png"));
    let load = |uri: &str, named_in: Option<&str>| -> Result<Vec<relief::import::Warning>, String> {
        let path = root.join("models/chair.gltf");
        let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let document = json!({
            "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                            "min": [0, 0, 0], "max": [1, 1, 0] }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [buffer(&floats(positions.as_flattened()))],
            "images": [{ "uri": uri }], "textures": [{ "source": 0 }],
            "materials": [{ "emissiveTexture": { "index": 0 } }],
        });
        std::fs::write(&path, document.to_string()).unwrap();
        let mut library = Library::default();
        let model = match named_in {
            None => load_model(&path, &mut library),
            Some(named_in) => load_models(&[path], &root.join(named_in), &mut library).remove(0),
        };
        // The triangle has no texture coordinates, which is of no account here.
        let told = |model: Model| model.warnings.into_iter().filter(|w| !w.message.contains("TEXCOORD_0")).collect();
        model.map(told).map_err(|error| error.to_string())
    };
    for named_in in [".", "scenes", "scenes/.."] {
        assert_eq!(load("../textures/wood.png", Some(named_in)), Ok(vec![]), "{named_in}");
        let warnings = load("..\\textures\\wood.png", Some(named_in)).unwrap();
        assert!(warnings.len() == 1 && warnings[0].message.contains("backslashes"), "{warnings:?}");
    }
    let alone = load("../textures/wood.png", None).unwrap_err();
    assert!(alone.contains("images[0].uri") && alone.contains("scene file"), "{alone}");
    for uri in ["../../secret.png", "..%2f..%2fsecret.png", "../textures/../../secret.png"] {
        let error = load(uri, Some("scenes")).unwrap_err();
        assert!(error.contains("leads outside") && error.contains("project"), "{error}");
    }
    // Whether there is such a file is not found out.
    assert_eq!(
        load("../../none", None).unwrap_err().replace("none", "secret.png"),
        load("../../secret.png", None).unwrap_err()
    );
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(folder.path().join("secret.png"), root.join("models/link.png")).unwrap();
        let error = load("link.png", Some(".")).unwrap_err();
        assert!(error.contains("it is a link to"), "{error}");
        // Links within are followed.
        std::os::unix::fs::symlink(root.join("textures"), root.join("models/textures")).unwrap();
        assert_eq!(load("textures/wood.png", Some(".")), Ok(vec![]));
    }
}

/// Stores of files show a model by links. The files that it may read are those beside the link and beside its target.
#[cfg(unix)]
#[test]
fn a_model_that_is_a_link_loads_with_what_is_beside_it_or_its_target() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for sub in ["store/models/deep", "links", "annex/a", "annex/b", "annex/models"] {
        std::fs::create_dir_all(at(sub)).unwrap();
    }
    let triangle = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let write = |name: &str, uri: &str| {
        let document = json!({
            "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                            "min": [0, 0, 0], "max": [1, 1, 0] }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [{ "byteLength": 36, "uri": uri }],
        });
        std::fs::write(at(name), document.to_string()).unwrap();
    };
    let load = |name: &str| load_model(&at(name), &mut Library::default()).map(|_| ()).map_err(|e| e.to_string());
    for name in ["store/models/beside.bin", "store/models/deep/below.bin", "store/secret.bin", "links/own.bin"] {
        std::fs::write(at(name), &triangle).unwrap();
    }
    std::fs::copy(at("store/models/beside.bin"), at("store/models/linked.bin")).unwrap();
    symlink(at("store/models/linked.bin"), at("links/linked.bin")).unwrap();
    // Beside the target, below it, beside the link, and by a link of its own.
    for (i, uri) in ["beside.bin", "deep/below.bin", "own.bin", "linked.bin"].into_iter().enumerate() {
        write(&format!("store/models/{i}.gltf"), uri);
        symlink(at(&format!("store/models/{i}.gltf")), at(&format!("links/{i}.gltf"))).unwrap();
        assert_eq!(load(&format!("links/{i}.gltf")), Ok(()), "{uri}");
    }
    // Nothing further: neither above the target, nor by links that lead out of both folders.
    write("store/models/above.gltf", "../secret.bin");
    write("store/models/out.gltf", "out.bin");
    write("store/models/other.gltf", "other.bin");
    symlink(at("store/secret.bin"), at("store/models/out.bin")).unwrap();
    symlink(at("store/secret.bin"), at("links/other.bin")).unwrap();
    for name in ["above.gltf", "out.gltf", "other.gltf"] {
        symlink(at(&format!("store/models/{name}")), at(&format!("links/{name}"))).unwrap();
        assert!(load(&format!("links/{name}")).is_err(), "{name}");
    }
    // As Git-annex has them: a folder for each.
    write("annex/a/model.gltf", "model.bin");
    std::fs::write(at("annex/b/model.bin"), &triangle).unwrap();
    for (from, to) in [("annex/a/model.gltf", "model.gltf"), ("annex/b/model.bin", "model.bin")] {
        symlink(at(from), at(&format!("annex/{to}"))).unwrap();
        symlink(at(from), at(&format!("annex/models/{to}"))).unwrap();
    }
    assert_eq!(load("annex/model.gltf"), Ok(()));
    let error = load("annex/models/model.gltf").unwrap_err();
    assert!(error.contains("it is a link to") && error.contains("scene file"), "{error}");
    let model = at("annex/models/model.gltf");
    assert!(load_models(&[model], &at("annex"), &mut Library::default())[0].is_ok(), "named by a scene above both");
}

#[test]
fn models_read_in_parallel_join_the_library_in_order() {
    let names = ["van", "barrel", "missing", "crate"];
    let file = |name: &str| {
        let name = if name == "van" { "vehicle_van" } else { name };
        Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models").join(format!("{name}.glb"))
    };
    let paths: Vec<PathBuf> = names.iter().map(|name| file(name)).collect();
    let (mut one_by_one, mut together) = (Library::default(), Library::default());
    let (before, _) = relief::import::progress::counts();
    let expected: Vec<_> = paths.iter().map(|path| load_model(path, &mut one_by_one)).collect();
    let models = load_models(&paths, Path::new("."), &mut together);
    assert_eq!(models.iter().map(Result::is_ok).collect::<Vec<_>>(), [true, true, false, true]);
    for (model, expected) in models.iter().zip(&expected) {
        let parts = |model: &Result<Model, ImportError>| match model {
            Ok(model) => model.nodes.iter().map(|node| node.parts.clone()).collect::<Vec<_>>(),
            Err(_) => Vec::new(),
        };
        assert_eq!(parts(model), parts(expected));
    }
    let meshes = |library: &Library| library.meshes().map(|(_, m)| m.mesh.name.clone()).collect::<Vec<_>>();
    assert_eq!(meshes(&together), meshes(&one_by_one));
    assert!(together.materials().eq(one_by_one.materials()));
    assert!(together.images().eq(one_by_one.images()));
    let (done, wanted) = relief::import::progress::counts();
    assert!(done >= before + 2 * (together.images().count() - Library::default().images().count()) && wanted >= done);
}
