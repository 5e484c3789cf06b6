//! The directions that corners look in, and what they weigh under a sky.

use crate::weather::sky::{LUMINANCE, Sky};
use crate::weather::sky_map::{SIDE, hemisphere, middle, solid_angle};
use glam::{DVec3, Vec3};
use half::f16;

/// Number of directions, of equal solid angles.
pub const DIRECTIONS: usize = 256;
/// Axes along which openness is kept: +X, −X, +Z, −Z and +Y. Nothing of the sky is below.
pub const AXES: usize = 5;

/// Turn from each direction to the next, radians: the golden angle.
const TURN: f64 = 2.399_963_229_728_653;

/// Directions that are open: a bit each.
pub type Bits = [u64; DIRECTIONS / 64];

/// The direction of a number: a unit vector of the upper half.
pub fn direction(number: usize) -> DVec3 {
    let y = (number as f64 + 0.5) / DIRECTIONS as f64;
    let (sin, cos) = (TURN * number as f64).sin_cos();
    let flat = (1.0 - y * y).sqrt();
    DVec3::new(flat * cos, y, flat * sin)
}

/// All directions.
pub fn directions() -> [Vec3; DIRECTIONS] {
    std::array::from_fn(|number| direction(number).as_vec3())
}

/// Share of each direction in the light that the sky sends along each axis; 1 together along each.
#[derive(Clone, PartialEq, Debug)]
pub struct Weights {
    /// Sums over the bits of a byte, by byte of [`Bits`] and value.
    of_bytes: Vec<[f32; AXES]>,
}

/// Texels of the map that are one for the weights, along a side.
const TOGETHER: usize = 4;

impl Weights {
    /// Weights under a sky: the light of what is nearest to each direction.
    pub fn of(sky: &Sky) -> Self {
        let all: [DVec3; DIRECTIONS] = std::array::from_fn(direction);
        let axes = [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z, DVec3::Y];
        let mut weights = [[0.0; AXES]; DIRECTIONS];
        let side = SIDE / TOGETHER;
        for i in 0..side * side {
            let at = middle(i, side);
            let toward = hemisphere(at);
            let (x, y) = (i % side * TOGETHER, i / side * TOGETHER);
            let texel = |k: usize| &sky.map.hemisphere[(y + k / TOGETHER) * SIDE + x + k % TOGETHER];
            let color = |k: usize| DVec3::from_array([0, 1, 2].map(|c| f16::from_bits(texel(k)[c]).to_f64()));
            let luminance = (0..TOGETHER * TOGETHER).map(|k| color(k).dot(LUMINANCE)).sum::<f64>();
            let light = luminance * solid_angle(at, side);
            let nearest = (0..DIRECTIONS).max_by(|a, b| all[*a].dot(toward).total_cmp(&all[*b].dot(toward)));
            let own = &mut weights[nearest.unwrap_or(0)];
            own.iter_mut().zip(axes).for_each(|(own, axis)| *own += light * toward.dot(axis).max(0.0));
        }
        let sums: [f64; AXES] = std::array::from_fn(|axis| weights.iter().map(|own| own[axis]).sum::<f64>().max(1e-30));
        let of_byte = |index: usize| {
            let (byte, value) = (index / 256, index % 256);
            let set = (0..8).filter(|bit| value >> bit & 1 == 1).map(|bit| weights[8 * byte + bit]);
            set.fold([0.0; AXES], |sum, own| std::array::from_fn(|axis| sum[axis] + own[axis]))
        };
        let sums_of = |index| std::array::from_fn(|axis| (of_byte(index)[axis] / sums[axis]) as f32);
        Self { of_bytes: (0..DIRECTIONS / 8 * 256).map(sums_of).collect() }
    }

    /// Openness along the axes, 0 to 1.
    pub fn openness(&self, bits: &Bits) -> [f32; AXES] {
        let bytes = bits.iter().flat_map(|word| word.to_le_bytes()).enumerate();
        bytes.fold([0.0; AXES], |sum, (byte, value)| {
            let own = &self.of_bytes[256 * byte + usize::from(value)];
            std::array::from_fn(|axis| sum[axis] + own[axis])
        })
    }
}
