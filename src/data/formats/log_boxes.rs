//! Boxes of a camera as messages of a log: in its picture, and in the world of ROS.

use crate::export::ros::{BoxInPicture, BoxInSpace};
use crate::sense::captures::axes::ROS_FROM_WORLD;
use crate::sense::captures::boxes::ObjectBox;
use glam::{DMat3, DQuat, DVec3};
use systems::sensors::{Class, ClassInfo, Classes};

/// Opacity of a box in space.
const ALPHA: f64 = 0.4;

/// Names of boxes, which messages borrow: class and number.
pub(super) fn names(boxes: &[ObjectBox], classes: &Classes) -> Vec<String> {
    boxes.iter().map(|one| format!("{} {}", class_name(one, classes), one.id)).collect()
}

/// Those of things of which something is seen, around that.
pub(super) fn in_picture<'a>(boxes: &[ObjectBox], names: &'a [String], classes: &Classes) -> Vec<BoxInPicture<'a>> {
    let named = boxes.iter().zip(names).filter(|(one, _)| one.pixels > 0);
    let shown = |(one, name): (&ObjectBox, &'a String)| BoxInPicture {
        edges: one.box_visible.map(f64::from),
        color: color(one, classes, 1.0),
        label: name,
    };
    named.map(shown).collect()
}

/// All of them, hidden or not.
pub(super) fn in_space<'a>(boxes: &[ObjectBox], classes: &'a Classes) -> Vec<BoxInSpace<'a>> {
    let placed = |one: &ObjectBox| {
        let [w, x, y, z] = one.world_quaternion;
        let axes = ROS_FROM_WORLD * DMat3::from_quat(DQuat::from_xyzw(x, y, z, w));
        let [length, width, height] = one.size.map(f64::from);
        BoxInSpace {
            id: one.id,
            class: class_name(one, classes),
            center: (ROS_FROM_WORLD * DVec3::from(one.world_center)).to_array(),
            rotation: DQuat::from_mat3(&axes).normalize().to_array(),
            size: [width, height, length],
            color: color(one, classes, ALPHA),
        }
    };
    boxes.iter().map(placed).collect()
}

fn class_of<'a>(one: &ObjectBox, classes: &'a Classes) -> Option<&'a ClassInfo> {
    classes.get(Class(one.class))
}

fn class_name<'a>(one: &ObjectBox, classes: &'a Classes) -> &'a str {
    class_of(one, classes).map_or("unlabeled", |class| &class.name)
}

fn color(one: &ObjectBox, classes: &Classes, alpha: f64) -> [f64; 4] {
    let [r, g, b] = class_of(one, classes).map_or([0; 3], |class| class.color).map(|byte| f64::from(byte) / 255.0);
    [r, g, b, alpha]
}
