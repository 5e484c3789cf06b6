//! A square in the dark before a camera: what one pixel of it must be can be worked out by hand.

use super::bumps::Stage;
use super::prelude::*;

pub const SIZE: u32 = 17;

/// A square of 2 m that faces the camera, 3 m away, in the dark.
pub struct Square {
    pub simulation: Simulation,
    pub headless: Headless,
    pub camera: Entity,
    pub square: Entity,
}

impl Square {
    pub fn new(material: Material) -> Option<Self> {
        let Stage { mut simulation, headless, camera, .. } = Stage::new((SIZE, SIZE))?;
        let mut library = simulation.world.resource_mut::<Library>();
        let mesh = library.add_mesh(shapes::plane(Vec2::splat(2.0), UVec2::ONE));
        let material = library.add_material(material);
        let facing = Transform::from_rotation(Quat::from_rotation_x(std::f32::consts::FRAC_PI_2));
        let square = simulation.world.spawn((mesh, material, facing)).id();
        Some(Self { simulation, headless, camera, square })
    }

    pub fn light(&mut self, light: Light, place: Transform) -> Entity {
        self.simulation.world.spawn((light, place)).id()
    }

    pub fn add_image(&mut self, image: Image) -> Map {
        Map::new(self.simulation.world.resource_mut::<Library>().add_image(image))
    }

    pub fn edit(&mut self, edit: impl FnOnce(&mut Material)) {
        let id = *self.simulation.world.get::<MaterialId>(self.square).expect("a material");
        assert!(self.simulation.world.resource_mut::<Library>().edit_material(id, edit));
    }

    /// The middle pixel, linear.
    pub fn middle(&mut self) -> Vec4 {
        self.headless.draw(&mut self.simulation, self.camera, (SIZE, SIZE)).expect("a picture");
        let pixels = self.headless.renderer.read_linear().expect("linear colours");
        Vec4::from_array(pixels[(SIZE * SIZE / 2) as usize])
    }

    /// The middle pixel of the picture.
    pub fn middle_byte(&mut self) -> [u8; 4] {
        let picture = self.headless.draw(&mut self.simulation, self.camera, (SIZE, SIZE)).expect("a picture");
        picture.get_pixel(SIZE / 2, SIZE / 2).0
    }

    /// Drivers encode sRGB to 0.6 of a step (Direct3D 11.3 functional specification, 3.2.3.7); what is wanted is
    /// rounded by half of one. So whole steps differ by one at most.
    #[track_caller]
    pub fn assert_byte_near(&mut self, wanted: [u8; 4]) {
        let got = self.middle_byte();
        assert!(got.iter().zip(wanted).all(|(g, w)| g.abs_diff(w) <= 1), "got {got:?}, wanted {wanted:?}");
    }
}

/// Half of what is allowed are the half floats of the target: 2⁻¹⁰ of a value, for Vulkan lets drivers round toward 0.
/// The other half is 2¹⁴ roundings of 2⁻²⁴, of which a pixel has some hundreds; `log2` is off by 2⁻²¹, and by that
/// times its exponent `pow` (Vulkan, "Precision and Operation of SPIR-V Instructions"). The square lies evenly about
/// the middle pixel, so that rounding its corners does not move that.
#[track_caller]
pub fn assert_near(got: Vec4, wanted: Vec3) {
    let error = (got.truncate() - wanted).abs().max_element();
    assert!(error <= 2e-3 * wanted.max_element().max(1.0), "got {got}, wanted {wanted}");
}

pub fn matte(base: Vec3) -> Material {
    Material { base_factor: base.extend(1.0), specular_factor: Vec3::ZERO, ..Material::default() }
}

/// From the camera to the square.
pub fn head_on() -> Transform {
    Transform::from_xyz(0.0, 0.0, 3.0)
}
