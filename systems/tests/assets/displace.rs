//! Displaced meshes: what is flat stays as it is, and steps are where the map has them.

use super::*;
use std::f32::consts::FRAC_PI_4;
use systems::assets::displace::{Displacement, HeightMap, displace};

fn map(width: u32, height: u32, sampler: Sampler, of: impl Fn(u32, u32) -> f32) -> HeightMap {
    let texel = |i: u32| Vec4::splat(of(i % width, i / width));
    let texels: Vec<Vec4> = (0..width * height).map(texel).collect();
    let image = Image::rgba16("heights", width, height, ImageKind::Data, &texels);
    HeightMap::new(&image, &sampler).expect("texels")
}

fn meshes() -> Vec<Mesh> {
    let repeated = |mesh| shapes::with_uv_scale(mesh, Vec2::new(4.0, 2.0));
    vec![
        shapes::plane(Vec2::new(2.0, 2.0), UVec2::splat(32)),
        repeated(shapes::sphere(0.7, 96, 48)),
        repeated(shapes::torus(0.7, 0.3, 96, 48)),
    ]
}

#[test]
fn a_flat_map_leaves_the_mesh_as_it_is() {
    for (height, rest) in [(1.0, 1.0), (0.5, 0.5), (0.0, 0.0)] {
        let heights = map(4, 4, Sampler::default(), |_, _| height);
        for mesh in meshes() {
            let bumped = displace(&mesh, &Displacement { heights: &heights, scale_uv: 0.1, rest });
            assert_eq!(bumped.positions, mesh.positions, "{}", mesh.name);
            assert_eq!(bumped.indices, mesh.indices);
            for (new, old) in bumped.normals.iter().zip(&mesh.normals) {
                assert!(new.dot(*old) > 0.999, "{}: {new} {old}", mesh.name);
            }
        }
    }
}

#[test]
fn metres_follow_from_the_area_that_a_unit_of_uv_covers() {
    let heights = map(1, 1, Sampler::default(), |_, _| 1.0);
    let depth = |mesh: &Mesh| {
        let bumped = displace(mesh, &Displacement { heights: &heights, scale_uv: 0.1, rest: 0.0 });
        let moved = bumped.positions.iter().zip(&mesh.positions).map(|(new, old)| new.distance(*old));
        moved.collect::<Vec<f32>>()
    };
    let plane = shapes::plane(Vec2::new(8.0, 2.0), UVec2::splat(3));
    assert!(depth(&plane).iter().all(|d| (d - 0.4).abs() < 1e-5), "√(8 · 2) metres in a unit");
    let repeated = shapes::with_uv_scale(plane, Vec2::splat(4.0));
    assert!(depth(&repeated).iter().all(|d| (d - 0.1).abs() < 1e-5), "a quarter of the width, a quarter of the depth");
    let wide = map(4, 1, Sampler::default(), |_, _| 1.0);
    let plane = shapes::plane(Vec2::new(8.0, 2.0), UVec2::ONE);
    let bumped = displace(&plane, &Displacement { heights: &wide, scale_uv: 0.1, rest: 0.0 });
    assert!(bumped.positions.iter().all(|p| (p.y - 0.8).abs() < 1e-5), "texels are square: the image is 8 m wide");
    // A band around the equator is 2π wide and a unit of v is π high; toward a pole it is less wide. Chords of 64 bands
    // and 128 segments are shorter than their arcs by up to (π/64)²/24 each, and the middle of a band is half of it
    // aside.
    let deepest = depth(&shapes::sphere(1.0, 128, 64)).into_iter().fold(0.0, f32::max);
    assert!((deepest - 0.1 * std::f32::consts::PI * 2f32.sqrt()).abs() < 1e-3, "{deepest}");
}

#[test]
fn a_step_is_where_the_map_has_it() {
    // White to the left of u = ½, black to the right.
    let sampler = Sampler { wrap_u: Wrap::Clamp, wrap_v: Wrap::Clamp, ..Sampler::default() };
    let heights = map(16, 16, sampler, |x, _| if x < 8 { 1.0 } else { 0.0 });
    let plane = shapes::plane(Vec2::splat(1.6), UVec2::splat(32));
    let bumped = displace(&plane, &Displacement { heights: &heights, scale_uv: 0.25, rest: 1.0 });
    for ((new, old), normal) in bumped.positions.iter().zip(&plane.positions).zip(&bumped.normals) {
        // Texel centres are 0.05 m to either side of the edge; between them it falls by 0.4 m.
        let expected = -0.4 * ((old.x + 0.05) / 0.1).clamp(0.0, 1.0);
        assert!((new.y - expected).abs() < 1e-5 && new.x == old.x && new.z == old.z, "{old} → {new}");
        if old.x.abs() > 0.06 {
            assert!(normal.y > 0.9999, "{old}: {normal}");
        } else if old.x.abs() < 0.01 {
            let slope = Vec2::new(4.0, 1.0).normalize();
            assert!((normal.truncate() - slope).length() < 1e-4, "{old}: {normal}");
        }
    }
}

#[test]
fn seams_stay_closed_without_a_crease() {
    // A period of the image is the whole wave, so both ends of the turn have the same height.
    let wave = |x: u32, y: u32| 0.5 + 0.25 * (x as f32 * FRAC_PI_4).sin() + 0.2 * (y as f32 * FRAC_PI_4).cos();
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        let heights = map(8, 8, Sampler { wrap_u: wrap, wrap_v: wrap, ..Sampler::default() }, wave);
        for mesh in meshes().into_iter().skip(1) {
            let bumped = displace(&mesh, &Displacement { heights: &heights, scale_uv: 0.05, rest: 1.0 });
            let mut known: HashMap<_, (Vec3, Vec3)> = HashMap::new();
            let mut shared = 0;
            for (i, old) in mesh.positions.iter().enumerate() {
                let new = (bumped.positions[i], bumped.normals[i]);
                assert!(new.1.is_normalized() && new.0.is_finite());
                match known.insert(old.to_array().map(f32::to_bits), new) {
                    Some(other) => {
                        assert_eq!(new, other, "{}", mesh.name);
                        shared += 1;
                    }
                    None => assert!(new.1.dot(mesh.normals[i]) > 0.3),
                }
            }
            assert!(shared > 48, "{}: {shared}", mesh.name);
        }
    }
}

#[test]
fn heights_are_read_as_samplers_read_them() {
    let ramp = |wrap| map(4, 1, Sampler { wrap_u: wrap, wrap_v: wrap, ..Sampler::default() }, |x, _| x as f32 / 4.0);
    let (repeat, mirror, clamp) = (ramp(Wrap::Repeat), ramp(Wrap::Mirror), ramp(Wrap::Clamp));
    for heights in [&repeat, &mirror, &clamp] {
        assert_eq!(heights.at(Vec2::new(0.125, 0.5)), 0.0);
        assert_eq!(heights.at(Vec2::new(0.5, 7.3)), 0.375);
    }
    let beyond = Vec2::new(1.125, 0.5);
    assert_eq!([repeat.at(beyond), mirror.at(beyond), clamp.at(beyond)], [0.0, 0.75, 0.75]);
    assert_eq!([repeat.at(Vec2::ZERO), mirror.at(Vec2::ZERO), clamp.at(Vec2::ZERO)], [0.375, 0.0, 0.0]);
    assert_eq!(mirror.at(Vec2::new(1.875, 0.5)), 0.0);
}
