//! Rays through trees against every triangle tested one by one in double precision.

use super::Scene;
use crate::common::prelude::*;
use glam::DMat4;
use proptest::prelude::*;

/// Triangle of a world: corners in world space, whether both sides are met, and its entity.
struct Placed {
    corners: [DVec3; 3],
    double_sided: bool,
    entity: u32,
}

/// Möller and Trumbore's test. `None` where the ray is near an edge of what it may meet first, or two are equally near:
/// there either answer is right.
fn nearest(triangles: &[Placed], origin: DVec3, direction: DVec3, far: f64) -> Option<Option<(f64, u32)>> {
    let (mut met, mut doubtful) = (Vec::new(), Vec::new());
    for Placed { corners: [a, b, c], double_sided, entity } in triangles {
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        let from = origin - a;
        let (u, v) = (from.dot(across) / determinant, direction.dot(from.cross(ab)) / determinant);
        let t = ac.dot(from.cross(ab)) / determinant;
        // Of a triangle as large as a metre and seen from 100: floats are 1e-5 apart there.
        let inside = u.min(v).min(1.0 - u - v);
        let is_edge_on = (determinant / (ab.cross(ac).length())).abs() < 1e-3;
        if inside < -1e-2 || t < -1e-2 || t > far + 1e-2 || !inside.is_finite() && !is_edge_on {
            continue;
        }
        let is_front = ab.cross(ac).dot(direction) < 0.0;
        if inside < 1e-2 || is_edge_on || t < 1e-2 || t > far - 1e-2 {
            doubtful.push(t);
        } else if *double_sided || is_front {
            met.push((t, *entity));
        }
    }
    met.sort_by(|a, b| a.0.total_cmp(&b.0));
    let first = met.first().copied();
    let before = first.map_or(f64::INFINITY, |(t, _)| t + 1e-2);
    let is_doubtful =
        doubtful.iter().any(|&t| t < before || t.is_nan()) || met.get(1).is_some_and(|(t, _)| *t < before);
    (!is_doubtful).then_some(first)
}

fn point(size: f32) -> impl Strategy<Value = Vec3> {
    [-1.0f32..1.0, -1.0..1.0, -1.0..1.0].prop_map(move |p| Vec3::from_array(p) * size)
}

/// Strategy for objects: triangles, transform, and whether both sides are met. Some are mirrored, and of uneven scale.
fn object() -> impl Strategy<Value = (Vec<[Vec3; 3]>, Transform, bool)> {
    let triangle = (point(10.0), point(2.0), point(2.0)).prop_map(|(a, b, c)| [a, a + b, a + c]);
    let scale = [0.2f32..3.0, 0.2..3.0, 0.2..3.0];
    let place = (point(30.0), point(3.0), scale, any::<[bool; 3]>()).prop_map(|(at, angles, scale, mirrored)| {
        let sign = Vec3::from_array(mirrored.map(|mirrored| if mirrored { -1.0 } else { 1.0 }));
        let rotation = Quat::from_euler(EulerRot::XYZ, angles.x, angles.y, angles.z);
        Transform { translation: at, rotation, scale: Vec3::from_array(scale) * sign }
    });
    (prop::collection::vec(triangle, 1..400), place, any::<bool>())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn rays_meet_what_every_triangle_tested_one_by_one_meets(
        objects in prop::collection::vec(object(), 1..10),
        rays in prop::collection::vec((point(40.0), point(1.0)), 100),
        far_away in any::<bool>(),
    ) {
        let center = if far_away { Vec3::new(8192.0, -4096.0, 16_384.0) } else { Vec3::ZERO };
        let mut scene = Scene::new();
        let mut triangles = Vec::new();
        for (corners, mut place, double_sided) in objects {
            place.translation += center;
            let mesh = Mesh {
                name: "soup".into(),
                positions: corners.concat(),
                normals: vec![Vec3::Y; corners.len() * 3],
                indices: (0..corners.len() as u32 * 3).collect(),
                ..Mesh::default()
            };
            let material = scene.material(Material { double_sided, ..Material::default() });
            let entity = scene.add(mesh, material, place).index_u32();
            // Floats, as the world has them.
            let world_from_object = DMat4::from_cols_array(&place.to_matrix().to_cols_array().map(f64::from));
            let mirrored = place.scale.x * place.scale.y * place.scale.z < 0.0;
            triangles.extend(corners.iter().map(|corners| {
                let [a, b, c] = corners.map(|corner| world_from_object.transform_point3(corner.as_dvec3()));
                Placed { corners: if mirrored { [a, c, b] } else { [a, b, c] }, double_sided, entity }
            }));
        }
        let scene = scene.rays();
        let mut compared = 0;
        for (origin, direction) in rays {
            let Some(direction) = direction.as_dvec3().try_normalize() else { continue };
            let origin = origin.as_dvec3() + center.as_dvec3();
            let Some(expected) = nearest(&triangles, origin, direction, 150.0) else { continue };
            compared += 1;
            let found = scene.nearest(origin, direction, 0.0, 150.0);
            prop_assert_eq!(found.map(|met| met.entity), expected.map(|(_, entity)| entity));
            if let (Some(found), Some((t, _))) = (found, expected) {
                // Both in double precision, of the same floats; a triangle seen from the side multiplies by up to 1e3.
                prop_assert!((found.range - t).abs() < 1e-9 * (1.0 + t), "{} instead of {}", found.range, t);
            }
        }
        prop_assert!(compared > 30, "{} rays compared", compared);
    }
}
