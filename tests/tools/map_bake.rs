//! Baked maps whose answer is known.

use crate::common::prelude::*;
use crate::models;
use relief::tools::maps::Raster;
use relief::tools::maps::bake::{
    BakeOptions, Baked, Coverage, Reach, Role, Surface, Target, Texel, Unwrap, Wanted, bake,
};
use std::f32::consts::{FRAC_PI_2, PI};
use std::num::NonZero;

const LOW: Role = Role::Low { uv_set: 0 };

fn surface(mesh: &Mesh, place: Affine3A, role: Role) -> Surface {
    Surface::of_mesh(mesh, &place, role).expect("UVs")
}

fn baked(low: &Surface, high: &Surface, options: &BakeOptions) -> Baked {
    let target = Target::new(high).expect("a surface");
    bake(low, &target, options, &|_, _| {}).expect("baked")
}

fn options(size: usize, cage: f32) -> BakeOptions {
    let wanted = Wanted { occlusion: false, ..Wanted::default() };
    BakeOptions { size: (size, size), reach: Some(Reach::Cage(cage)), wanted, ..BakeOptions::default() }
}

/// Several meshes as one fine surface.
fn together(meshes: &[Mesh]) -> Surface {
    let mut all = Surface::default();
    for mesh in meshes {
        let part = surface(mesh, Affine3A::IDENTITY, Role::High);
        let first = all.positions.len() as u32;
        all.positions.extend(&part.positions);
        all.normals.extend(&part.normals);
        all.triangles.extend(part.triangles.iter().map(|corners| corners.map(|vertex| vertex + first)));
    }
    all
}

fn texel(map: &Raster, x: usize, y: usize) -> &[f32] {
    &map.values[(y * map.width + x) * map.channels..][..map.channels]
}

/// glTF's frame at a texel, worked out here again: T, B and N of the coarse mesh, and the place.
fn frame(low: &Surface, Texel { triangle, weights }: Texel) -> ([Vec3; 3], Vec3) {
    let vertices = low.triangles[triangle as usize].map(|vertex| vertex as usize);
    let mix = |value: &dyn Fn(usize) -> Vec3| (0..3).map(|corner| weights[corner] * value(vertices[corner])).sum();
    let (at, normal, along): (Vec3, Vec3, Vec3) =
        (mix(&|v| low.positions[v]), mix(&|v| low.normals[v]), mix(&|v| low.tangents[v].truncate()));
    let normal = normal.normalize();
    let tangent = along.reject_from(normal).normalize();
    ([tangent, normal.cross(tangent) * low.tangents[vertices[0]].w, normal], at)
}

/// The greatest angle, in degrees, between what a map says of an ellipsoid `place(unit sphere)` and what is so.
fn worst_angle(low: &Surface, map: &Baked, size: usize, place: Affine3A) -> f32 {
    let unwrap = Unwrap::new(low, (size, size)).expect("UVs");
    let normals = map.normal.as_ref().expect("wanted");
    let unit_from_model = place.inverse();
    let mut worst = 0.0f32;
    for (x, y) in (0..size).flat_map(|y| (0..size).map(move |x| (x, y))) {
        let Some(at) = unwrap.texel(low, x, y) else { continue };
        let ([tangent, bitangent, normal], origin) = frame(low, at);
        // Where the ray along the normal meets the unit sphere.
        let (from, along) = (unit_from_model.transform_point3(origin), unit_from_model.transform_vector3(normal));
        let (a, b, c) = (along.length_squared(), from.dot(along), from.length_squared() - 1.0);
        let met = from + along * ((-b + (b * b - a * c).sqrt()) / a);
        let wanted = (unit_from_model.matrix3.transpose() * met).normalize();
        let n = Vec3::from_slice(texel(normals, x, y)) * 2.0 - 1.0;
        let got = (tangent * n.x + bitangent * n.y + normal * n.z).normalize();
        worst = worst.max(got.angle_between(wanted).to_degrees());
    }
    worst
}

#[test]
fn a_baked_sphere_has_the_spheres_normals() {
    let (coarse, fine) = (shapes::sphere(1.0, 16, 8), shapes::sphere(1.0, 400, 200));
    // As it is; stretched unevenly; mirrored; at the far end of a room.
    let places = [
        Affine3A::IDENTITY,
        Affine3A::from_scale_rotation_translation(Vec3::new(1.0, 1.6, 0.7), Quat::from_rotation_z(0.5), Vec3::ONE),
        Affine3A::from_scale_rotation_translation(Vec3::new(-1.2, 0.8, 1.0), Quat::from_rotation_x(2.0), Vec3::X * 9.0),
        Affine3A::from_scale(Vec3::splat(0.001)),
    ];
    for place in places {
        let low = surface(&coarse, place, LOW);
        let cage = 0.3 * place.matrix3.x_axis.length();
        let map = baked(&low, &surface(&fine, place, Role::High), &options(128, cage));
        assert_eq!((map.report.missed, map.report.overlapping), (0, 0), "{}", map.report);
        let worst = worst_angle(&low, &map, 128, place);
        // Normals of the fine sphere's vertices are 0.9° apart.
        assert!(worst < 1.0, "{worst}° off, at {place}");
    }
}

#[test]
fn a_plane_over_a_plane_is_exactly_flat() {
    let plane = shapes::plane(Vec2::splat(2.0), UVec2::splat(3));
    let dense = shapes::plane(Vec2::splat(2.0), UVec2::splat(50));
    for turn in [Quat::IDENTITY, Quat::from_euler(glam::EulerRot::XYZ, 0.7, -1.1, 2.0)] {
        let place = Affine3A::from_quat(turn);
        let all = BakeOptions { wanted: Wanted::default(), ..options(64, 0.1) };
        let map = baked(&surface(&plane, place, LOW), &surface(&dense, place, Role::High), &all);
        assert_eq!((map.report.baked, map.report.missed, map.report.overlapping), (64 * 64, 0, 0));
        let is = |map: &Option<Raster>, wanted: [f32; 3]| {
            let map = map.as_ref().expect("wanted");
            map.values.chunks_exact(map.channels).all(|texel| texel == &wanted[..map.channels])
        };
        assert!(is(&map.normal, [0.5, 0.5, 1.0]) && is(&map.height, [0.5; 3]) && is(&map.occlusion, [1.0; 3]));
        assert!((map.report.height_scale_uv() - 0.1).abs() < 1e-6 && map.report.height_rest() == 0.5);
    }
}

#[test]
fn the_depth_is_in_widths_of_an_image_of_square_texels() {
    // As the renderer has it (tests/shading/techniques.rs): 0.2 m over √(2 m · 1 m · width / height).
    let plane = shapes::plane(Vec2::new(2.0, 1.0), UVec2::splat(3));
    for ((width, height), expected) in [((64, 64), 0.2 / 2f32.sqrt()), ((64, 32), 0.1), ((32, 64), 0.2)] {
        let options = BakeOptions { size: (width, height), ..options(64, 0.1) };
        let [low, high] = [LOW, Role::High].map(|role| surface(&plane, Affine3A::IDENTITY, role));
        let report = baked(&low, &high, &options).report;
        assert!((report.height_scale_uv() - expected).abs() < 1e-6, "{width}×{height}: {}", report.height_scale_uv());
    }
}

#[test]
fn heights_are_distances_and_slopes_are_normals() {
    // A slope that rises by 0.2 m along x and falls by 0.1 m along z, over 2 m.
    let slope = models::landscape(2.0, 1, |x, z| 0.1 * x - 0.05 * z);
    let map = baked(
        &surface(&shapes::plane(Vec2::splat(2.0), UVec2::ONE), Affine3A::IDENTITY, LOW),
        &surface(&slope, Affine3A::IDENTITY, Role::High),
        &options(32, 0.25),
    );
    let (heights, normals) = (map.height.expect("wanted"), map.normal.expect("wanted"));
    // u along x, v along z, image-up along −z.
    let normal = Vec3::new(-0.1, -0.05, 1.0).normalize();
    for (x, y) in (0..32).flat_map(|y| (0..32).map(move |x| (x, y))) {
        let metres = |texel: usize| (texel as f32 + 0.5) / 16.0 - 1.0;
        let height = 0.5 + (0.1 * metres(x) - 0.05 * metres(y)) / 0.5;
        assert!((texel(&heights, x, y)[0] - height).abs() < 1e-5, "({x}, {y})");
        let got = Vec3::from_slice(texel(&normals, x, y)) * 2.0 - 1.0;
        assert!(got.distance(normal) < 1e-5, "{got} instead of {normal}");
    }
    let (lowest, highest) = map.report.heights_met;
    assert!((lowest + highest).abs() < 1e-6 && (highest - 0.15 * 31.0 / 32.0).abs() < 1e-6);
}

#[test]
fn mirrored_uvs_turn_the_tangent_with_them() {
    let slope = models::landscape(2.0, 1, |x, z| 0.1 * x - 0.05 * z);
    let mut plane = shapes::plane(Vec2::splat(2.0), UVec2::new(2, 1));
    let high = surface(&slope, Affine3A::IDENTITY, Role::High);
    plane.uvs[0].iter_mut().for_each(|uv| uv.x = 1.0 - uv.x);
    let mirrored = surface(&plane, Affine3A::IDENTITY, LOW);
    assert!(mirrored.tangents.iter().all(|tangent| tangent.w == -1.0 && tangent.x < -0.99));
    let map = baked(&mirrored, &high, &options(16, 0.25));
    let wanted = Vec3::new(0.1, -0.05, 1.0).normalize();
    for texel in map.normal.expect("wanted").values.as_chunks::<3>().0 {
        assert!((Vec3::from_array(*texel) * 2.0 - 1.0).distance(wanted) < 1e-5);
    }

    // Folded: both halves lie on the left half of the map. The first in the file is baked, here that of −x.
    let mut folded = shapes::plane(Vec2::splat(2.0), UVec2::new(2, 1));
    folded.uvs[0].iter_mut().for_each(|uv| uv.x = uv.x.min(1.0 - uv.x));
    let one_texel = BakeOptions { dilate: Some(0), ..options(16, 0.25) };
    let map = baked(&surface(&folded, Affine3A::IDENTITY, LOW), &high, &one_texel);
    assert_eq!((map.report.baked, map.report.overlapping, map.report.missed), (128, 128, 0));
    let heights = map.height.expect("wanted");
    assert!((0..16).all(|y| texel(&heights, 0, y)[0] < texel(&heights, 7, y)[0]));
    assert!((0..16).all(|y| texel(&heights, 8, y)[0] == 0.5), "beyond the chart, nothing was to be filled");
}

#[test]
fn missed_texels_are_counted_named_and_filled() {
    let low = surface(&shapes::plane(Vec2::splat(2.0), UVec2::ONE), Affine3A::IDENTITY, LOW);
    let half = shapes::plane(Vec2::new(1.0, 2.0), UVec2::splat(4));
    let high = surface(&half, Affine3A::from_translation(Vec3::new(-0.5, 0.05, 0.0)), Role::High);
    let map = baked(&low, &high, &BakeOptions { dilate: Some(2), ..options(64, 0.1) });
    let report = &map.report;
    assert_eq!((report.baked, report.missed, report.dilated), (2048, 2048, 4 * 64));
    let first: Vec<Vec2> = (32..37).map(|x| Vec2::new((x as f32 + 0.5) / 64.0, 0.5 / 64.0)).collect();
    assert_eq!(report.first_missed, first);
    let wanted = |x: usize| if x < 32 { Coverage::Baked } else { Coverage::Missed };
    assert!(map.coverage.iter().enumerate().all(|(i, coverage)| *coverage == wanted(i % 64)));
    assert_eq!(map.coverage_map().values.iter().sum::<f32>(), 2048.0 + 0.5 * 2048.0);
    // Two columns to either side, for the map goes around.
    let heights = map.height.expect("wanted");
    for (x, is_filled) in [(31, true), (32, true), (33, true), (34, false), (61, false), (62, true), (63, true)] {
        assert_eq!(texel(&heights, x, 9)[0], if is_filled { 0.75 } else { 0.5 }, "column {x}");
    }
    let text = report.to_string();
    assert!(text.contains("missed    2048 texels, 50.00 %; the first at UV (0.5078, 0.0078)"), "{text}");
}

#[test]
fn the_cage_takes_the_first_and_the_distance_the_nearest() {
    let sheet = shapes::plane(Vec2::splat(2.0), UVec2::ONE);
    let low = surface(&sheet, Affine3A::IDENTITY, LOW);
    let sheets = [0.1, -0.02, -0.3].map(|y| {
        let mut sheet = sheet.clone();
        sheet.positions.iter_mut().for_each(|p| p.y += y);
        sheet
    });
    let high = together(&sheets);
    let height_by = |reach: Reach| {
        let map = baked(&low, &high, &BakeOptions { reach: Some(reach), ..options(4, 1.0) });
        map.report.heights_met.0
    };
    let near = |a: f32, b: f32| (a - b).abs() < 1e-6;
    assert!(near(height_by(Reach::Cage(0.2)), 0.1));
    assert!(near(height_by(Reach::Cage(0.05)), -0.02));
    assert!(near(height_by(Reach::MaxDistance(0.2)), -0.02));
    assert!(near(height_by(Reach::MaxDistance(0.5)), -0.02));

    // What faces away is not met, unless it has two sides.
    let upside_down = surface(&sheet, Affine3A::from_rotation_x(PI), Role::High);
    let target = Target::new(&upside_down).expect("a surface");
    for reach in [Reach::Cage(0.2), Reach::MaxDistance(0.2)] {
        let options = BakeOptions { reach: Some(reach), ..options(4, 1.0) };
        let refused = bake(&low, &target, &options, &|_, _| {}).expect_err("nothing is met").to_string();
        assert!(refused.contains("none of 16 rays met plane within 0.2 m"), "{refused}");
    }
    let two_sided = Surface { two_sided: std::iter::once(0..2).collect(), ..upside_down };
    let map = baked(&low, &two_sided, &options(4, 0.2));
    assert!(map.normal.expect("wanted").values.as_chunks::<3>().0.iter().all(|texel| texel[2] == 1.0));
}

/// The open share at the middle of an open box's floor: all but the walls' (a parallel rectangle's configuration
/// factor).
fn open_box(half_width: f32, half_depth: f32, height: f32) -> f32 {
    let (x, y) = (half_width / height, half_depth / height);
    let part = |a: f32, b: f32| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    (part(x, y) + part(y, x)) * 2.0 / PI
}

#[test]
fn occlusion_is_what_form_factors_say() {
    let floor = shapes::plane(Vec2::new(2.0, 1.0), UVec2::ONE);
    let wall = |at: Vec3, yaw: f32, size: Vec2| {
        let place =
            Affine3A::from_translation(at) * Affine3A::from_rotation_y(yaw) * Affine3A::from_rotation_x(FRAC_PI_2);
        let mut wall = shapes::plane(size, UVec2::ONE);
        wall.positions.iter_mut().for_each(|p| *p = place.transform_point3(*p));
        wall
    };
    let low = surface(&floor, Affine3A::IDENTITY, LOW);
    let shares = |walls: &[Mesh], size: usize, distance: f32| {
        let high = together(&[std::slice::from_ref(&floor), walls].concat());
        let options = BakeOptions {
            wanted: Wanted { normal: false, height: false, occlusion: true },
            rays: 2048,
            occlusion_distance: distance,
            ..options(size, 0.1)
        };
        baked(&low, &high, &options).occlusion.expect("wanted")
    };
    // Rays that are evenly spread err by ½ · 2048^(−3/4) = 0.0016, as only those along an edge do; three times that is
    // allowed. A wall without end along z, 1.5 m high, at x = −1.
    let long = [wall(Vec3::new(-1.0, 0.75, 0.0), FRAC_PI_2, Vec2::new(2000.0, 1.5))];
    let map = shares(&long, 16, f32::INFINITY);
    for (x, y) in (0..16).flat_map(|y| (0..16).map(move |x| (x, y))) {
        let from = (x as f32 + 0.5) / 8.0;
        let wanted = 1.0 - 0.5 * (1.0 - from / from.hypot(1.5));
        assert!((texel(&map, x, y)[0] - wanted).abs() < 0.005, "{} instead of {wanted}", texel(&map, x, y)[0]);
    }
    // What is farther away than 0.9 m shades nothing.
    let near = shares(&long, 16, 0.9);
    assert!(texel(&near, 0, 8)[0] < 0.7 && texel(&near, 7, 8)[0] == 1.0);
    let pit = [
        wall(Vec3::new(-1.0, 0.4, 0.0), FRAC_PI_2, Vec2::new(1.0, 0.8)),
        wall(Vec3::new(1.0, 0.4, 0.0), FRAC_PI_2, Vec2::new(1.0, 0.8)),
        wall(Vec3::new(0.0, 0.4, -0.5), 0.0, Vec2::new(2.0, 0.8)),
        wall(Vec3::new(0.0, 0.4, 0.5), 0.0, Vec2::new(2.0, 0.8)),
    ];
    let (got, wanted) = (texel(&shares(&pit, 1, f32::INFINITY), 0, 0)[0], open_box(1.0, 0.5, 0.8));
    assert!((got - wanted).abs() < 0.005, "{got} instead of {wanted}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let low = surface(&models::coarse_torus(), Affine3A::IDENTITY, LOW);
    let high = surface(&models::fine_torus(96, 48), Affine3A::IDENTITY, Role::High);
    let by = |threads: usize| {
        let options = BakeOptions {
            size: (100, 70),
            wanted: Wanted::default(),
            rays: 4,
            threads: NonZero::new(threads),
            ..options(1, 0.15)
        };
        let map = baked(&low, &high, &options);
        (map.normal, map.height, map.occlusion, map.coverage, map.report.rays)
    };
    let one = by(1);
    assert!(one == by(2) && one == by(3) && one == by(7));
    let spread = |map: &Option<Raster>| {
        let values = &map.as_ref().expect("wanted").values;
        values.iter().fold(f32::MIN, |a, &b| a.max(b)) - values.iter().fold(f32::MAX, |a, &b| a.min(b))
    };
    assert!(spread(&one.0) > 0.5 && spread(&one.1) > 0.2 && spread(&one.2) >= 0.5, "there is something to compare");
}
