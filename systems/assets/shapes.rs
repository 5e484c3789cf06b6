//! Procedural meshes with normals and texture coordinates.
//!
//! All are centred on the origin, with counter-clockwise front faces and UVs as in glTF: origin at the top left, V down
//! the image. No UV is mirrored, so every tangent frame has handedness w = +1, and on side faces the image stands
//! upright (its up is +Y). Each is made of patches: a grid of quads with a function from UV to position and normal.
//!
//! Sizes are metres. Too small a count is raised to the least that makes the shape.

use super::mesh::Mesh;
use glam::{UVec2, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// A rectangle of `size` in the XZ plane with normal +Y, cut into `segments` quads along X and Z. Seen from above with
/// −Z up, the image is upright.
pub fn plane(size: Vec2, segments: UVec2) -> Mesh {
    let mut mesh = named("plane");
    add_grid(&mut mesh, segments.max(UVec2::ONE), |uv| {
        let at = (uv - 0.5) * size;
        (Vec3::new(at.x, 0.0, at.y), Vec3::Y, uv)
    });
    mesh
}

/// A box of `size`; each of its six faces shows the whole image. 24 vertices.
pub fn cube(size: Vec3) -> Mesh {
    let mut mesh = named("cube");
    let faces = [
        (Vec3::Z, Vec3::X),
        (Vec3::X, Vec3::NEG_Z),
        (Vec3::NEG_Z, Vec3::NEG_X),
        (Vec3::NEG_X, Vec3::Z),
        (Vec3::Y, Vec3::X),
        (Vec3::NEG_Y, Vec3::X),
    ];
    for (normal, right) in faces {
        let up = normal.cross(right);
        add_grid(&mut mesh, UVec2::ONE, |uv| {
            let at = normal * 0.5 + right * (uv.x - 0.5) - up * (uv.y - 0.5);
            (at * size, normal, uv)
        });
    }
    mesh
}

/// A sphere of `segments` around its Y axis (at least 3) and `rings` from pole to pole (at least 2). The image wraps
/// once around, its middle towards +Z, its seam at −Z.
pub fn sphere(radius: f32, segments: u32, rings: u32) -> Mesh {
    let mut mesh = named("sphere");
    let counts = UVec2::new(segments.max(3), rings.max(2));
    add_grid(&mut mesh, counts, |uv| {
        let polar = uv.y * PI;
        // Exactly on the axis at the poles: sin(π) is not quite 0 in f32.
        let ring = if uv.y == 0.0 || uv.y == 1.0 { 0.0 } else { polar.sin() };
        let normal = around_y(uv.x) * ring + Vec3::Y * polar.cos();
        (normal * radius, normal, uv)
    });
    // At a pole a quad is a triangle: of its two, the one with both pole corners has no area.
    let (top, bottom) = (counts.x as usize, (counts.x * (counts.y - 1)) as usize);
    let mut triangles = Vec::with_capacity(mesh.indices.len());
    for (quad, corners) in mesh.indices.chunks_exact(6).enumerate() {
        if quad >= top {
            triangles.extend_from_slice(&corners[3..]);
        }
        if quad < bottom {
            triangles.extend_from_slice(&corners[..3]);
        }
    }
    mesh.indices = triangles;
    // Each pole vertex serves one triangle (the first at the top and the last at the bottom none): half a column over,
    // its image is not sheared.
    let row = counts.x as usize + 1;
    let (last, half) = (mesh.positions.len() - row, 0.5 / counts.x as f32);
    for column in 0..row {
        mesh.uvs[0][column].x -= half;
        mesh.uvs[0][last + column].x += half;
    }
    mesh
}

/// A torus around the Y axis: `major` from the axis to the middle of the tube, `minor` the tube's radius; `segments`
/// around the axis, `sides` around the tube (at least 3 each). The image wraps once both ways; its middle is on the
/// outside towards +Z.
pub fn torus(major: f32, minor: f32, segments: u32, sides: u32) -> Mesh {
    let mut mesh = named("torus");
    add_grid(&mut mesh, UVec2::new(segments.max(3), sides.max(3)), |uv| {
        // As around the axis: both ends of the turn are the same.
        let turn = if uv.y >= 1.0 { 0.0 } else { uv.y };
        let (sin, cos) = (PI - turn * TAU).sin_cos();
        let outward = around_y(uv.x);
        let normal = outward * cos + Vec3::Y * sin;
        (outward * major + normal * minor, normal, uv)
    });
    mesh
}

/// A cylinder around the Y axis with both caps, of `segments` (at least 3). The image wraps once around the side; each
/// cap shows the disc within it.
pub fn cylinder(radius: f32, height: f32, segments: u32) -> Mesh {
    let mut mesh = named("cylinder");
    let segments = segments.max(3);
    add_grid(&mut mesh, UVec2::new(segments, 1), |uv| {
        let normal = around_y(uv.x);
        (normal * radius + Vec3::Y * (height * (0.5 - uv.y)), normal, uv)
    });
    for normal in [Vec3::Y, Vec3::NEG_Y] {
        let center = mesh.positions.len() as u32;
        let up = normal.cross(Vec3::X);
        let mut vertex = |at: Vec3| {
            mesh.positions.push(at * radius + normal * (height * 0.5));
            mesh.normals.push(normal);
            mesh.uvs[0].push(Vec2::new(at.x, -at.dot(up)) * 0.5 + 0.5);
        };
        vertex(Vec3::ZERO);
        (0..segments).for_each(|i| vertex(around_y(i as f32 / segments as f32)));
        for i in 0..segments {
            let (here, next) = (center + 1 + i, center + 1 + (i + 1) % segments);
            let (a, b) = if normal.y > 0.0 { (here, next) } else { (next, here) };
            mesh.indices.extend([center, a, b]);
        }
    }
    mesh
}

/// The mesh with its first UV set multiplied: how often the image repeats along U and V.
pub fn with_uv_scale(mut mesh: Mesh, scale: Vec2) -> Mesh {
    mesh.uvs[0].iter_mut().for_each(|uv| *uv *= scale);
    mesh
}

/// A [`plane`] or [`cube`] with its image repeated every `metres`, undistorted on every face whatever its size.
pub fn tiled(mut mesh: Mesh, metres: f32) -> Mesh {
    let bounds = mesh.aabb();
    let size = bounds.max - bounds.min;
    for (uv, normal) in mesh.uvs[0].iter_mut().zip(&mesh.normals) {
        *uv *= match normal.abs().max_position() {
            0 => Vec2::new(size.z, size.y),
            1 => Vec2::new(size.x, size.z),
            _ => Vec2::new(size.x, size.y),
        } / metres;
    }
    mesh
}

fn named(name: &str) -> Mesh {
    Mesh { name: name.into(), ..Mesh::default() }
}

/// The horizontal unit vector at `u` turns around Y: +Z in the middle (0.5), and to the right of it as seen from
/// outside for larger `u`. Both ends of the turn are the same to the last bit, so that seams are closed.
fn around_y(u: f32) -> Vec3 {
    let turn = if u >= 1.0 { 0.0 } else { u };
    let (sin, cos) = (turn * TAU - PI).sin_cos();
    Vec3::new(sin, 0.0, cos)
}

/// Adds a patch of `counts` quads, each two triangles that share the diagonal from bottom left to top right; `vertex`
/// gives position, normal and UV for UV 0..1 over the patch.
fn add_grid(mesh: &mut Mesh, counts: UVec2, vertex: impl Fn(Vec2) -> (Vec3, Vec3, Vec2)) {
    let first = mesh.positions.len() as u32;
    for row in 0..=counts.y {
        for column in 0..=counts.x {
            let (position, normal, uv) = vertex(Vec2::new(column as f32, row as f32) / counts.as_vec2());
            mesh.positions.push(position);
            mesh.normals.push(normal);
            mesh.uvs[0].push(uv);
        }
    }
    for row in 0..counts.y {
        for column in 0..counts.x {
            let top_left = first + row * (counts.x + 1) + column;
            let (top_right, bottom_left) = (top_left + 1, top_left + counts.x + 1);
            let bottom_right = bottom_left + 1;
            mesh.indices.extend([bottom_left, bottom_right, top_right, bottom_left, top_right, top_left]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn all() -> Vec<Mesh> {
        vec![
            plane(Vec2::new(3.0, 2.0), UVec2::new(4, 3)),
            cube(Vec3::new(1.0, 2.0, 3.0)),
            sphere(1.5, 12, 7),
            torus(2.0, 0.5, 12, 7),
            cylinder(0.5, 2.0, 9),
        ]
    }

    fn triangles(mesh: &Mesh) -> impl Iterator<Item = [usize; 3]> {
        mesh.indices.chunks_exact(3).map(|t| [t[0] as usize, t[1] as usize, t[2] as usize])
    }

    #[test]
    fn triangles_face_out_and_have_area() {
        for mesh in all() {
            for [a, b, c] in triangles(&mesh) {
                let p = &mesh.positions;
                let face = (p[b] - p[a]).cross(p[c] - p[a]);
                assert!(face.length() > 1e-4, "{}: a triangle without area", mesh.name);
                for vertex in [a, b, c] {
                    assert!(face.normalize().dot(mesh.normals[vertex]) > 0.3, "{}: faces in", mesh.name);
                    assert!((mesh.normals[vertex].length() - 1.0).abs() < 1e-5, "{}: normal length", mesh.name);
                }
            }
        }
    }

    /// The tangent frame of each triangle as MikkTSpace would find it: B = cross(N, T) must point up the image.
    #[test]
    fn uvs_are_not_mirrored_and_stand_upright_on_sides() {
        for mesh in all() {
            for [a, b, c] in triangles(&mesh) {
                let (p, uv) = (&mesh.positions, &mesh.uvs[0]);
                let (e1, e2, d1, d2) = (p[b] - p[a], p[c] - p[a], uv[b] - uv[a], uv[c] - uv[a]);
                let determinant = d1.perp_dot(d2);
                assert!(determinant.abs() > 1e-6, "{}: a triangle without UV area", mesh.name);
                let tangent = (e1 * d2.y - e2 * d1.y) / determinant;
                let image_up = -(e2 * d1.x - e1 * d2.x) / determinant;
                let normal = e1.cross(e2);
                assert!(normal.cross(tangent).dot(image_up) > 0.0, "{}: mirrored", mesh.name);
                let n = normal.normalize();
                let outside = mesh.name != "torus" || n.dot(Vec3::new(p[a].x, 0.0, p[a].z)) > 0.0;
                if n.y.abs() < 0.5 && outside {
                    assert!(image_up.normalize().y > 0.5, "{}: upside down", mesh.name);
                }
            }
        }
    }

    #[test]
    fn closed_shapes_have_each_edge_twice_in_opposite_directions() {
        for mesh in all().into_iter().skip(1) {
            let key = |i: usize| (mesh.positions[i] * 1e4).round().as_ivec3();
            let mut edges: HashMap<_, i32> = HashMap::new();
            for [a, b, c] in triangles(&mesh) {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    *edges.entry((key(from), key(to))).or_default() += 1;
                    *edges.entry((key(to), key(from))).or_default() -= 1;
                }
            }
            assert!(edges.values().all(|&n| n == 0), "{} is open", mesh.name);
        }
    }

    #[test]
    fn sizes_and_counts_are_as_asked() {
        let [plane, cube, sphere, torus, cylinder] = all().try_into().expect("five shapes");
        let size = |m: &Mesh| m.aabb().max - m.aabb().min;
        assert_eq!((size(&plane), plane.triangle_count()), (Vec3::new(3.0, 0.0, 2.0), 24));
        assert_eq!((size(&cube), cube.positions.len()), (Vec3::new(1.0, 2.0, 3.0), 24));
        assert_eq!((size(&sphere).y, sphere.triangle_count()), (3.0, 12 * 7 * 2 - 24));
        assert!((size(&torus) - Vec3::new(5.0, 0.95, 5.0)).abs().max_element() < 0.2);
        assert_eq!((size(&cylinder).y, cylinder.triangle_count()), (2.0, 9 * 4));
    }

    #[test]
    fn counts_too_small_are_raised() {
        assert_eq!(plane(Vec2::ONE, UVec2::ZERO).triangle_count(), 2);
        assert_eq!(sphere(1.0, 0, 0).triangle_count(), 6);
        assert_eq!(torus(1.0, 0.2, 0, 0).triangle_count(), 18);
        assert_eq!(cylinder(1.0, 1.0, 0).triangle_count(), 12);
    }

    #[test]
    fn the_image_is_not_sheared_at_the_poles() {
        let mesh = sphere(1.0, 8, 4);
        let at_pole = |i: usize| mesh.normals[i].y.abs() > 0.999;
        let mut poles = 0;
        for corners in triangles(&mesh) {
            let Some(&pole) = corners.iter().find(|&&i| at_pole(i)) else { continue };
            let across: f32 = corners.iter().filter(|&&i| i != pole).map(|&i| mesh.uvs[0][i].x).sum();
            assert!((mesh.uvs[0][pole].x - across / 2.0).abs() < 1e-6);
            poles += 1;
        }
        assert_eq!(poles, 16);
    }

    #[test]
    fn tiles_have_the_same_size_on_every_face() {
        let mesh = tiled(cube(Vec3::new(4.0, 2.0, 1.0)), 2.0);
        for [a, b, c] in triangles(&mesh) {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let uv_length = mesh.uvs[0][from].distance(mesh.uvs[0][to]);
                assert!((mesh.positions[from].distance(mesh.positions[to]) - 2.0 * uv_length).abs() < 1e-5);
            }
        }
        let repeated = with_uv_scale(cube(Vec3::ONE), Vec2::new(3.0, 2.0));
        assert_eq!(repeated.uvs[0].iter().copied().reduce(Vec2::max), Some(Vec2::new(3.0, 2.0)));
    }
}
