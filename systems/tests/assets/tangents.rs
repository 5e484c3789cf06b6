//! Tangents against the output of the reference MikkTSpace, and on meshes that it has no answer for.

use super::*;
use bevy_ecs::change_detection::DetectChanges;
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use systems::assets::tangents::TangentReport;

/// `RELIEF_TEST_DATA`, or `shared/data` beside the project; `None`, said aloud, where there is none.
fn test_data() -> Option<PathBuf> {
    let folder = std::env::var_os("RELIEF_TEST_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("RELIEF_STRICT").is_none_or(|v| v == "0"), "no test data at {}", folder.display());
    // Not by a macro: what these print is shown of failed tests alone.
    let _ = writeln!(std::io::stderr(), "skipped: no test data at {}", folder.display());
    None
}

/// A mesh and the tangent expected at each corner.
struct Truth {
    mesh: Mesh,
    expected: Vec<Vec4>,
}

/// Rows `position normal uv tangent` of 12 little-endian f32.
fn read_npy(path: &Path) -> Truth {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00", "{}", path.display());
    let header = 10 + u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
    let text = String::from_utf8_lossy(&bytes[10..header]);
    assert!(text.contains("'<f4'") && text.contains("'fortran_order': False") && text.contains(", 12)"), "{text}");
    let floats: Vec<f32> = bytes[header..].as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let mut mesh = Mesh::default();
    let mut expected = Vec::new();
    for row in floats.as_chunks::<12>().0 {
        mesh.indices.push(mesh.positions.len() as u32);
        mesh.positions.push(Vec3::from_slice(&row[0..]));
        mesh.normals.push(Vec3::from_slice(&row[3..]));
        mesh.uvs[0].push(Vec2::from_slice(&row[6..]));
        expected.push(Vec4::from_slice(&row[8..]));
    }
    Truth { mesh, expected }
}

fn rows<const N: usize>(value: &Value) -> Vec<[f32; N]> {
    let row = |row: &Value| std::array::from_fn(|i| row[i].as_f64().unwrap() as f32);
    value.as_array().unwrap().iter().map(row).collect()
}

fn read_case(case: &Value) -> Truth {
    let mesh = Mesh {
        positions: rows(&case["positions"]).into_iter().map(Vec3::from_array).collect(),
        normals: rows(&case["normals"]).into_iter().map(Vec3::from_array).collect(),
        uvs: [rows(&case["uvs"]).into_iter().map(Vec2::from_array).collect(), Vec::new()],
        indices: case["indices"].as_array().unwrap().iter().map(|i| i.as_u64().unwrap() as u32).collect(),
        ..Mesh::default()
    };
    let expected = rows(&case["expected_tangent_xyz_w_per_corner"]).into_iter().map(Vec4::from_array).collect();
    Truth { mesh, expected }
}

/// Tells if the reference defines the corner's tangent: neither positions nor UVs are degenerate.
fn is_defined(mesh: &Mesh, corner: usize, expected: Vec4) -> bool {
    let vertices = [0, 1, 2].map(|i| mesh.indices[corner / 3 * 3 + i] as usize);
    let [a, b, c] = vertices.map(|v| mesh.positions[v]);
    let [s, t, u] = vertices.map(|v| mesh.uvs[0][v]);
    a != b && b != c && c != a && (t - s).perp_dot(u - s) != 0.0 && expected.truncate().length() > 0.5
}

/// Compares every corner and returns how many the reference defines.
fn compare(name: &str, truth: Truth) -> usize {
    let mut mesh = truth.mesh.clone();
    compute_tangents(&mut mesh);
    assert_well_formed(&mesh);
    assert_same_corners(&truth.mesh, &mesh);
    let (mut defined, mut off) = (0, 0);
    for (corner, &expected) in truth.expected.iter().enumerate() {
        if !is_defined(&truth.mesh, corner, expected) {
            continue;
        }
        let tangent = mesh.tangents[mesh.indices[corner] as usize];
        assert_eq!(tangent.w, expected.w, "{name}: sign of corner {corner}");
        defined += 1;
        off += usize::from(tangent.truncate().angle_between(expected.truncate()).to_degrees() > 0.1);
    }
    assert_eq!(off, 0, "{name}: of {defined} corners so many are off by more than 0.1°");
    defined
}

/// Finite, unit, across the normal, a sign; all arrays of one length and all indices valid.
fn assert_well_formed(mesh: &Mesh) {
    let count = mesh.positions.len();
    assert_eq!((mesh.normals.len(), mesh.tangents.len()), (count, count));
    assert!([mesh.uvs[0].len(), mesh.uvs[1].len(), mesh.colors.len()].iter().all(|&len| len == 0 || len == count));
    assert!(mesh.indices.len().is_multiple_of(3) && mesh.indices.iter().all(|&i| (i as usize) < count));
    for (tangent, normal) in mesh.tangents.iter().zip(&mesh.normals) {
        assert!((tangent.truncate().length() - 1.0).abs() < 1e-3, "{tangent}");
        assert!(tangent.w == 1.0 || tangent.w == -1.0, "{tangent}");
        assert!(normal.normalize().cross(tangent.truncate()).length() > 1e-3, "{tangent} along {normal}");
    }
}

/// Each corner has the attributes that it had.
fn assert_same_corners(before: &Mesh, after: &Mesh) {
    assert_eq!(before.indices.len(), after.indices.len());
    for (&old, &new) in before.indices.iter().zip(&after.indices) {
        let (old, new) = (old as usize, new as usize);
        assert_eq!(before.positions[old], after.positions[new]);
        assert_eq!(before.normals[old], after.normals[new]);
        assert_eq!(before.uvs.each_ref().map(|uvs| uvs.get(old)), after.uvs.each_ref().map(|uvs| uvs.get(new)));
        assert_eq!(before.colors.get(old), after.colors.get(new));
    }
}

/// Two quads side by side whose UVs mirror at x = 0; the vertices on the seam are shared.
fn mirrored_quads() -> Mesh {
    let xs = [-1.0, 0.0, 1.0];
    Mesh {
        positions: xs.into_iter().flat_map(|x| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0)]).collect(),
        normals: vec![Vec3::Z; 6],
        uvs: [xs.into_iter().flat_map(|x| [Vec2::new(x.abs(), 1.0), Vec2::new(x.abs(), 0.0)]).collect(), Vec::new()],
        colors: (0..6).map(|i| Vec4::splat(i as f32)).collect(),
        indices: vec![0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5],
        ..Mesh::default()
    }
}

#[test]
fn models_equal_the_reference() {
    let Some(data) = test_data() else { return };
    let mut compared = 0;
    for model in ["BoxTextured", "ClearCoatTest", "DamagedHelmet", "Duck", "NormalTangentTest", "Suzanne"] {
        let folder = data.join("tangents").join(model);
        for entry in std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.extension().is_some_and(|extension| extension == "npy") {
                compared += compare(&entry.display().to_string(), read_npy(&entry));
            }
        }
    }
    assert!(compared > 100_000, "only {compared} corners were compared");
}

#[test]
fn awkward_cases_equal_the_reference() {
    let Some(data) = test_data() else { return };
    let text = std::fs::read_to_string(data.join("tangents/handmade.json")).unwrap();
    let cases: Value = serde_json::from_str(&text).unwrap();
    let mut compared = 0;
    for case in cases["cases"].as_array().unwrap() {
        compared += compare(case["name"].as_str().unwrap(), read_case(case));
    }
    assert!(compared > 1_000, "only {compared} corners were compared");
}

#[test]
fn corners_of_degenerate_triangles_take_their_neighbours_tangent() {
    let mut mesh = mirrored_quads();
    mesh.indices.truncate(6);
    mesh.indices.extend([0, 1, 1]);
    assert_eq!(compute_tangents(&mut mesh).fallbacks, 0);
    let at = |corner: usize| mesh.tangents[mesh.indices[corner] as usize];
    assert_eq!([at(6), at(7), at(8)], [at(0); 3]);
}

#[test]
fn a_mirror_seam_splits_its_vertices_and_all_attributes_follow() {
    let before = mirrored_quads();
    let mut mesh = before.clone();
    assert_eq!(compute_tangents(&mut mesh), TangentReport { supplied: false, fallbacks: 0 });
    assert_well_formed(&mesh);
    assert_same_corners(&before, &mesh);
    assert_eq!(mesh.positions.len(), 8);
    let at = |corner: usize| mesh.tangents[mesh.indices[corner] as usize];
    // U grows away from the seam and image-up is +Y on both sides.
    assert!((0..6).all(|corner| at(corner) == Vec4::new(-1.0, 0.0, 0.0, -1.0)));
    assert!((6..12).all(|corner| at(corner) == Vec4::new(1.0, 0.0, 0.0, 1.0)));
}

#[test]
fn equal_corners_share_a_vertex() {
    let shared = mirrored_quads();
    let mut soup = Mesh { indices: (0..12).collect(), ..Mesh::default() };
    for &index in &shared.indices {
        let index = index as usize;
        soup.positions.push(shared.positions[index]);
        soup.normals.push(shared.normals[index]);
        soup.uvs[0].push(shared.uvs[0][index]);
        soup.colors.push(shared.colors[index]);
    }
    let (mut a, mut b) = (shared, soup);
    compute_tangents(&mut a);
    compute_tangents(&mut b);
    assert_eq!(a.indices, b.indices);
    assert_eq!((a.positions, a.colors, a.tangents), (b.positions, b.colors, b.tangents));
}

#[test]
fn computing_again_changes_nothing() {
    let mut once = mirrored_quads();
    compute_tangents(&mut once);
    let mut twice = once.clone();
    assert_eq!(compute_tangents(&mut twice), TangentReport { supplied: true, fallbacks: 0 });
    assert_eq!((once.indices, once.positions, once.tangents), (twice.indices, twice.positions, twice.tangents));
}

#[test]
fn supplied_tangents_stay_unless_no_frame_can_be_made_of_them() {
    let supplied = Vec4::new(0.6, 0.8, 0.0, -1.0);
    let mut mesh = mirrored_quads();
    mesh.tangents = vec![
        supplied,
        Vec4::NAN,
        Vec4::ZERO,
        Vec4::new(0.0, 0.0, 1.0, 1.0),
        Vec4::new(1.0, 0.0, 0.0, 0.0),
        Vec4::INFINITY,
    ];
    assert_eq!(compute_tangents(&mut mesh), TangentReport { supplied: true, fallbacks: 5 });
    assert_well_formed(&mesh);
    assert_eq!(mesh.tangents[0], supplied);
}

#[test]
fn without_uvs_every_vertex_has_a_frame_and_keeps_its_place() {
    let normals: Vec<Vec3> = (0..300)
        .map(|i| Vec3::new((i as f32 * 0.7).sin(), (i as f32 * 1.3).cos(), (i as f32 * 2.1).sin()).normalize())
        .chain([Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z])
        .collect();
    let before =
        Mesh { positions: normals.clone(), indices: (0..normals.len() as u32).collect(), normals, ..Mesh::default() };
    let mut mesh = before.clone();
    assert_eq!(compute_tangents(&mut mesh).fallbacks, before.positions.len());
    assert_well_formed(&mesh);
    assert_eq!((mesh.indices, mesh.positions), (before.indices, before.positions));
    for (tangent, normal) in mesh.tangents.iter().zip(&mesh.normals) {
        assert!(tangent.truncate().dot(*normal).abs() < 1e-6 && tangent.w == 1.0);
    }
}

#[test]
fn normals_without_a_direction_come_from_the_faces() {
    let mut mesh = mirrored_quads();
    mesh.normals = vec![Vec3::ZERO, Vec3::NAN, Vec3::X, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO];
    mesh.indices.truncate(6);
    compute_tangents(&mut mesh);
    assert_well_formed(&mesh);
    assert!(mesh.normals.iter().all(|&n| n == Vec3::Z || n == Vec3::X));
    let mut lone = Mesh { positions: vec![Vec3::ONE], ..Mesh::default() };
    compute_tangents(&mut lone);
    assert_eq!(lone.normals, [Vec3::Y]);
    assert_well_formed(&lone);
}

/// A fan around one vertex would take MikkTSpace quadratic time, and stack without end.
#[test]
fn a_fan_of_a_hundred_thousand_triangles_is_done_at_once() {
    let rim = 100_000;
    let angle = |i: u32| i as f32 / rim as f32 * std::f32::consts::TAU;
    let positions: Vec<Vec3> =
        (0..rim).map(|i| Vec3::new(angle(i).cos(), angle(i).sin(), 0.0)).chain([Vec3::ZERO]).collect();
    let mut mesh = Mesh {
        normals: vec![Vec3::Z; positions.len()],
        uvs: [positions.iter().map(|p| p.truncate()).collect(), Vec::new()],
        indices: (0..rim).flat_map(|i| [rim, i, (i + 1) % rim]).collect(),
        positions,
        ..Mesh::default()
    };
    compute_tangents(&mut mesh);
    assert_well_formed(&mesh);
}

#[test]
fn pending_meshes_are_computed_once() {
    let mut simulation = Simulation::new();
    let first = simulation.world.resource_mut::<Library>().add_mesh(mirrored_quads());
    let second = simulation.world.resource_mut::<Library>().add_mesh(mirrored_quads());
    simulation.frame();
    for mesh in [first, second] {
        let entry = simulation.library().mesh(mesh).unwrap();
        assert!(entry.tangents_ready);
        assert_eq!(entry.mesh.tangents.len(), 8);
    }
    simulation.frame();
    let before = simulation.world.resource_ref::<Library>().last_changed();
    simulation.frame();
    assert_eq!(simulation.world.resource_ref::<Library>().last_changed(), before, "a still library was touched");
}

fn any_float() -> impl Strategy<Value = f32> {
    prop_oneof![8 => -2.0f32..2.0, 4 => prop::sample::select(vec![0.0, 1.0, -1.0]),
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, -0.0, 1e-40, 1e30, f32::MAX])]
}

prop_compose! {
    /// Few vertices, many triangles between them: non-manifold, degenerate, with values that are no numbers.
    fn any_mesh()(vertices in prop::collection::vec([any_float(), any_float(), any_float(), any_float(), any_float(),
        any_float(), any_float(), any_float()], 1..9), indices in prop::collection::vec(0u32..10, 0..60)) -> Mesh {
        Mesh {
            positions: vertices.iter().map(|v| Vec3::new(v[0], v[1], v[2])).collect(),
            normals: vertices.iter().map(|v| Vec3::new(v[3], v[4], v[5])).collect(),
            uvs: [vertices.iter().map(|v| Vec2::new(v[6], v[7])).collect(), Vec::new()],
            indices,
            ..Mesh::default()
        }
    }
}

proptest! {
    #[test]
    fn any_mesh_gets_frames(mut mesh in any_mesh()) {
        compute_tangents(&mut mesh);
        assert_well_formed(&mesh);
    }
}
