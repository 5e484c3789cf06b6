//! A stage for bump techniques: objects under a light of each kind, and every map of a height field given by a formula.

use super::prelude::*;
use std::f32::consts::{FRAC_PI_2, TAU};

/// A world in the dark with a camera at +Z, and what draws it.
pub struct Stage {
    pub simulation: Simulation,
    pub headless: Headless,
    pub camera: Entity,
    pub size: (u32, u32),
}

impl Stage {
    /// Looks from (0, 0, 3) at the origin, in perspective; one sample per pixel. `None` without an adapter.
    pub fn new(size: (u32, u32)) -> Option<Self> {
        let gpu = super::gpu()?;
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(super::dark());
        let camera = simulation.world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 3.0))).id();
        let settings = Settings { samples: 1, ..Settings::default() };
        Some(Self { simulation, headless: Headless { renderer: SingleView::new(&gpu), settings }, camera, size })
    }

    /// A parallel projection that shows `half_height` metres up and down from the origin.
    pub fn orthographic(&mut self, half_height: f32) {
        let mut camera = self.simulation.world.get_mut::<Camera>(self.camera).expect("a camera");
        camera.projection = Projection::Orthographic { half_height, aspect: None };
    }

    /// A directional light, a point light and a spot, none of them from the front.
    pub fn three_lights(&mut self) -> [Entity; 3] {
        let sun = Light::directional(0.5).with_color(Vec3::new(1.0, 0.9, 0.8));
        let lamp = Light::point(1.2, 8.0).with_color(Vec3::new(0.3, 0.5, 1.0));
        let spot = Light::spot(3.0, 9.0, 0.6).with_color(Vec3::new(0.4, 1.0, 0.4));
        let from = |at: Vec3| Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y);
        let lamp = Light { ambient: Vec3::new(0.02, 0.03, 0.05), ..lamp };
        let lights = [(sun, from(Vec3::new(-2.0, 1.0, 1.5))), (lamp, from(Vec3::new(1.2, 0.9, 0.9)))];
        let [sun, lamp] = lights.map(|light| self.simulation.world.spawn(light).id());
        [sun, lamp, self.simulation.world.spawn((spot, from(Vec3::new(-0.6, -1.6, 1.4)))).id()]
    }

    pub fn spawn(&mut self, mesh: Mesh, material: Material, at: Transform) -> Entity {
        let mut library = self.simulation.world.resource_mut::<Library>();
        let (mesh, material) = (library.add_mesh(mesh), library.add_material(material));
        self.simulation.world.spawn((mesh, material, at)).id()
    }

    /// Linear colours.
    pub fn linear(&mut self) -> Vec<Vec4> {
        self.headless.draw(&mut self.simulation, self.camera, self.size).expect("a picture");
        let pixels = self.headless.renderer.read_linear().expect("linear colours");
        pixels.into_iter().map(Vec4::from_array).collect()
    }

    /// The picture's bytes.
    pub fn picture(&mut self) -> image::RgbaImage {
        self.headless.draw(&mut self.simulation, self.camera, self.size).expect("a picture")
    }

    /// Shading normals, world space; zero where nothing is.
    pub fn normals(&mut self) -> Vec<Vec3> {
        self.linear();
        let outputs =
            self.headless.renderer.draw_outputs(OutputSet { normal: true, ..OutputSet::NONE }).expect("outputs");
        let normals = outputs.normals();
        normals.into_iter().map(Vec3::from_array).collect()
    }

    /// Rectangle of that size in the plane z = 0; its image is upright and faces the camera.
    pub fn facing(size: Vec2) -> (Mesh, Transform) {
        (shapes::plane(size, UVec2::ONE), Transform::from_rotation(glam::Quat::from_rotation_x(FRAC_PI_2)))
    }

    pub fn add(&mut self, image: Image) -> Option<Map> {
        Some(Map::new(self.simulation.world.resource_mut::<Library>().add_image(image)))
    }

    /// A material with all the maps of a periodic height field, `height(u, v)` in 0..1.
    pub fn material(&mut self, side: usize, scale: f32, height: impl Fn(f32, f32) -> f32) -> Material {
        let maps = Maps::new(side, scale, height);
        let wide = |name: &str, texels: &[Vec4], kind| Image::rgba16(name, side as u32, side as u32, kind, texels);
        let data = |name: &str, texels: &[Vec4]| wide(name, texels, ImageKind::Data);
        Material {
            normal_map: self.add(wide("normal", &maps.normal, ImageKind::Normal)),
            height_map: self.add(data("height", &maps.height)),
            horizon_maps: [
                self.add(data("horizon 0", &maps.horizon[0])),
                self.add(data("horizon 1", &maps.horizon[1])),
            ],
            offset_map: self.add(data("offset", &maps.offset)),
            height_scale_uv: scale,
            specular_factor: Vec3::splat(0.4),
            shininess: 12.0,
            ..Material::default()
        }
    }
}

/// The maps of a height field, texel by texel.
pub struct Maps {
    pub height: Vec<Vec4>,
    pub normal: Vec<Vec4>,
    pub horizon: [Vec<Vec4>; 2],
    pub offset: Vec<Vec4>,
}

impl Maps {
    pub fn new(side: usize, scale: f32, height: impl Fn(f32, f32) -> f32) -> Self {
        let at = |x: usize, y: usize| height((x as f32 + 0.5) / side as f32, (y as f32 + 0.5) / side as f32);
        let heights: Vec<f32> = (0..side * side).map(|i| at(i % side, i / side)).collect();
        let texel = |x: isize, y: isize| {
            heights[y.rem_euclid(side as isize) as usize * side + x.rem_euclid(side as isize) as usize]
        };
        // Metres of height over metres of ground, per texel.
        let steepness = scale * side as f32;
        let each = |f: &dyn Fn(isize, isize) -> Vec4| -> Vec<Vec4> {
            (0..(side * side) as isize).map(|i| f(i % side as isize, i / side as isize)).collect()
        };
        let slope = |x, y| {
            let right = (texel(x + 1, y) - texel(x - 1, y)) * 0.5 * steepness;
            let up = (texel(x, y - 1) - texel(x, y + 1)) * 0.5 * steepness;
            Vec2::new(right, up)
        };
        let normal = |x, y| {
            let n = (-slope(x, y)).extend(1.0).normalize();
            (n * 0.5 + 0.5).extend(1.0)
        };
        let offset = |x, y| {
            let d = (-slope(x, y)).clamp(Vec2::NEG_ONE, Vec2::ONE);
            ((d * 127.0 + 128.0) / 255.0).extend(0.0).extend(1.0)
        };
        let elevation = |x: isize, y: isize, eighth: usize| {
            let (sin, cos) = (eighth as f32 * TAU / 8.0).sin_cos();
            let along = |t: f32| texel(x + (cos * t).round() as isize, y - (sin * t).round() as isize);
            let rise = |t: usize| {
                let t = t as f32;
                let distance = (cos * t).round().hypot((sin * t).round());
                (along(t) - texel(x, y)) * steepness / distance
            };
            (1..side).map(rise).fold(0.0, f32::max).atan() / FRAC_PI_2
        };
        let four = |first: usize| {
            move |x, y| Vec4::from_array(std::array::from_fn(|channel| elevation(x, y, first + channel)))
        };
        Self {
            height: heights.iter().map(|&h| Vec4::new(h, h, h, 1.0)).collect(),
            normal: each(&normal),
            horizon: [each(&four(0)), each(&four(4))],
            offset: each(&offset),
        }
    }
}

/// Round hills without symmetry, 0..1, periodic.
pub fn hills(u: f32, v: f32) -> f32 {
    let wave = (TAU * u).sin() * (TAU * 2.0 * v).cos() + 0.5 * (TAU * (2.0 * u + v)).sin();
    (0.5 + wave / 3.0).clamp(0.0, 1.0)
}

/// The largest difference of two pictures in a channel, 0..255, and how many pixels differ by more than `allowed`.
pub fn difference(a: &image::RgbaImage, b: &image::RgbaImage, allowed: u8) -> (u8, usize) {
    assert_eq!(a.dimensions(), b.dimensions());
    let of = |(a, b): (&image::Rgba<u8>, &image::Rgba<u8>)| {
        a.0.iter().zip(b.0).map(|(&a, b)| a.abs_diff(b)).max().unwrap_or_default()
    };
    let all = || a.pixels().zip(b.pixels()).map(of);
    (all().max().unwrap_or_default(), all().filter(|&far| far > allowed).count())
}
