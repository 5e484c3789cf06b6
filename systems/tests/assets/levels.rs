//! Levels of detail of shapes, of pieces that meet, and of meshes that nothing can be made of.

use super::*;
use glam::Mat3;
use systems::assets::Level;
use systems::assets::levels::{LevelOfDetail, MOST_LEVELS, simplify};

/// A mesh with its tangents, its levels, and the triangles of each.
fn with_levels(mut mesh: Mesh) -> (Mesh, Vec<Level>, Vec<Vec<[u32; 3]>>) {
    compute_tangents(&mut mesh);
    let (levels, rest) = simplify(&mesh);
    let all: Vec<u32> = mesh.indices.iter().chain(&rest).copied().collect();
    let range = |level: &Level| level.first_index as usize..(level.first_index + level.index_count) as usize;
    let triangles = levels.iter().map(|level| all[range(level)].as_chunks::<3>().0.to_vec()).collect();
    assert_eq!(levels.iter().map(|level| level.index_count as usize).sum::<usize>(), all.len());
    (mesh, levels, triangles)
}

fn round_shapes() -> Vec<Mesh> {
    vec![shapes::sphere(1.0, 64, 32), shapes::torus(1.0, 0.3, 64, 32), shapes::cylinder(0.5, 2.0, 96)]
}

/// Hills, with hard edges nowhere.
fn hills() -> Mesh {
    let mut mesh = shapes::plane(Vec2::splat(64.0), UVec2::splat(64));
    for (position, normal) in mesh.positions.iter_mut().zip(&mut mesh.normals) {
        let at = *position * 0.3;
        position.y = at.x.sin() * at.z.cos() * 2.0;
        let slope = Vec2::new(at.x.cos() * at.z.cos(), -at.x.sin() * at.z.sin()) * 0.6;
        *normal = Vec3::new(-slope.x, 1.0, -slope.y).normalize();
    }
    mesh
}

#[test]
fn levels_halve_the_triangles_over_the_same_vertices_and_errors_grow() {
    for mesh in round_shapes().into_iter().chain([hills()]) {
        let name = mesh.name.clone();
        let (mesh, levels, triangles) = with_levels(mesh);
        assert!(levels.len() > 1 && levels.len() <= MOST_LEVELS, "{name}: {levels:?}");
        assert_eq!(levels[0], Level { first_index: 0, index_count: mesh.indices.len() as u32, error: 0.0 });
        for (pair, triangles) in levels.windows(2).zip(&triangles[1..]) {
            assert!(f64::from(pair[1].index_count) <= 0.8 * f64::from(pair[0].index_count), "{name}: {levels:?}");
            assert!(pair[1].error >= pair[0].error && pair[1].error.is_finite(), "{name}: {levels:?}");
            assert!(pair[1].index_count >= 3 * 32, "{name}: {levels:?}");
            for triangle in triangles {
                let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
                assert!((b - a).cross(c - a).length() > 0.0, "{name}: {triangle:?} has no area");
            }
        }
    }
}

/// From a point to a triangle (Ericson, Real-Time Collision Detection, 5.1.5, by its parts).
fn distance(point: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| normal.cross(to - from).dot(point - from) >= 0.0);
    if inside && normal != Vec3::ZERO {
        return (point - a).dot(normal.normalize()).abs();
    }
    let to_edge = |(from, to): (Vec3, Vec3)| {
        let along = ((point - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
        point.distance(from + (to - from) * along)
    };
    [(a, b), (b, c), (c, a)].map(to_edge).into_iter().fold(f32::INFINITY, f32::min)
}

/// The largest distance from corners, middles of edges and centres of some triangles to the nearest of others.
pub fn farthest(from: &[[Vec3; 3]], to: &[[Vec3; 3]]) -> f32 {
    let samples = |[a, b, c]: &[Vec3; 3]| [*a, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0];
    let nearest = |point| to.iter().map(|&triangle| distance(point, triangle)).fold(f32::INFINITY, f32::min);
    from.iter().flat_map(samples).map(nearest).fold(0.0, f32::max)
}

#[test]
fn a_level_is_no_further_from_the_mesh_than_its_error() {
    for mesh in [shapes::sphere(2.0, 32, 16), shapes::torus(1.0, 0.3, 32, 16), shapes::cylinder(0.5, 2.0, 96)] {
        let name = mesh.name.clone();
        let (mesh, levels, triangles) = with_levels(mesh);
        let place = |triangle: &[u32; 3]| triangle.map(|index| mesh.positions[index as usize]);
        let surfaces: Vec<Vec<[Vec3; 3]>> = triangles.iter().map(|level| level.iter().map(place).collect()).collect();
        for (level, surface) in levels.iter().zip(&surfaces).skip(1) {
            let measured = farthest(surface, &surfaces[0]).max(farthest(&surfaces[0], surface));
            assert!(measured > 0.0 && measured <= level.error, "{name}: {measured} measured, {level:?}");
        }
    }
}

/// Corners of triangles of a mesh.
fn corners<'m>(mesh: &'m Mesh, triangles: &'m [[u32; 3]]) -> impl Iterator<Item = [Vec3; 3]> {
    triangles.iter().map(|triangle| triangle.map(|index| mesh.positions[index as usize]))
}

#[test]
fn pieces_of_a_mesh_meet_at_every_pair_of_levels() {
    for mut mesh in [hills(), shapes::with_uv_scale(shapes::sphere(2.0, 96, 48), Vec2::splat(3.0))] {
        compute_tangents(&mut mesh);
        let pieces: Vec<_> = split(&mesh, Grid { counts: UVec3::new(2, 1, 2) }).into_iter().map(with_levels).collect();
        assert_eq!(pieces.len(), 4);
        assert!(pieces.iter().all(|(_, levels, _)| levels.len() > 2), "{}", mesh.name);
        let whole = open_edges(pieces.iter().flat_map(|(piece, _, triangles)| corners(piece, &triangles[0])));
        assert_eq!(whole.is_empty(), mesh.name == "sphere");
        // Every other piece as it is, those between as coarse as can be: together they gape no more than the mesh did.
        for coarse in 0..4 {
            let open = open_edges(pieces.iter().enumerate().flat_map(|(i, (piece, _, triangles))| {
                let level = if i == coarse { triangles.last() } else { triangles.first() };
                corners(piece, level.unwrap())
            }));
            assert!(open == whole, "{}: piece {coarse} gapes", mesh.name);
        }
        for (piece, levels, triangles) in &pieces {
            let border = open_edges(corners(piece, &triangles[0]));
            for (level, coarser) in levels.iter().zip(triangles) {
                assert!(open_edges(corners(piece, coarser)) == border, "{}: {level:?}", piece.name);
            }
        }
    }
}

#[test]
fn textures_are_not_mirrored_or_torn() {
    // Every triangle of a level has corners of one side of each seam: its texture is not stretched over the sphere.
    let (mesh, _, triangles) = with_levels(shapes::sphere(1.0, 64, 32));
    for triangle in triangles.iter().skip(1).flatten() {
        let [a, b, c] = triangle.map(|index| mesh.uvs[0][index as usize]);
        let [p, q, r] = triangle.map(|index| mesh.positions[index as usize]);
        let uv_area = (b - a).perp_dot(c - a);
        // Origin at the top left: counter-clockwise on the surface is clockwise in the picture.
        assert!(uv_area <= 1e-6, "{triangle:?} is mirrored: {uv_area}");
        let around = Mat3::from_cols(p, q, r).determinant().abs();
        assert!(uv_area.abs() <= 0.15, "{triangle:?} is torn: {uv_area}, {around}");
        assert_eq!(mesh.tangents[triangle[0] as usize].w, mesh.tangents[triangle[1] as usize].w);
    }
}

#[test]
fn what_is_small_or_cannot_be_simplified_stays_as_it_is() {
    let mut folded = shapes::plane(Vec2::ONE, UVec2::splat(16));
    folded.positions.iter_mut().for_each(|p| *p = Vec3::ZERO);
    let mut broken = shapes::sphere(1.0, 32, 16);
    broken.positions[7].x = f32::NAN;
    let mut huge = shapes::sphere(1.0, 32, 16);
    huge.positions.iter_mut().for_each(|p| *p *= 1e30);
    // A fan of triangles around one point.
    let mut fan = shapes::sphere(1.0, 4000, 2);
    fan.indices.truncate(12_000);
    for mesh in [Mesh::default(), shapes::cube(Vec3::ONE), folded, broken, huge, fan] {
        let name = mesh.name.clone();
        let (mesh, levels, _) = with_levels(mesh);
        assert_eq!(levels, [Level::whole(&mesh)], "{name}");
    }
}

#[test]
fn new_meshes_have_levels_after_a_frame_the_same_as_by_themselves() {
    let mut simulation = Simulation::new();
    for mesh in round_shapes() {
        simulation.world.resource_mut::<Library>().add_mesh(mesh);
    }
    simulation.frame();
    for (_, entry) in simulation.library().meshes() {
        let (levels, indices) = simplify(&entry.mesh);
        assert!(levels.len() > 1);
        assert_eq!((&levels, &indices), (&entry.levels, &entry.level_indices));
    }
}

#[test]
fn the_chosen_level_gets_coarser_with_distance_and_its_error_stays_below_the_limit() {
    let (_, levels, _) = with_levels(shapes::sphere(1.0, 64, 32));
    let lod = LevelOfDetail { enabled: true, max_error_pixels: 1.0 };
    let mut last = 0;
    for step in 1..2000 {
        let distance = step as f32 * 0.5;
        let chosen = lod.choose(&levels, 2.0, distance, 600.0);
        assert!(chosen >= last, "finer further away at {distance} m");
        assert!(levels[chosen].error * 2.0 * 600.0 / distance <= 1.0, "at {distance} m: {:?}", levels[chosen]);
        let next = levels.get(chosen + 1);
        assert!(next.is_none_or(|next| next.error * 2.0 * 600.0 / distance > 1.0), "too fine at {distance} m");
        last = chosen;
    }
    assert_eq!(last, levels.len() - 1);
    let far = |lod: LevelOfDetail| lod.choose(&levels, 1.0, 1e6, 600.0);
    assert_eq!(far(LevelOfDetail::OFF), 0);
    assert_eq!(far(LevelOfDetail { enabled: true, max_error_pixels: 0.0 }), 0);
    assert_eq!(far(LevelOfDetail { enabled: true, max_error_pixels: f32::NAN }), 0);
    assert_eq!([0.0, -1.0, f32::NAN].map(|distance| lod.choose(&levels, 1.0, distance, 600.0)), [0; 3]);
    assert_eq!(lod.choose(&[], 1.0, 5.0, 600.0), 0);
}

fn any_float() -> impl Strategy<Value = f32> {
    prop_oneof![20 => -2.0f32..2.0, 8 => prop::sample::select(vec![0.0, 1.0, -1.0]),
        1 => prop::sample::select(vec![-0.0, 1e-40, 1e15, 3e-20])]
}

prop_compose! {
    /// Many triangles between few vertices, some at one place: non-manifold, degenerate.
    fn any_mesh()(count in 3usize..200)(
        positions in prop::collection::vec([any_float(), any_float(), any_float()], count),
        uvs in prop::collection::vec([any_float(), any_float()], count),
        colors in prop::bool::ANY,
        indices in prop::collection::vec(0..count as u32, 3 * 128..3 * 400),
    ) -> Mesh {
        Mesh {
            normals: vec![Vec3::ZERO; positions.len()],
            colors: if colors { vec![Vec4::splat(0.5); positions.len()] } else { Vec::new() },
            positions: positions.into_iter().map(Vec3::from).collect(),
            uvs: [uvs.into_iter().map(Vec2::from).collect(), Vec::new()],
            indices: indices.as_chunks::<3>().0.as_flattened().to_vec(),
            ..Mesh::default()
        }
    }
}

proptest! {
    #[test]
    fn any_mesh_has_sound_levels(mesh in any_mesh()) {
        let (mesh, levels, triangles) = with_levels(mesh);
        prop_assert!(!levels.is_empty() && levels.len() <= MOST_LEVELS);
        prop_assert!(levels.iter().all(|level| level.error.is_finite()));
        prop_assert!(triangles.iter().flatten().flatten().all(|&i| (i as usize) < mesh.positions.len()));
    }
}
