//! Numbers of a scene that outputs or files may not hold, told before anything is drawn.

use crate::data::formats::files::has_panoptic_picture;
use crate::data::formats::format::FileFormat;
use crate::sense::captures::label_table::LabelTable;
use bevy_ecs::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use systems::assets::MeshId;
use systems::sensors::{CameraOutput, Class, Classes, Sensor, SensorKind};

/// Things of a class in a picture, beyond which `panoptic` runs into the next class.
const MOST_OF_A_CLASS: usize = 1000;

/// A line for each sensor that may see more than an output or file has numbers for.
pub(super) fn warnings(world: &mut World, chosen: &BTreeMap<String, Sensor>, formats: &[FileFormat]) -> Vec<String> {
    let has_panoptic = |sensor: &Sensor| matches!(&sensor.kind, SensorKind::Camera(camera) if camera.outputs.has(CameraOutput::Panoptic));
    let has_labels =
        |sensor: &Sensor| matches!(sensor.kind, SensorKind::Lidar(_)) && formats.contains(&FileFormat::KITTI);
    if !chosen.values().any(|sensor| has_panoptic(sensor) || has_labels(sensor)) {
        return Vec::new();
    }
    let (things, largest) = things(world);
    let mut warnings = Vec::new();
    for (name, sensor) in chosen {
        let crowded = things.iter().filter(|(_, things)| has_panoptic(sensor) && things.len() > MOST_OF_A_CLASS);
        for (class, things) in crowded {
            let (count, last) = (things.len(), usize::from(*class) * 1000 + things.len() - 1);
            let ends = has_panoptic_picture(sensor, formats) && last > u16::MAX.into();
            let ends = if ends { ", and the run ends at a number beyond 65535, which PNG does not hold" } else { "" };
            let class = world.resource::<Classes>().get(Class(*class)).map_or("", |class| &class.name);
            warnings.push(format!(
                "sensor {name:?}: panoptic: there are {count} things of class {class:?}; where a picture shows more than \
                 {MOST_OF_A_CLASS}, their numbers run into those of the next class{ends}"
            ));
        }
        if has_labels(sensor) && largest > u16::MAX.into() {
            warnings.push(format!(
                "sensor {name:?}: kitti: numbers of things go up to {largest}; labels hold 65535, and the run ends where \
                 a thing beyond is met"
            ));
        }
    }
    warnings
}

/// Numbers of the things of each class, of which something is drawn; and the largest number of anything.
fn things(world: &mut World) -> (BTreeMap<u8, BTreeSet<u32>>, u32) {
    let drawn: Vec<Entity> = world.query_filtered::<Entity, With<MeshId>>().iter(world).collect();
    let (mut labels, mut things, mut largest) = (LabelTable::default(), BTreeMap::new(), 0);
    labels.begin();
    for entity in drawn {
        let labels = labels.labels(world, entity.index_u32().wrapping_add(1));
        largest = labels.instance.max(largest);
        if labels.is_thing {
            things.entry(labels.class).or_insert_with(BTreeSet::new).insert(labels.instance);
        }
    }
    (things, largest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use systems::Simulation;
    use systems::assets::{Library, shapes};
    use systems::run::registry::register_all;
    use systems::sensors::{CameraSensor, LidarSensor};

    #[test]
    fn what_16_bits_may_not_hold_is_told_of_the_scene() {
        let camera = Sensor::camera(CameraSensor::default().with(CameraOutput::Panoptic));
        let chosen =
            BTreeMap::from([("eye".to_owned(), camera), ("top".to_owned(), Sensor::lidar(LidarSensor::default()))]);
        let told = |things: usize, first: usize, formats: &[FileFormat]| {
            let mut simulation = Simulation::new();
            simulation.world.insert_resource(Classes::cityscapes());
            let mesh = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(glam::Vec3::ONE));
            (0..first).for_each(|_| _ = simulation.world.spawn_empty());
            let car = simulation.world.resource::<Classes>().find("car").expect("a class");
            (0..things).for_each(|_| _ = simulation.world.spawn((mesh, car)));
            register_all(&mut simulation.world);
            warnings(&mut simulation.world, &chosen, formats)
        };
        assert_eq!(told(1000, 0, &[FileFormat::NPY, FileFormat::KITTI]), [""; 0]);
        let found = told(1001, 0, &[FileFormat::PNG]);
        assert!(found.len() == 1 && found[0].contains("1001 things of class \"car\"; where"), "{found:?}");
        assert!(!found[0].contains("65535"));
        // The numbers of a car are 26,000 and on: the last of 39,537 would be 65,536.
        let ends = |things| told(things, 0, &[FileFormat::PNG])[0].contains("beyond 65535");
        assert_eq!([39_536, 39_537].map(ends), [false, true]);
        let found = told(1, 65_536, &[FileFormat::KITTI]);
        assert!(found.len() == 1 && found[0].starts_with("sensor \"top\": kitti: numbers of things go"), "{found:?}");
    }
}
