//! A frame shows the world as it is, whether or not there were frames before.

use crate::common::prelude::*;
use systems::lights::{LightLists, Selection};

/// A place, and lights: what is chosen and, beyond the first three, listed. Where a list lies depends on the frames
/// before.
type Seen = (GlobalTransform, Option<(Selection, Vec<(u32, f32)>)>);

/// Places and lights of all entities.
fn seen(stage: &mut Session) -> BTreeMap<Entity, Seen> {
    let world = &mut stage.simulation.world;
    let mut all = world.query::<(Entity, &GlobalTransform, Option<&SelectedLights>)>();
    let lists = world.resource::<LightLists>();
    let lights = |selected: &SelectedLights| (selected.unpack(lists), lists.of(selected).0);
    all.iter(world).map(|(entity, place, selected)| (entity, (*place, selected.map(lights)))).collect()
}

#[test]
fn scenes_are_seen_as_if_no_frame_had_been_before() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let mut moving = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the shipped scenes").flatten() {
        let load = || Session::load(&entry.path(), &LoadOptions::default());
        // Files of vehicle types are no scenes.
        let Ok(mut watched) = load() else { continue };
        watched.simulation.frame();
        let first = seen(&mut watched);
        for step in 1..=24 {
            watched.simulation.step();
            watched.simulation.frame();
            if step % 8 != 0 {
                continue;
            }
            let mut fresh = load().expect("the scene");
            (0..step).for_each(|_| fresh.simulation.step());
            fresh.simulation.frame();
            let (seen, expected) = (seen(&mut watched), seen(&mut fresh));
            let others: Vec<_> =
                expected.iter().filter(|(entity, now)| seen.get(entity) != Some(now)).take(3).collect();
            assert!(seen.len() == expected.len() && others.is_empty(), "{}: {others:?}", entry.path().display());
        }
        let moved = seen(&mut watched).iter().filter(|(entity, now)| first.get(entity) != Some(now)).count();
        moving.push((entry.file_name().into_string().expect("a name"), moved));
    }
    eprintln!("{moving:?}");
    // Vehicles with their wheels and lamps; and the light that they carry away.
    let moved = |name: &str| moving.iter().find(|(scene, _)| scene == name).map_or(0, |(_, moved)| *moved);
    assert!(["town.ron", "traffic.ron", "lights.ron"].into_iter().all(|scene| moved(scene) > 20), "{moving:?}");
}
