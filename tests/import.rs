mod common;
use relief::import::load_model;
use systems::library::Library;
#[test]
fn dump() {
    let data = common::test_data().unwrap();
    let mut open = vec![data.join("models"), data.join("asset-generator")];
    let mut files = vec![];
    while let Some(f) = open.pop() { for e in std::fs::read_dir(f).unwrap() { let p = e.unwrap().path(); if p.is_dir() { open.push(p) } else if p.extension().is_some_and(|e| e == "gltf" || e == "glb") { files.push(p) } } }
    files.sort();
    for f in files {
        let mut lib = Library::default();
        let t = std::time::Instant::now();
        let rel = f.strip_prefix(&data).unwrap().display().to_string();
        match load_model(&f, &mut lib) {
            Err(e) => println!("REFUSED {e}"),
            Ok(m) => {
                let b = m.bounds(&lib);
                println!("{rel}: {} nodes {} meshes {} materials {} images {} lights, {} cams, bounds {:.3} {:.3}  {:?}", m.nodes.len(), lib.meshes().len(), lib.materials().len()-1, lib.images().len()-4, m.nodes.iter().filter(|n| n.light.is_some()).count(), m.cameras().len(), b.min, b.max, t.elapsed());
                for w in &m.warnings { println!("    {}: {}", w.place, w.message); }
            }
        }
    }
}
