//! The files that models name, and several models at once.

use crate::support::{buffer, floats};
use relief::import::{ImportError, Model, load_model, load_models};
use serde_json::json;
use std::path::{Path, PathBuf};
use systems::library::Library;

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
    let meshes = |library: &Library| library.meshes().iter().map(|m| m.mesh.name.clone()).collect::<Vec<_>>();
    assert_eq!(meshes(&together), meshes(&one_by_one));
    assert_eq!(together.materials(), one_by_one.materials());
    assert!(together.images() == one_by_one.images());
    let (done, wanted) = relief::import::progress::counts();
    assert!(done >= before + 2 * (together.images().len() - Library::default().images().len()) && wanted >= done);
}
