//! Proxies: how far they are from their members, and the finer meshes that they are made of.

use super::levels::farthest;
use super::*;
use glam::Affine3A;
use systems::assets::proxy::{Member, join, subdivided};

type Triangles = Vec<[Vec3; 3]>;

fn triangles(mesh: &Mesh, indices: &[u32], place: &Affine3A) -> Triangles {
    let corner = |index: u32| place.transform_point3(mesh.positions[index as usize]);
    indices.as_chunks::<3>().0.iter().map(|triangle| triangle.map(corner)).collect()
}

/// A ball, a post beside it and small parts around, of which the last is mirrored.
fn members() -> Vec<Member> {
    let ball = shapes::sphere(1.0, 24, 12);
    let post = shapes::cylinder(0.2, 3.0, 16);
    let bolt = shapes::cube(Vec3::splat(0.05));
    let places = [[0.0, 1.2, 0.0], [1.0, 0.5, 0.5], [-1.0, 0.2, 0.6], [0.3, -1.1, 0.2]];
    let bolts = places.map(|place| (bolt.clone(), Affine3A::from_translation(Vec3::from(place).normalize())));
    let mirrored =
        Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)) * Affine3A::from_translation(Vec3::new(-1.3, 0.0, 0.0));
    let all = [(ball, Affine3A::IDENTITY), (post, mirrored)].into_iter().chain(bolts);
    all.map(|(mesh, proxy_from_mesh)| {
        let colors = vec![Vec3::ONE; mesh.positions.len()];
        Member { triangles: mesh.triangle_count(), mesh, proxy_from_mesh, colors, surface: 0 }
    })
    .collect()
}

#[test]
fn a_proxy_is_no_further_from_its_members_than_its_error() {
    let members = members();
    let whole: Triangles = members
        .iter()
        .flat_map(|member| triangles(&member.mesh, &member.mesh.indices, &member.proxy_from_mesh))
        .collect();
    let ball = triangles(&members[0].mesh, &members[0].mesh.indices, &Affine3A::IDENTITY);
    let proxy = join(&members, 1).expect("worth it");
    let [surface] = &proxy.surfaces[..] else { panic!("{}", proxy.surfaces.len()) };
    assert!(surface.levels.len() > 3 && surface.levels[0].index_count == 0, "{:?}", surface.levels);
    assert_eq!(surface.levels[1].error, proxy.error);
    for level in &surface.levels[1..] {
        let range = level.first_index as usize..(level.first_index + level.index_count) as usize;
        let drawn = triangles(&surface.mesh, &surface.level_indices[range], &Affine3A::IDENTITY);
        assert!(drawn.len() < whole.len(), "{level:?} of {}", whole.len());
        // What is thinner than the error may be missing: the post, the bolts.
        let measured = farthest(&drawn, &whole).max(farthest(&ball, &drawn));
        assert!(measured <= level.error, "{measured} measured, {level:?}");
    }
}

#[test]
fn what_has_few_triangles_has_no_proxy() {
    assert!(join(&members()[2..], 1).is_none());
    let mut broken = members();
    broken[0].mesh.positions[3].x = f32::NAN;
    assert!(join(&broken, 1).is_none());
}

#[test]
fn a_subdivided_mesh_is_the_same_surface_with_short_edges() {
    for mesh in [shapes::cube(Vec3::new(1.0, 2.0, 0.3)), shapes::cylinder(0.5, 2.0, 12)] {
        let fine = subdivided(&mesh, 0.25);
        let [before, after] = [&mesh, &fine].map(|mesh| triangles(mesh, &mesh.indices, &Affine3A::IDENTITY));
        let longest = after.iter().flat_map(|&[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)]);
        assert!(longest.fold(0.0, f32::max) <= 0.25 && after.len() > before.len());
        assert!(open_edges(after.iter().copied()).is_empty(), "{}", mesh.name);
        let area = |triangles: &Triangles| {
            triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length() / 2.0).sum::<f32>()
        };
        // Sums of some thousand rounded areas.
        assert!((area(&after) / area(&before) - 1.0).abs() < 1e-4);
        assert_eq!([fine.normals.len(), fine.uvs[0].len()], [fine.positions.len(); 2]);
    }
    // Nothing is split for a length that is none.
    let cube = shapes::cube(Vec3::ONE);
    assert!(
        [0.0, -1.0, f32::NAN].iter().all(|&longest| subdivided(&cube, longest).indices.len() == cube.indices.len())
    );
}
