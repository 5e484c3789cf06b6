//! Boxes as a file of numpy: a structured array, a record for each. What is not known is NaN.

use crate::export::array::Column;
use crate::export::npy;
use crate::sense::captures::boxes::ObjectBox;
use std::io::Result;

/// The file.
///
/// # Errors
/// None that are known.
pub fn encode(boxes: &[ObjectBox]) -> Result<Vec<u8>> {
    let id = each(boxes, |one| one.id);
    let class = each(boxes, |one| one.class);
    let box_visible = parts(boxes, |one| one.box_visible);
    let box_full = parts(boxes, |one| one.box_full);
    let visible = each(boxes, |one| one.visible);
    let truncated = each(boxes, |one| one.truncated.unwrap_or(f32::NAN));
    let pixels = each(boxes, |one| one.pixels);
    let center = parts(boxes, |one| one.center);
    let size = parts(boxes, |one| one.size);
    let quaternion = parts(boxes, |one| one.quaternion);
    let world_center = parts(boxes, |one| one.world_center);
    let world_quaternion = parts(boxes, |one| one.world_quaternion);
    let velocity = parts(boxes, |one| one.motion.map_or([f32::NAN; 3], |motion| motion.velocity));
    let yaw_rate = each(boxes, |one| one.motion.map_or(f32::NAN, |motion| motion.yaw_rate));
    let corners_uv = parts(boxes, |one| one.corners_uv.map(|corner| corner.unwrap_or([f32::NAN; 2])));
    let corners_uv = corners_uv.as_flattened();
    let columns = [
        Column::new("id", &[], &id[..]),
        Column::new("class", &[], &class[..]),
        Column::new("box_visible", &[4], &box_visible[..]),
        Column::new("box_full", &[4], &box_full[..]),
        Column::new("visible", &[], &visible[..]),
        Column::new("truncated", &[], &truncated[..]),
        Column::new("pixels", &[], &pixels[..]),
        Column::new("center", &[3], &center[..]),
        Column::new("size", &[3], &size[..]),
        Column::new("quaternion", &[4], &quaternion[..]),
        Column::new("world_center", &[3], &world_center[..]),
        Column::new("world_quaternion", &[4], &world_quaternion[..]),
        Column::new("velocity", &[3], &velocity[..]),
        Column::new("yaw_rate", &[], &yaw_rate[..]),
        Column::new("corners_uv", &[8, 2], corners_uv),
    ];
    npy::encode_records(boxes.len(), &columns)
}

fn each<T>(boxes: &[ObjectBox], of: impl Fn(&ObjectBox) -> T) -> Vec<T> {
    boxes.iter().map(of).collect()
}

fn parts<T, const N: usize>(boxes: &[ObjectBox], of: impl Fn(&ObjectBox) -> [T; N]) -> Vec<T> {
    boxes.iter().flat_map(of).collect()
}
