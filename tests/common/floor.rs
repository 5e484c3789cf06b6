//! A white floor in the dark, seen from above: each sample of a picture is a known place, and how much of its light it
//! has is one picture over another.

use super::prelude::*;

/// Pixels along a side.
pub const SIDE: u32 = 200;
/// Pixels along the side of a picture, and texels along the side of the shadow layers that it has.
pub const SHADOW_SIDES: [(u32, f64); 3] = [(SIDE, 768.0), (140, 384.0), (70, 192.0)];
/// Metres from the middle of the picture to its edge.
pub const HALF: f32 = 2.5;

/// A white, matte floor of 8 m in the dark, seen from above.
pub struct Floor {
    pub simulation: Simulation,
    pub camera: Entity,
    pub cube: MeshId,
    pub white: MaterialId,
    /// Pixels along a side of its pictures.
    pub pixels: u32,
}

impl Floor {
    pub fn new() -> Self {
        Self::of_squares(1)
    }

    /// The floor is a grid of so many squares along each side.
    pub fn of_squares(squares: u32) -> Self {
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(super::dark());
        let mut library = simulation.world.resource_mut::<Library>();
        let white = Material { specular_factor: Vec3::ZERO, ..Material::new(Shading::Blinn) };
        let white = library.add_material(white);
        let floor = library.add_mesh(shapes::plane(glam::Vec2::splat(8.0), glam::UVec2::splat(squares)));
        let cube = library.add_mesh(shapes::cube(Vec3::ONE));
        simulation.world.spawn((floor, white, Transform::default()));
        let projection = Projection::Orthographic { half_height: HALF, aspect: Some(1.0) };
        let above = Transform::from_xyz(0.0, 9.0, 0.0).looking_to(Vec3::NEG_Y, Vec3::NEG_Z);
        let camera = simulation.world.spawn((Camera { projection, ..Camera::default() }, above)).id();
        Self { simulation, camera, cube, white, pixels: SIDE }
    }

    pub fn add_cube(&mut self, place: Transform) -> Entity {
        self.simulation.world.spawn((self.cube, self.white, place)).id()
    }

    pub fn add_light(&mut self, light: Light, at: Vec3, toward: Vec3) -> Entity {
        let up = if toward.normalize().y.abs() > 0.99 { Vec3::X } else { Vec3::Y };
        self.simulation.world.spawn((light, Transform::from_translation(at).looking_to(toward, up))).id()
    }

    /// Luminances of a picture with at most so many shadow maps.
    pub fn draw(&mut self, headless: &mut Headless, maps: u32) -> Vec<f32> {
        headless.settings.shadow_maps = maps;
        headless.draw(&mut self.simulation, self.camera, (self.pixels, self.pixels)).expect("a picture");
        headless.renderer.read_linear().expect("drawn").into_iter().map(|[_, green, ..]| green).collect()
    }

    /// Share of its light that each pixel has, with its place on the floor, metres. Without pixels that are dark even
    /// without shadows.
    pub fn shares(&mut self, headless: &mut Headless) -> Vec<(DVec2, f32)> {
        let (open, shadowed) = (self.draw(headless, 0), self.draw(headless, 32));
        let lit = (0..).zip(open.iter().zip(&shadowed)).filter(|(_, (open, _))| **open > 1e-3);
        lit.map(|(pixel, (open, shadowed))| (place_of(pixel, self.pixels), shadowed / open)).collect()
    }
}

/// A point light that casts shadows.
pub fn lamp(intensity: f32) -> Light {
    Light::point(intensity, 20.0).with_attenuation(Light::INVERSE_SQUARE).with_shadows()
}

/// One sample per pixel.
pub fn headless(gpu: &Gpu) -> Headless {
    let settings = Settings { samples: 1, ..Settings::default() }.for_files();
    Headless { renderer: SingleView::new(gpu), settings }
}

/// Place of a pixel's centre on the floor, metres, in a picture of so many pixels along a side.
fn place_of(pixel: u32, side: u32) -> DVec2 {
    let at = DVec2::new(f64::from(pixel % side) + 0.5, f64::from(pixel / side) + 0.5) / f64::from(side);
    (at * 2.0 - 1.0) * f64::from(HALF)
}

/// Tells if the segment between two points misses the cube of 1 m on the middle of the floor.
pub fn is_free(from: DVec3, to: DVec3) -> bool {
    let (low, high) = (DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.5, 1.0, 0.5));
    let (first, second) = ((low - from) / (to - from), (high - from) / (to - from));
    let (enter, leave) = (first.min(second).max_element(), first.max(second).min_element());
    // Not the point itself, on a face.
    enter.max(1e-6) > leave.min(1.0)
}

/// Tells if a place is within the footprint of the cube on the middle of the floor.
fn on_cube(at: DVec2) -> bool {
    at.abs().max_element() < 0.5
}

/// Compares shares of light with what geometry says of the shadow of that cube, but where an edge is nearer than a
/// margin. Returns how many pixels are dark, lit and unsure.
pub fn check_edges(
    shares: &[(DVec2, f32)],
    is_lit: impl Fn(DVec2) -> bool,
    margin: impl Fn(DVec2) -> f64,
    name: &str,
) -> [usize; 3] {
    let mut counts = [0; 3];
    for &(place, share) in shares {
        // Where shadow and cube meet, the shadow goes on into it.
        let is_like = |at: DVec2| if is_lit(place) { is_lit(at) && !on_cube(at) } else { on_cube(at) || !is_lit(at) };
        let (offsets, margin) = ([-1.0, -0.5, 0.0, 0.5, 1.0], margin(place));
        let around = offsets.map(|x| offsets.map(|y| place + margin * DVec2::new(x, y)));
        if on_cube(place) || !around.iter().flatten().all(|&at| is_like(at)) {
            counts[2] += 1;
            continue;
        }
        let expected = f32::from(u8::from(is_lit(place)));
        // Half floats: a part in 2¹⁰.
        assert!((share - expected).abs() < 1e-3, "{name}: {place} has {share} of {expected}");
        counts[usize::from(is_lit(place))] += 1;
    }
    counts
}
