//! The map tools as functions: known answers, worked out by hand or by trying every texel.

use crate::common::{self, prelude::*};
use proptest::prelude::*;
use relief::tools::maps::files::{self, Bits};
use relief::tools::maps::preview::add_map;
use relief::tools::maps::{
    Edges, Filter, HeightOptions, HorizonOptions, NormalOptions, Polish, Raster, Relief, SpecularModel,
    SpecularOptions, height_from_color, horizon_from_height, normal_from_height, offset_from_height, specular_from,
};

const FILTERS: [Filter; 3] = [Filter::Central, Filter::Sobel, Filter::Scharr];
const EDGES: [Edges; 2] = [Edges::Wrap, Edges::Clamp];

fn raster(width: usize, height: usize, value: impl Fn(usize, usize) -> f32) -> Raster {
    let values = (0..width * height).map(|i| value(i % width, i / width)).collect();
    Raster { width, height, channels: 1, values }
}

fn options(height_scale: f32, edges: Edges, filter: Filter) -> NormalOptions {
    let relief = Relief { height_scale, edges, invert: false };
    NormalOptions { relief, filter, ..NormalOptions::default() }
}

fn normals(heights: &Raster, options: &NormalOptions) -> Vec<Vec3> {
    decoded(&normal_from_height(heights, options, &|_, _| {}))
}

fn decoded(map: &Raster) -> Vec<Vec3> {
    map.values.chunks_exact(3).map(|texel| Vec3::from_slice(texel) * 2.0 - 1.0).collect()
}

/// Map after it is written to a file and read back.
fn stored(map: &Raster, name: &str, bits: Bits) -> Raster {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    files::write(&path, map, bits).expect("written");
    files::read(&path).expect("read")
}

#[test]
fn flat_in_is_exactly_flat_out() {
    for (level, (width, height)) in [(0.0, (1, 1)), (0.3, (5, 3)), (0.5, (2, 7)), (1.0, (4, 4))] {
        let flat = raster(width, height, |_, _| level);
        for (filter, edges) in FILTERS.iter().flat_map(|&f| EDGES.map(|e| (f, e))) {
            let options = NormalOptions { strength: 7.0, flip_green: level > 0.4, ..options(3.0, edges, filter) };
            let map = normal_from_height(&flat, &options, &|_, _| {});
            assert!(map.values.chunks_exact(3).all(|texel| texel == [0.5, 0.5, 1.0]), "{filter:?} {edges:?}");
            let offset = offset_from_height(&flat, &options, &|_, _| {});
            assert!(offset.values.chunks_exact(3).all(|texel| texel == [128.0 / 255.0, 128.0 / 255.0, 0.0]));
            let horizon = HorizonOptions { relief: options.relief, max_distance: None };
            let maps = horizon_from_height(&flat, &horizon, &|_, _| {});
            assert!(maps.iter().all(|map| map.values.iter().all(|&value| value == 0.0)));
        }
        let color = Raster { width, height, channels: 3, values: vec![level; width * height * 3] };
        let guess = HeightOptions { sharpen: 2.0, blur: 1.5, ..HeightOptions::default() };
        let guessed = height_from_color(&color, &guess, &|_, _| {});
        assert!(guessed.values.iter().all(|value| (value - 0.5).abs() < 1e-6));
        assert!(stored(&guessed, "h.png", Bits::Eight).values.iter().all(|&value| value == 128.0 / 255.0));
    }
    let map = normal_from_height(&raster(3, 2, |_, _| 0.7), &NormalOptions::default(), &|_, _| {});
    let folder = tempfile::tempdir().expect("a temporary folder");
    let open = |name: &str, bits| {
        files::write(&folder.path().join(name), &map, bits).expect("written");
        image::open(folder.path().join(name)).expect("an image")
    };
    assert!(open("8.png", Bits::Eight).to_rgb8().pixels().all(|p| p.0 == [128, 128, 255]));
    assert!(open("16.png", Bits::Sixteen).to_rgb16().pixels().all(|p| p.0 == [32768, 32768, 65535]));
    assert_eq!(stored(&map, "f.exr", Bits::Eight), map, "floats are kept as they are");
}

#[test]
fn a_hemisphere_has_its_analytic_normals_within_a_degree() {
    let (side, radius) = (256, 100.0f32);
    let from_centre = |x: usize, y: usize| Vec2::new(x as f32 - 127.5, 127.5 - y as f32);
    let ball = raster(side, side, |x, y| (1.0 - from_centre(x, y).length_squared() / radius.powi(2)).max(0.0).sqrt());
    for heights in [ball.clone(), stored(&ball, "h.png", Bits::Sixteen), stored(&ball, "h.exr", Bits::Eight)] {
        let heights = Raster {
            channels: 1,
            values: heights.values.iter().step_by(heights.channels).copied().collect(),
            ..heights
        };
        for filter in FILTERS {
            let map = normal_from_height(&heights, &options(radius / side as f32, Edges::Clamp, filter), &|_, _| {});
            for map in [stored(&map, "n.png", Bits::Eight), stored(&map, "n.png", Bits::Sixteen), map] {
                let mut checked = 0;
                for (i, normal) in decoded(&map).iter().enumerate() {
                    let at = from_centre(i % side, i / side);
                    if at.length() > 0.85 * radius {
                        continue;
                    }
                    let wanted = at.extend((radius.powi(2) - at.length_squared()).sqrt()) / radius;
                    // Steps of 8 bits: half of 2/255 in three components, 0.4°. Heights of 16 bits, and differences
                    // over two texels where the slope bends, 0.1° each.
                    let angle = normal.normalize().angle_between(wanted).to_degrees();
                    assert!(angle < 1.0, "{filter:?} at {at}: {angle}° off");
                    checked += 1;
                }
                assert!(checked > 20_000);
            }
        }
    }
}

#[test]
fn ramps_have_their_slope_whatever_the_filter_and_the_shape_of_the_map() {
    let (width, height) = (12, 5);
    for filter in FILTERS {
        // 0.05 per texel to the right, 0.02 per texel up.
        let ramp = raster(width, height, |x, y| 0.05 * x as f32 - 0.02 * y as f32 + 0.2);
        let slope = 0.5 * width as f32;
        let got = normals(&ramp, &options(0.5, Edges::Clamp, filter))[2 * width + 6];
        let wanted = Vec3::new(-0.05 * slope, -0.02 * slope, 1.0).normalize();
        assert!((got - wanted).length() < 1e-5, "{filter:?}: {got} {wanted}");
        let strong = NormalOptions { strength: 3.0, flip_green: true, ..options(0.5, Edges::Clamp, filter) };
        let got = normals(&ramp, &strong)[2 * width + 6];
        assert!((got - Vec3::new(-0.15 * slope, 0.06 * slope, 1.0).normalize()).length() < 1e-5, "{got}");
        let mut dent = options(0.5, Edges::Clamp, filter);
        dent.relief.invert = true;
        let got = normals(&ramp, &dent)[2 * width + 6];
        assert!((got - Vec3::new(0.05 * slope, 0.02 * slope, 1.0).normalize()).length() < 1e-5, "{got}");
    }
}

#[test]
fn at_the_edges_a_tile_goes_on_and_a_clamped_map_is_level() {
    let ramp = raster(8, 4, |x, _| x as f32 / 8.0);
    let slope_at = |edges, x: usize| {
        let n = normals(&ramp, &options(1.0, edges, Filter::Central))[8 + x];
        -n.x / n.z / 8.0
    };
    let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
    assert!(near(slope_at(Edges::Clamp, 4), 0.125) && near(slope_at(Edges::Wrap, 4), 0.125));
    assert!(near(slope_at(Edges::Clamp, 0), 0.0625) && near(slope_at(Edges::Clamp, 7), 0.0625));
    assert!(
        near(slope_at(Edges::Wrap, 0), (0.125 - 0.875) / 2.0) && near(slope_at(Edges::Wrap, 7), (0.0 - 0.75) / 2.0)
    );
}

#[test]
fn the_same_heights_give_the_same_map_from_8_and_16_bits_and_floats() {
    let heights = raster(9, 7, |x, y| ((x * 37 + y * 91) % 256) as f32 / 255.0);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let read = |name: &str, bits| {
        let path = folder.path().join(name);
        files::write(&path, &heights, bits).expect("written");
        normals(&files::read_grey(&path, None).expect("grey"), &NormalOptions::default())
    };
    let [eight, sixteen, float] =
        [read("8.png", Bits::Eight), read("16.png", Bits::Sixteen), read("f.exr", Bits::Eight)];
    for (a, b) in eight.iter().zip(&sixteen).chain(eight.iter().zip(&float)) {
        assert!((*a - *b).length() < 1e-5);
    }
}

/// Azimuths 0° to 315° of a texel.
fn horizons(maps: &[Raster; 2], x: usize, y: usize) -> [f32; 8] {
    let texel = (y * maps[0].width + x) * 4;
    std::array::from_fn(|i| maps[i / 4].values[texel + i % 4])
}

fn elevation(rise: f32, distance: f32) -> f32 {
    (rise / distance).atan() / std::f32::consts::FRAC_PI_2
}

#[test]
fn a_step_stands_at_its_analytic_elevation() {
    let step = raster(32, 16, |x, _| if x < 16 { 0.25 } else { 0.75 });
    let relief = Relief { height_scale: 0.1, edges: Edges::Clamp, invert: false };
    let rise = 0.5 * 0.1 * 32.0;
    let maps = horizon_from_height(&step, &HorizonOptions { relief, max_distance: None }, &|_, _| {});
    let diagonal = std::f32::consts::SQRT_2;
    for (x, y) in [(0, 8), (9, 8), (15, 8), (12, 3), (12, 4), (13, 14), (20, 8), (31, 0)] {
        let got = horizons(&maps, x, y);
        let mut wanted = [0.0; 8];
        if x < 16 {
            let away = 16 - x;
            wanted[0] = elevation(rise, away as f32);
            // Diagonals leave the map above or below before they reach the step.
            wanted[1] = if away <= y { elevation(rise, away as f32 * diagonal) } else { 0.0 };
            wanted[7] = if away <= 15 - y { elevation(rise, away as f32 * diagonal) } else { 0.0 };
        }
        for (g, w) in got.iter().zip(wanted) {
            assert!((g - w).abs() < 1e-6, "({x}, {y}): {got:?}, wanted {wanted:?}");
        }
    }
    let tile = HorizonOptions { relief: Relief { edges: Edges::Wrap, ..relief }, max_distance: None };
    let around = horizons(&horizon_from_height(&step, &tile, &|_, _| {}), 3, 8);
    assert!((around[4] - elevation(rise, 4.0)).abs() < 1e-6, "the step's other side, around the edge: {around:?}");
    let near = HorizonOptions { max_distance: Some(7), ..tile };
    let maps = horizon_from_height(&step, &near, &|_, _| {});
    assert_eq!((horizons(&maps, 8, 8)[0], horizons(&maps, 11, 8)[1]), (0.0, 0.0), "8 texels away, and 5√2");
    assert!(horizons(&maps, 9, 8)[0] > 0.0 && horizons(&maps, 12, 8)[1] > 0.0);
}

/// Every texel of every line, one by one.
fn horizons_by_trying(heights: &Raster, options: &HorizonOptions, x: usize, y: usize) -> [f32; 8] {
    let Relief { height_scale, edges, invert } = options.relief;
    let (width, height) = (heights.width as isize, heights.height as isize);
    let here = heights.at(x as isize, y as isize, 0, edges);
    let directions: [(isize, isize); 8] = [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)];
    directions.map(|(dx, dy)| {
        let mut highest = 0.0f32;
        for k in 1..=width * height {
            let (there_x, there_y) = (x as isize + k * dx, y as isize + k * dy);
            let inside = (0..width).contains(&there_x) && (0..height).contains(&there_y);
            let distance = ((dx * dx + dy * dy) as f32).sqrt() * k as f32;
            let too_far = options.max_distance.is_some_and(|most| distance > most as f32);
            if too_far || edges == Edges::Clamp && !inside {
                break;
            }
            let rise = heights.at(there_x, there_y, 0, edges) - here;
            let rise = if invert { -rise } else { rise };
            highest = highest.max(elevation(rise * height_scale * width as f32, distance));
        }
        highest
    })
}

fn any_heights() -> impl Strategy<Value = Raster> {
    (1usize..24, 1usize..10).prop_flat_map(|(width, height)| {
        proptest::collection::vec(0.0f32..1.0, width * height).prop_map(move |values| Raster {
            width,
            height,
            channels: 1,
            values,
        })
    })
}

fn any_relief() -> impl Strategy<Value = Relief> {
    (0.001f32..2.0, any::<bool>(), any::<bool>()).prop_map(|(height_scale, wrap, invert)| Relief {
        height_scale,
        edges: if wrap { Edges::Wrap } else { Edges::Clamp },
        invert,
    })
}

proptest! {
    #[test]
    fn horizons_are_what_trying_every_texel_finds(
        heights in any_heights(),
        relief in any_relief(),
        max_distance in proptest::option::of(1usize..30),
    ) {
        let options = HorizonOptions { relief, max_distance };
        let maps = horizon_from_height(&heights, &options, &|_, _| {});
        for (y, x) in (0..heights.height).flat_map(|y| (0..heights.width).map(move |x| (y, x))) {
            let (got, wanted) = (horizons(&maps, x, y), horizons_by_trying(&heights, &options, x, y));
            for (g, w) in got.iter().zip(wanted) {
                prop_assert!((g - w).abs() < 1e-5, "({}, {}): {:?} {:?}", x, y, got, wanted);
            }
        }
    }

    #[test]
    fn normals_are_unit_and_face_out_and_offsets_are_their_xy(
        heights in any_heights(),
        relief in any_relief(),
        strength in 0.0f32..4.0,
        filter in proptest::sample::select(FILTERS.to_vec()),
        flip_green in any::<bool>(),
    ) {
        let options = NormalOptions { relief, filter, strength, flip_green };
        let offsets = offset_from_height(&heights, &options, &|_, _| {});
        for (normal, offset) in normals(&heights, &options).iter().zip(offsets.values.chunks_exact(3)) {
            prop_assert!((normal.length() - 1.0).abs() < 1e-5 && normal.z > 0.0);
            let slope = normal.truncate() / normal.z;
            let offset = (Vec2::from_slice(offset) * 255.0 - 128.0) / 127.0;
            let wanted = slope.clamp(Vec2::NEG_ONE, Vec2::ONE);
            // Far below 45° z is small, and its rounding counts.
            prop_assert!((offset - wanted).abs().max_element() < 1e-3, "{} {}", offset, wanted);
            prop_assert!(offset.abs().max_element() <= 1.0 + 1e-5);
        }
    }
}

#[test]
fn a_guessed_height_is_luminance_about_mid_grey() {
    let values = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].concat();
    let color = Raster { width: 4, height: 1, channels: 3, values };
    let luminance = [0.0, 0.2126, 0.7152, 0.0722];
    let guess = |options: &HeightOptions| height_from_color(&color, options, &|_, _| {}).values;
    let plain = guess(&HeightOptions::default());
    let half = guess(&HeightOptions { contrast: 0.5, invert: true, ..HeightOptions::default() });
    for i in 0..4 {
        assert!((plain[i] - (0.5 + luminance[i] - 0.25)).abs() < 1e-3, "{plain:?}");
        assert!((half[i] - (0.5 - 0.5 * (luminance[i] - 0.25))).abs() < 1e-3, "{half:?}");
    }
}

#[test]
fn shading_goes_edges_come_out_and_grain_is_smoothed() {
    // A wide gradient with fine stripes on it.
    let rgb = |x: usize| [0.2 + 0.5 * x as f32 / 64.0 + 0.05 * (x % 4 / 2) as f32; 3];
    let color = Raster { width: 64, height: 4, channels: 3, values: (0..256).flat_map(|i| rgb(i % 64)).collect() };
    let edges = Edges::Clamp;
    let guess = |options: HeightOptions| height_from_color(&color, &HeightOptions { edges, ..options }, &|_, _| {});
    let plain = guess(HeightOptions::default());
    let wide = |map: &Raster| (map.at(40, 1, 0, edges) - map.at(20, 1, 0, edges)).abs();
    let fine = |map: &Raster| (map.at(31, 1, 0, edges) - map.at(29, 1, 0, edges)).abs();
    let level = guess(HeightOptions { remove_shading: 6.0, ..HeightOptions::default() });
    assert!(wide(&level) < 0.05 * wide(&plain) && fine(&level) > 0.7 * fine(&plain));
    let smooth = guess(HeightOptions { blur: 3.0, ..HeightOptions::default() });
    assert!((wide(&smooth) - wide(&plain)).abs() < 0.03 && fine(&smooth) < 0.4 * fine(&plain));
    let sharp = guess(HeightOptions { sharpen: 1.0, ..HeightOptions::default() });
    assert!(fine(&sharp) > 1.5 * fine(&plain) && (wide(&sharp) - wide(&plain)).abs() < 0.03);
}

#[test]
fn polish_becomes_reflectance_and_glossiness() {
    let gloss = raster(5, 1, |x, _| [0.0, 0.5, 0.8, 1.0, 0.5][x]);
    let base = Raster { width: 5, height: 1, channels: 3, values: [[0.0; 12].as_slice(), &[1.0, 0.7, 0.3]].concat() };
    let metallic = raster(5, 1, |x, _| if x == 4 { 1.0 } else { 0.0 });
    let plain = SpecularOptions { from: Polish::Gloss, model: SpecularModel::Phong, dielectric: 0.04, metal: None };
    let texels = |polish: &Raster, options: &SpecularOptions| -> Vec<[f32; 4]> {
        let map = specular_from(polish, options, &|_, _| {});
        map.values.chunks_exact(4).map(|t| [t[0], t[1], t[2], t[3]]).collect()
    };
    let same = |got: &[[f32; 4]], wanted: &[[f32; 4]]| {
        for (g, w) in got.iter().flatten().zip(wanted.iter().flatten()) {
            assert!((g - w).abs() < 1e-5, "{got:?}, wanted {wanted:?}");
        }
    };
    // Roughness 1, 0.5, 0.2, 0: α 1, 0.25, 0.04, 0; F0/(4·α²).
    let grey = |v: f32, gloss: f32| [v, v, v, gloss];
    let wanted = [grey(0.01, 0.0), grey(0.16, 0.5), grey(1.0, 0.8), grey(1.0, 1.0), grey(0.16, 0.5)];
    same(&texels(&gloss, &plain), &wanted);
    let roughness = raster(5, 1, |x, y| 1.0 - gloss.values[y * 5 + x]);
    same(&texels(&roughness, &SpecularOptions { from: Polish::Roughness, ..plain }), &wanted);
    let metal = SpecularOptions { metal: Some((&base, &metallic)), model: SpecularModel::SpecularGlossiness, ..plain };
    let f0 = |gloss: f32| grey(0.04, gloss);
    same(&texels(&gloss, &metal), &[f0(0.0), f0(0.5), f0(0.8), f0(1.0), [1.0, 0.7, 0.3, 0.5]]);
    let phong = SpecularOptions { model: SpecularModel::Phong, ..metal };
    same(&texels(&gloss, &phong)[4..], &[[1.0, 1.0, 1.0, 0.5]]);
}

/// The renderer perturbs normals by the height map itself; the normal map of the same height scale must lean the same
/// way by as much.
#[test]
fn the_renderer_agrees_with_the_normal_map_of_the_same_height_scale() {
    let Some(gpu) = common::gpu() else { return };
    let (side, scale, size) = (64, 0.1, 192);
    // Smooth, so that the two ways of taking differences hardly differ.
    let turn = |at: usize| at as f32 / side as f32 * std::f32::consts::TAU;
    let heights = raster(side, side, |x, y| 0.5 + 0.3 * turn(x).sin() + 0.2 * turn(y).cos());
    let picture = |technique: Technique| {
        let mut simulation = Simulation::new();
        let library = &mut *simulation.world.resource_mut::<Library>();
        let normal = normal_from_height(&heights, &options(scale, Edges::Wrap, Filter::Sobel), &|_, _| {});
        let normal_map = Some(add_map(library, "n", ImageKind::Normal, &normal, Bits::Sixteen));
        let height_map = Some(add_map(library, "h", ImageKind::Data, &heights, Bits::Sixteen));
        let material = Material { technique, normal_map, height_map, height_scale_uv: scale, ..Material::default() };
        let material = library.add_material(material);
        let plane = library.add_mesh(shapes::plane(Vec2::splat(2.0), UVec2::ONE));
        let facing = Transform::from_rotation(Quat::from_rotation_x(std::f32::consts::FRAC_PI_2));
        simulation.world.spawn((plane, material, facing));
        let camera = simulation.world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 3.0))).id();
        let settings = Settings { samples: 1, debug: DebugView::Normal, ..Settings::default() };
        let mut headless = Headless { renderer: SingleView::new(&gpu), settings };
        headless.draw(&mut simulation, camera, (size, size)).expect("a picture");
        let pixels = headless.renderer.read_linear().expect("linear colours");
        pixels.iter().map(|p| Vec3::new(p[0], p[1], p[2]) * 2.0 - 1.0).collect::<Vec<_>>()
    };
    let [mapped, perturbed, flat] = [Technique::Normal, Technique::PerturbedNormal, Technique::Off].map(picture);
    let (mut far, mut lean, mut count) = (0.0f32, 0.0f32, 0);
    for ((mapped, perturbed), flat) in mapped.iter().zip(&perturbed).zip(&flat).filter(|(_, flat)| flat.z > 0.99) {
        far = far.max(mapped.angle_between(*perturbed).to_degrees());
        lean = lean.max(mapped.angle_between(*flat).to_degrees());
        count += 1;
    }
    assert!(count > 20_000 && lean > 10.0, "{count} pixels lean up to {lean}°");
    // Between texels, heights rise straight and the map's slopes change straight: they differ by half of what a slope
    // changes from texel to texel, 0.0185 along u and 0.0124 along v: 0.64°. Half floats know two heights to 2⁻¹² each,
    // of 6.4 texels: 0.18°. Of a pixel's 106 steps of a weight's 8 bits one may be lost, of a slope of 0.2: 0.11°.
    // Normals as colours in half floats, √3 · 2⁻¹⁰ twice: 0.2°.
    assert!(far < 1.2, "{far}° apart");
}
