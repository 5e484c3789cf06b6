//! The scenes that come with the project.

use super::*;

#[test]
fn the_example_scenes_load_without_a_warning() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    for name in ["shapes", "lights"] {
        let mut simulation = Simulation::new();
        let path = folder.join(name).with_extension("ron");
        let scene = scene::load(&path, &mut simulation).unwrap_or_else(|e| panic!("{e}"));
        simulation.frame();
        assert_eq!(scene.warnings, Vec::<String>::new());
        assert!(!simulation.draw_list().batches.is_empty());
    }
}

#[test]
fn the_whole_scenes_of_the_documentation_load() {
    let docs = include_str!("../../docs/scenes.md");
    let folder = Folder::with_model();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").display().to_string();
    let scenes: Vec<&str> = docs.split("```ron scene\n").skip(1).filter_map(|s| s.split("```").next()).collect();
    assert!(!scenes.is_empty());
    for text in scenes {
        let (_, scene) = folder.load(&text.replace("\"../", &format!("\"{assets}/")));
        assert!(scene.warnings.is_empty());
    }
}
