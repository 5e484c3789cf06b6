//! Colours for values of sensors, 8-bit sRGB.

use crate::renderer::DebugView;
use glam::Vec3;
use systems::assets::color::srgb_from_linear;
use systems::sensors::{Class, Classes};

/// The values that colours stand for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Scale {
    /// At one end.
    pub least: f32,
    /// At the other.
    pub most: f32,
    /// Behind a number.
    pub unit: &'static str,
    /// True for distances: by their logarithm, the nearer the brighter.
    pub is_of_distances: bool,
}

impl Scale {
    /// Scale of the distances that are there, metres; `None` where there is none.
    pub fn of_distances(metres: impl IntoIterator<Item = f32>) -> Option<Self> {
        let there = metres.into_iter().filter(|metres| metres.is_finite() && *metres > 0.0);
        let (least, most) = ends(there)?;
        Some(Self { least, most, unit: " m", is_of_distances: true })
    }

    /// Scale of amounts in a unit; `None` where there is none.
    pub fn of_amounts(amounts: impl IntoIterator<Item = f32>, unit: &'static str) -> Option<Self> {
        let (least, most) = ends(amounts.into_iter().filter(|amount| amount.is_finite()))?;
        Some(Self { least, most, unit, is_of_distances: false })
    }

    /// The colour of a value; those beyond the ends have theirs. Black for what is no distance.
    pub fn color(&self, value: f32) -> [u8; 3] {
        match self.is_of_distances {
            true if !(value.is_finite() && value > 0.0) => [0; 3],
            true => self.color_at((value / self.least).ln() / (self.most / self.least).ln()),
            false => self.color_at((value - self.least) / (self.most - self.least)),
        }
    }

    /// The colour of a place on the scale: 0 is the least, 1 the most.
    pub fn color_at(&self, place: f32) -> [u8; 3] {
        // A scale of one value has 0/0.
        let place = if place.is_nan() { 0.0 } else { place };
        viridis(if self.is_of_distances { 1.0 - place } else { place })
    }

    /// The value at a place on the scale.
    pub fn value_at(&self, place: f32) -> f32 {
        if self.is_of_distances {
            self.least * (self.most / self.least).powf(place)
        } else {
            self.least + (self.most - self.least) * place
        }
    }
}

/// The least and the most of some values.
fn ends(values: impl Iterator<Item = f32>) -> Option<(f32, f32)> {
    values.map(|value| (value, value)).reduce(|(least, most), (value, _)| (least.min(value), most.max(value)))
}

/// Viridis by S. van der Walt and N. Smith (matplotlib, CC0) at eighths of its way, dark to bright; lines in between.
pub(super) const VIRIDIS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];

/// The darkest entry that is used: what is darker can hardly be told from black, which is nothing.
const DARKEST: usize = 1;

/// 8-bit sRGB of a place from 0, dark, to 1, bright.
fn viridis(place: f32) -> [u8; 3] {
    let last = VIRIDIS.len() - 1;
    let along = DARKEST as f32 + place.clamp(0.0, 1.0) * (last - DARKEST) as f32;
    let below = (along as usize).min(last - 1);
    let [from, to] = [VIRIDIS[below], VIRIDIS[below + 1]].map(|rgb| Vec3::from(rgb.map(f32::from)));
    from.lerp(to, along - below as f32).to_array().map(|value| value.round() as u8)
}

/// A colour for a number, 8-bit sRGB. 0 is black; neighbours lie far apart.
pub fn rgb_of_number(number: u32) -> [u8; 3] {
    if number == 0 { [0; 3] } else { srgb(DebugView::cell_color(number).to_array()) }
}

/// The colour of a class, 8-bit sRGB: its own, or where that is black, of its number.
pub fn rgb_of_class(class: u8, classes: &Classes) -> [u8; 3] {
    let own = classes.get(Class(class)).map(|info| info.color);
    own.filter(|color| *color != [0; 3]).unwrap_or_else(|| rgb_of_number(class.into()))
}

/// Things by their numbers, stuff by its class.
pub(super) fn rgb_of_panoptic(number: u32, classes: &Classes) -> [u8; 3] {
    u8::try_from(number).map_or_else(|_| rgb_of_number(number), |class| rgb_of_class(class, classes))
}

/// A way over the picture: right is red, down yellow-green, left cyan, up violet, the brighter the longer.
pub(super) fn rgb_of_shift([right, down]: [f32; 2], longest: f32) -> [u8; 3] {
    let brightness = if longest > 0.0 { right.hypot(down) / longest } else { 0.0 };
    let turn = down.atan2(right) / std::f32::consts::TAU;
    // Of a colour circle, each a third of it further (HSV with full saturation).
    let part = |third: f32| ((6.0 * (turn + third).rem_euclid(1.0) - 3.0).abs() - 1.0).clamp(0.0, 1.0);
    [0.0, 2.0 / 3.0, 1.0 / 3.0].map(|third| (255.0 * brightness * part(third)).round() as u8)
}

/// Colour of linear light.
pub(super) fn srgb(linear: [f32; 3]) -> [u8; 3] {
    linear.map(|value| (srgb_from_linear(value.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_go_from_bright_to_dark_by_their_logarithm() {
        // From the brightest entry to the darkest that is used there are seven steps, and seven times 2 is 128.
        let scale = Scale::of_distances([f32::INFINITY, 128.0, 0.0, 1.0, 8.0]).expect("three are there");
        assert_eq!((scale.least, scale.most), (1.0, 128.0));
        let colors = [1.0, 8.0, 128.0, 1000.0, f32::INFINITY, 0.0, f32::NAN].map(|metres| scale.color(metres));
        let [bright, third, dark] = [VIRIDIS[8], VIRIDIS[5], VIRIDIS[1]];
        assert_eq!(colors, [bright, third, dark, dark, [0; 3], [0; 3], [0; 3]]);
        // A place of 3/7 rounds by 2⁻²⁶, which the power makes 8 · ln 128 times as much; it rounds itself.
        assert!((scale.value_at(3.0 / 7.0) - 8.0).abs() < 1e-5);
        assert_eq!(Scale::of_distances([f32::INFINITY, 0.0]), None);
        let one = Scale::of_distances([7.0]).expect("one is there");
        assert_eq!((one.color(7.0), one.value_at(1.0)), (bright, 7.0));
    }

    #[test]
    fn amounts_go_from_dark_to_bright() {
        let scale = Scale::of_amounts([-2.0, 5.0, f32::NAN], " m").expect("two are there");
        let colors = [-3.0, -2.0, 2.0, 5.0, 7.0].map(|value| scale.color(value));
        assert_eq!(colors, [VIRIDIS[1], VIRIDIS[1], VIRIDIS[5], VIRIDIS[8], VIRIDIS[8]]);
        assert_eq!((scale.value_at(0.5), Scale::of_amounts([f32::NAN], "")), (1.5, None));
    }
}
