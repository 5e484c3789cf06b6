//! Meshes cut into pieces: nothing gapes, nothing is lost, nothing changes but where the cuts are.

use super::*;
use systems::assets::split::MOST_PIECES;
use systems::space::Aabb;

fn triangles(mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> {
    mesh.indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| mesh.positions[i as usize]))
}

fn area<'m>(meshes: impl IntoIterator<Item = &'m Mesh>) -> f64 {
    let doubled = |[a, b, c]: [Vec3; 3]| (b - a).as_dvec3().cross((c - a).as_dvec3()).length();
    meshes.into_iter().flat_map(triangles).map(doubled).sum::<f64>() * 0.5
}

/// Each piece lies in one cell of the grid, and no two in the same.
fn assert_in_cells(whole: &Mesh, grid: Grid, pieces: &[Mesh]) {
    let all = whole.aabb();
    let cell = grid.cell(all.max - all.min);
    let mut seen = Vec::new();
    for piece in pieces {
        let Aabb { min, max } = piece.aabb();
        let slack = (all.max - all.min).max_element() * 1e-6;
        let at = ((min + max) * 0.5 - all.min) / cell.max(Vec3::splat(1e-30));
        let at = at.floor().as_uvec3().min(grid.counts - 1);
        let (low, high) = (all.min + at.as_vec3() * cell, all.min + (at + 1).as_vec3() * cell);
        assert!(min.cmpge(low - slack).all() && max.cmple(high + slack).all(), "{min} {max} not in {low} {high}");
        // What lies in a plane between two cells belongs to the lower one; its box tells nothing of that.
        if (max - min).cmpgt(Vec3::splat(slack)).all() {
            assert!(!seen.contains(&at), "two pieces in the cell {at}");
            seen.push(at);
        }
    }
}

/// Attributes that are straight functions of the place, so that it is known what they are anywhere on a triangle.
fn with_linear_attributes(mesh: Mesh) -> Mesh {
    let at = |f: &dyn Fn(Vec3) -> Vec4| mesh.positions.iter().map(|&p| f(p)).collect::<Vec<_>>();
    let uvs = [at(&first_uv), at(&second_uv)].map(|uvs| uvs.iter().map(|uv| Vec2::new(uv.x, uv.y)).collect());
    Mesh { uvs, colors: at(&color), ..mesh }
}

fn first_uv(p: Vec3) -> Vec4 {
    Vec4::new(p.x * 3.0 + p.y - 5.0, p.z * 0.5 - p.y, 0.0, 0.0)
}

fn second_uv(p: Vec3) -> Vec4 {
    Vec4::new(p.z + p.x, p.y * 2.0 + 0.25, 0.0, 0.0)
}

fn color(p: Vec3) -> Vec4 {
    Vec4::new(0.5 + p.x * 0.1, 0.4 - p.y * 0.1, 0.3 + p.z * 0.1, 1.0 - p.x * 0.05)
}

fn assert_linear_attributes(pieces: &[Mesh], tolerance: f32) {
    for piece in pieces {
        for (i, &p) in piece.positions.iter().enumerate() {
            let uv = |set: usize| piece.uvs[set][i].extend(0.0).extend(0.0);
            for (got, wanted) in [(uv(0), first_uv(p)), (uv(1), second_uv(p)), (piece.colors[i], color(p))] {
                assert!((got - wanted).abs().max_element() <= tolerance, "at {p}: {got}, not {wanted}");
            }
        }
    }
}

#[test]
fn a_road_of_two_triangles_comes_apart() {
    let road = shapes::tiled(shapes::plane(Vec2::new(12.0, 1000.0), UVec2::ONE), 2.0);
    let mut whole = road.clone();
    compute_tangents(&mut whole);
    let grid = Grid::new(&whole, Vec3::splat(4.0));
    assert_eq!(grid.counts, UVec3::new(3, 1, 250));
    let pieces = split(&whole, grid);
    assert_eq!(pieces.len(), 750);
    assert_in_cells(&whole, grid, &pieces);
    assert!((area(&pieces) - 12_000.0).abs() < 1e-4, "{}", area(&pieces));
    // Open only around the road: as many edges as cells along its rim.
    assert_eq!(open_edges(pieces.iter().flat_map(triangles)).len(), 2 * (3 + 250));
    for piece in &pieces {
        assert!(piece.normals.iter().all(|&n| n == Vec3::Y));
        assert!(piece.tangents.iter().all(|t| t.distance(Vec4::new(1.0, 0.0, 0.0, 1.0)) < 1e-6));
        for (p, uv) in piece.positions.iter().zip(&piece.uvs[0]) {
            assert!(p.y == 0.0 && (Vec2::new(p.x + 6.0, p.z + 500.0) / 2.0).distance(*uv) < 1e-4, "{p} {uv}");
        }
    }
}

#[test]
fn a_small_mesh_is_one_cell() {
    let cube = shapes::cube(Vec3::ONE);
    for longest in [Vec3::ONE, Vec3::splat(5.0), Vec3::INFINITY, Vec3::ZERO, Vec3::splat(-1.0), Vec3::splat(f32::NAN)] {
        assert!(Grid::new(&cube, longest).is_whole(), "{longest}");
    }
    assert!(Grid::new(&Mesh::default(), Vec3::ONE).is_whole());
    // Each axis by itself.
    assert_eq!(Grid::new(&cube, Vec3::new(0.5, f32::INFINITY, 0.3)).counts, UVec3::new(2, 1, 4));
}

#[test]
fn a_mesh_with_places_that_are_none_is_left_whole() {
    for bad in [f32::NAN, f32::INFINITY] {
        let mut mesh = shapes::plane(Vec2::splat(100.0), UVec2::splat(3));
        mesh.positions[5].y = bad;
        assert!(Grid::new(&mesh, Vec3::ONE).is_whole());
    }
    let mut mesh = shapes::plane(Vec2::splat(10.0), UVec2::ONE);
    mesh.indices.extend([0, 1, 99]);
    let pieces = split(&mesh, Grid::new(&mesh, Vec3::splat(5.0)));
    assert!((area(&pieces) - 100.0).abs() < 1e-4, "a triangle without vertices is left out");
}

/// However long the mesh and short the cells.
#[test]
fn the_work_is_bounded() {
    let plane = |x: f32, z: f32| shapes::plane(Vec2::new(x, z), UVec2::ONE);
    let tilted = |mut mesh: Mesh| {
        mesh.positions.iter_mut().for_each(|p| p.y = p.x * 0.7 + p.z * 0.4);
        mesh
    };
    // A fan of slivers: many triangles that each cross many cells.
    let mut fan = shapes::cylinder(5e4, 1.0, 4096);
    fan.positions.iter_mut().for_each(|p| p.y *= 3.0);
    let meshes =
        [plane(1e5, 1e5), plane(1e5, 12.0), tilted(plane(1e5, 1e5)), tilted(plane(1e5, 0.1)), fan, plane(1e30, 1e30)];
    for mesh in meshes {
        let grid = Grid::new(&mesh, Vec3::ONE);
        let pieces = split(&mesh, grid);
        let made: usize = pieces.iter().map(Mesh::triangle_count).sum();
        assert!(pieces.len() > 1000 && pieces.len() <= 2 * MOST_PIECES as usize, "{} pieces", pieces.len());
        assert!(made < 3_000_000, "{made} triangles");
    }
}

#[test]
fn tangents_are_those_of_the_whole() {
    let mut whole = shapes::torus(3.0, 1.0, 24, 12);
    // Half of it mirrored, so that both signs are there, and a seam between.
    whole.uvs[0].iter_mut().for_each(|uv| uv.x = (uv.x - 0.5).abs());
    compute_tangents(&mut whole);
    assert!([1.0, -1.0].iter().all(|&w| whole.tangents.iter().any(|t| t.w == w)));
    let pieces = split(&whole, Grid::new(&whole, Vec3::splat(1.3)));
    let vertex = |mesh: &Mesh, i: usize| {
        let (p, n, uv) = (bits(mesh.positions[i]), bits(mesh.normals[i]), bits(mesh.uvs[0][i].extend(0.0)));
        (p, n, uv, mesh.tangents[i].to_array().map(f32::to_bits))
    };
    let old: Vec<_> = (0..whole.positions.len()).map(|i| vertex(&whole, i)).collect();
    let places: Vec<_> = old.iter().map(|v| v.0).collect();
    let mut found = vec![false; old.len()];
    let mut new = 0;
    for piece in &pieces {
        for i in 0..piece.positions.len() {
            let v = vertex(piece, i);
            match old.iter().position(|o| *o == v) {
                Some(o) => found[o] = true,
                None => {
                    assert!(!places.contains(&v.0), "an old vertex has another tangent");
                    let (tangent, normal) = (piece.tangents[i], piece.normals[i]);
                    assert!((tangent.truncate().length() - 1.0).abs() < 1e-6 && tangent.w.abs() == 1.0);
                    assert!((normal.length() - 1.0).abs() < 1e-6);
                    new += 1;
                }
            }
        }
        for triangle in piece.indices.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|i| piece.tangents[i as usize].w);
            assert!(a == b && b == c, "a triangle has one handedness");
        }
    }
    assert!(found.iter().all(|&found| found) && new > 100);
}

/// However long the edge: by interpolation alone, the cut would be a millionth of a metre beside the plane.
#[test]
fn a_cut_lies_in_its_plane() {
    let positions = vec![Vec3::new(-1e10, 0.0, 0.0), Vec3::new(8.1e9, 1.0, 0.0), Vec3::new(1e10, 0.0, 1e10)];
    let mesh = Mesh { normals: vec![Vec3::Y; 3], positions, indices: vec![0, 1, 2], ..Mesh::default() };
    let pieces = split(&mesh, Grid { counts: UVec3::new(2, 1, 1) });
    let boxes: Vec<_> = pieces.iter().map(|piece| (piece.aabb().min.x, piece.aabb().max.x)).collect();
    assert_eq!(boxes, [(-1e10, 0.0), (0.0, 1e10)]);
}

#[test]
fn directions_on_a_cut_are_interpolated_to_unit_length() {
    let (a, b) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.6, 0.8, 0.0));
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, 0.0, -4.0)],
        normals: vec![a, b, a],
        tangents: vec![Vec3::Z.extend(-1.0), Vec3::X.extend(-1.0), Vec3::Z.extend(-1.0)],
        indices: vec![0, 1, 2],
        ..Mesh::default()
    };
    let pieces = split(&mesh, Grid { counts: UVec3::new(4, 1, 1) });
    let at = |x: f32| {
        let mut all = pieces.iter().flat_map(|p| p.positions.iter().zip(p.normals.iter().zip(&p.tangents)));
        all.find(|(p, _)| **p == Vec3::new(x, 0.0, 0.0)).map(|(_, (n, t))| (*n, *t)).expect("a vertex on the edge")
    };
    let (normal, tangent) = at(1.0);
    assert!(normal.distance(a.lerp(b, 0.25).normalize()) < 1e-6, "{normal}");
    assert!(tangent.distance(Vec3::Z.lerp(Vec3::X, 0.25).normalize().extend(-1.0)) < 1e-6, "{tangent}");
    assert_eq!(at(0.0), (a, Vec3::Z.extend(-1.0)));
    assert_eq!(at(4.0), (b, Vec3::X.extend(-1.0)));
}

#[test]
fn pieces_are_made_once() {
    let mut library = Library::default();
    let mesh = library.add_mesh(shapes::sphere(5.0, 32, 16));
    let grid = |side: f32, library: &Library| Grid::new(&library.mesh(mesh).unwrap().mesh, Vec3::splat(side));
    let (coarse, fine) = (grid(5.0, &library), grid(2.0, &library));
    let pieces = library.pieces(mesh, coarse);
    let (before, revisions) = (library.sizes(), library.revisions());
    assert_eq!(library.pieces(mesh, coarse), pieces);
    assert_eq!(library.sizes(), before);
    assert!(library.pieces(mesh, fine).len() > pieces.len());
    let with_tangents = |id| library.mesh(id).is_some_and(|e| e.mesh.tangents.len() == e.mesh.positions.len());
    assert!(pieces.iter().all(|&piece| with_tangents(piece)), "cut from a mesh that has tangents");
    // A loader that fails takes them back.
    library.take_back(revisions);
    assert_eq!(library.pieces(mesh, coarse), pieces);
    let again = library.pieces(mesh, fine);
    assert!(again.iter().all(|&piece| library.mesh(piece).is_some()), "what was taken back is made again");
}

/// A closed surface of random shape: a sphere's triangles, its vertices thrown about, many of them onto the planes that
/// it will be cut by. Some triangles have corners of their own, as at seams.
fn closed_mesh() -> impl Strategy<Value = Mesh> {
    let place = (any::<bool>(), prop::array::uniform3(-4.0f32..4.0));
    (3u32..9, 2u32..6, prop::collection::vec(place, 60), prop::collection::vec(any::<bool>(), 90)).prop_map(
        |(segments, rings, places, own)| {
            let sphere = shapes::sphere(1.0, segments, rings);
            let mut index = HashMap::new();
            let mut mesh = Mesh::default();
            // Vertices at one place stay at one place.
            let rounded = |p: Vec3| ((p * 1e4).round() + 0.0).to_array().map(f32::to_bits);
            for &p in &sphere.positions {
                let next = index.len();
                let (snapped, at) = places[*index.entry(rounded(p)).or_insert(next) % places.len()];
                let at = Vec3::from_array(at);
                mesh.positions.push(if snapped { (at * 0.5).round() * 2.0 } else { at });
            }
            mesh.normals = sphere.normals;
            mesh.indices = sphere.indices;
            for triangle in 0..mesh.triangle_count() {
                if own[triangle % own.len()] {
                    for corner in triangle * 3..triangle * 3 + 3 {
                        let vertex = mesh.indices[corner] as usize;
                        mesh.indices[corner] = mesh.positions.len() as u32;
                        mesh.positions.push(mesh.positions[vertex]);
                        mesh.normals.push(mesh.normals[vertex]);
                    }
                }
            }
            // The corners of the box, so that the planes are where the vertices were put: at even numbers.
            for corner in [Vec3::splat(-4.0), Vec3::splat(4.0)] {
                mesh.positions.push(corner);
                mesh.normals.push(Vec3::Y);
            }
            mesh
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn pieces_of_any_surface_are_watertight(mesh in closed_mesh(), counts in prop::array::uniform3(1u32..9)) {
        prop_assert!(open_edges(triangles(&mesh)).is_empty(), "the whole is closed");
        let whole = with_linear_attributes(mesh);
        let grid = Grid { counts: UVec3::from_array(counts) };
        let pieces = split(&whole, grid);
        let open = open_edges(pieces.iter().flat_map(triangles));
        prop_assert!(open.is_empty(), "{} open edges", open.len());
        prop_assert!((area(&pieces) - area([&whole])).abs() < 1e-4 * area([&whole]).max(1.0));
        assert_in_cells(&whole, grid, &pieces);
        assert_linear_attributes(&pieces, 1e-4);
    }
}
