//! The order in which objects are searched: along a curve, so that neighbours in it are near each other.

use crate::bounds::Sphere;
use crate::light_tree::morton;

/// The spheres in the order of their places on the Morton curve.
pub fn along_the_curve(spheres: &[Sphere]) -> Vec<Sphere> {
    let mut keys: Vec<(u64, u32)> = spheres.iter().map(|sphere| morton(sphere.center)).zip(0..).collect();
    radsort::sort_by_key(&mut keys, |&(key, _)| key);
    keys.into_iter().map(|(_, index)| spheres[index as usize]).collect()
}
