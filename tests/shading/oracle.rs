//! Bump-mapped shading against images that an independent float64 program made, and known answers of our own.

use crate::common::{self, prelude::*};
use relief::import;
use systems::assets::{Filter, MipFilter, Sampler, Wrap};

fn number(value: &Value) -> f32 {
    value.as_f64().expect("a number") as f32
}

fn vec3(value: &Value) -> Vec3 {
    Vec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

fn material(case: &Value, folder: &Path, library: &mut Library) -> Material {
    let m = &case["material"];
    let wrap = match m["sampler"]["wrap"].as_str().expect("a wrap mode") {
        "clamp" => Wrap::Clamp,
        "mirror" => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    let filter = if m["sampler"]["filter"] == "nearest" { Filter::Nearest } else { Filter::Linear };
    let sampler = Sampler { wrap_u: wrap, wrap_v: wrap, mag: filter, min: filter, mip: MipFilter::None };
    let mut map = |name: &str, kind| {
        let file = m[name].as_str()?;
        let image = import::load_image(&folder.join(file), kind).expect("an image of the oracle");
        Some(Map { sampler, ..Map::new(library.add_image(image)) })
    };
    let base_kind = if m["base_map_srgb"] == true { ImageKind::Color } else { ImageKind::Data };
    Material {
        shading: if case["specular_model"] == "blinn" { Shading::Blinn } else { Shading::Phong },
        base_map: map("base_map", base_kind),
        normal_map: map("normal_map", ImageKind::Normal),
        specular_map: map("specular_map", ImageKind::Data),
        base_factor: (vec3(&m["base_factor"]) * number(&m["kd"])).extend(1.0),
        specular_factor: vec3(&m["specular_factor"]) * number(&m["ks"]),
        shininess: number(&m["shininess"]),
        normal_scale: number(&m["normal_scale"]),
        ..Material::default()
    }
}

fn light(case: &Value) -> (Light, Transform) {
    let vector = |name: &str| case.get(name).map(vec3);
    let direction = vector("direction").unwrap_or(Vec3::NEG_Z).normalize();
    let kind = match case["type"].as_str() {
        Some("directional") => LightKind::Directional,
        Some("spot") => LightKind::Spot {
            outer: number(&case["cutoff_deg"]).to_radians(),
            inner: None,
            exponent: number(&case["exponent"]),
        },
        _ => LightKind::Point,
    };
    let light = Light {
        kind,
        color: vec3(&case["color"]),
        attenuation: vector("attenuation").unwrap_or(Vec3::X),
        ..Light::point(number(&case["intensity"]), f32::INFINITY)
    };
    let turned = Quat::from_rotation_arc(Vec3::NEG_Z, direction);
    (light, Transform::from_translation(vector("position").unwrap_or_default()).with_rotation(turned))
}

/// The case as the renderer shades it: linear RGBA, row by row.
fn render(gpu: &Gpu, case: &Value, folder: &Path) -> Vec<[f32; 4]> {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let model = import::load_model(&folder.join("mesh.glb"), &mut library).expect("the oracle's mesh");
    let material = material(case, folder, &mut library);
    let material = library.add_material(material);
    let mesh = model.nodes.iter().find_map(|node| node.parts.first()).expect("a mesh").0;
    let place = &case["model"];
    let rotation = &place["rotation_xyzw"];
    let transform = Transform {
        translation: vec3(&place["translation"]),
        rotation: Quat::from_xyzw(
            number(&rotation[0]),
            number(&rotation[1]),
            number(&rotation[2]),
            number(&rotation[3]),
        ),
        scale: vec3(&place["scale"]),
    };
    simulation.world.spawn((mesh, material, transform));
    for value in case["lights"].as_array().expect("lights") {
        simulation.world.spawn(light(value));
    }
    let black = Environment {
        ambient: vec3(&case["ambient"]),
        zenith: Vec3::ZERO,
        horizon: Vec3::ZERO,
        ground: Vec3::ZERO,
        exposure: 1.0,
        tone_map: ToneMap::Clamp,
        ..Environment::default()
    };
    simulation.world.insert_resource(black);
    simulation.frame();

    let c = &case["camera"];
    let fov_y = number(&c["fovy_deg"]).to_radians();
    let camera = Camera {
        projection: Projection::Perspective { fov_y, aspect: None },
        near: number(&c["near"]),
        far: f32::INFINITY,
    };
    let eye = Transform::from_translation(vec3(&c["position"])).looking_at(vec3(&c["target"]), vec3(&c["up"]));
    let (width, height) = (number(&case["resolution"][0]) as u32, number(&case["resolution"][1]) as u32);
    let view = View::new(&eye.compute_affine(), &camera, width, height);
    let mut renderer = SingleView::new(gpu);
    let settings = Settings { samples: 1, ..Settings::default() };
    simulation.with_frame(|frame| renderer.prepare(frame, &view, &settings)).expect("it fits");
    renderer.draw_picture();
    renderer.read_linear().expect("linear colours")
}

/// The data of a little-endian .npy file.
fn npy(path: &Path) -> Vec<u8> {
    let bytes = std::fs::read(path).expect("an .npy file");
    let header = u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
    bytes[10 + header..].to_vec()
}

#[test]
fn shading_agrees_with_the_independent_reference() {
    let (Some(gpu), Some(data)) = (common::gpu(), common::test_data()) else { return };
    let mut cases = 0;
    for entry in std::fs::read_dir(data.join("oracle")).expect("the oracle").flatten() {
        let folder = entry.path();
        let Ok(text) = std::fs::read_to_string(folder.join("case.json")) else { continue };
        let case: Value = serde_json::from_str(&text).expect("a case");
        let reference: Vec<f32> = npy(&folder.join("linear.npy"))
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        let interior = npy(&folder.join("interior_mask.npy"));
        let ours = render(&gpu, &case, &folder);
        let mut errors: Vec<f32> = Vec::new();
        for (i, pixel) in ours.iter().enumerate().filter(|(i, _)| interior[*i] == 1) {
            errors.extend((0..3).map(|c| (pixel[c] - reference[4 * i + c]).abs()));
        }
        errors.sort_by(f32::total_cmp);
        let at = |share: f64| errors[((errors.len() - 1) as f64 * share) as usize];
        let (median, p99) = (at(0.5), at(0.99));
        println!("{}: {} values, median {median:.5}, p99 {p99:.5}, max {:.5}", case["name"], errors.len(), at(1.0));
        assert!(errors.len() > 10_000, "the object is in the picture");
        // Half floats below 1, 2⁻¹⁰ at worst, and as much for weights of 8 bits in diffuse light. Where texels lean
        // apart by 0.3, such weights move a normal by 0.0017 along both axes, and a highlight by twice that; one of 24
        // · 0.8 changes by 2.4 in a radian, and lights add up to less than 2.
        assert!(median <= 0.002 && p99 <= 0.02, "{}: median {median}, p99 {p99}", case["name"]);
        cases += 1;
    }
    assert_eq!(cases, 3);
}
