//! From the faces of a lens that bends to the camera's picture, on the CPU. Threads share rows; bits do not depend on
//! how many there are.
//!
//! Colours are bilinear in linear light; ids and normals are those of the nearest pixel of a face. Of depths, 1/z is
//! bilinear where the four pixels around show one entity: on a plane it is affine, so planes are exact. Elsewhere depth
//! is that of the nearest. The z of a face is turned into a point, and the camera's depth is that point's z. Where the
//! lens does not see there is nothing, in black.

use super::lens_map::{Face, LensMap, Place};
use super::pixels::{Pixels, WITH_DEPTH, linear};
use crate::renderer::Outputs;
use half::f16;
use systems::ecs::parallel::map_in_parallel;
use systems::sensors::CameraSensor;

/// The four pixels around a place, the upper ones first, and how far it is from the first toward the others.
struct Around {
    pixels: [usize; 4],
    along: [f32; 2],
}

/// Pixels of a face that are read for depths.
struct Depths {
    z: Vec<f32>,
    id: Vec<u32>,
}

impl Face {
    fn around(&self, [u, v]: [f32; 2]) -> Around {
        let (left, upper) = (u.floor(), v.floor());
        let first = upper as usize * self.size.0 as usize + left as usize;
        let below = first + self.size.0 as usize;
        Around { pixels: [first, first + 1, below, below + 1], along: [u - left, v - upper] }
    }

    fn nearest(&self, [u, v]: [f32; 2]) -> usize {
        (v + 0.5).floor() as usize * self.size.0 as usize + (u + 0.5).floor() as usize
    }

    /// Depth and range of what is at a place.
    fn depth(&self, at: [f32; 2], Depths { z, id }: &Depths) -> [f32; 2] {
        let around = self.around(at);
        let [first, ..] = around.pixels;
        let is_one = around.pixels.iter().all(|&pixel| id[pixel] == id[first]);
        let nearness = if is_one {
            bilinear(around.pixels.map(|pixel| 1.0 / f64::from(z[pixel])), around.along)
        } else {
            1.0 / f64::from(z[self.nearest(at)])
        };
        if nearness <= 0.0 {
            return [f32::INFINITY; 2];
        }
        let point = self.intrinsics.direction(at[0].into(), at[1].into()) / nearness;
        [(self.camera_from_face * point).z as f32, point.length() as f32]
    }
}

impl LensMap {
    /// The camera's pixels of what its faces drew.
    pub(super) fn resample(&self, sensor: &CameraSensor, drawn: &[Outputs]) -> Pixels {
        let mut pixels = Pixels::default();
        let colors: Vec<Vec<[f16; 3]>> = drawn.iter().map(|drawn| linear(drawn).collect()).collect();
        if colors.iter().any(|colors| !colors.is_empty()) {
            let color = |face: &Face, number: usize, at| {
                let around = face.around(at);
                let part = |part: usize| {
                    let values = around.pixels.map(|pixel| colors[number][pixel][part].to_f64());
                    f16::from_f64(bilinear(values, around.along))
                };
                [part(0), part(1), part(2)]
            };
            pixels.linear = self.map(drawn, [f16::ZERO; 3], color);
        }
        if sensor.outputs.has_any(&WITH_DEPTH) {
            let faces: Vec<Depths> =
                drawn.iter().map(|drawn| Depths { z: drawn.depths(), id: drawn.ids().collect() }).collect();
            let depth = |face: &Face, number: usize, at| face.depth(at, &faces[number]);
            let found = self.map(drawn, [f32::INFINITY; 2], depth);
            (pixels.depth, pixels.range) = found.into_iter().map(|[depth, range]| (depth, range)).unzip();
        }
        let normals: Vec<Vec<[f32; 3]>> = drawn.iter().map(Outputs::normals).collect();
        if normals.iter().any(|normals| !normals.is_empty()) {
            let normal = |face: &Face, number: usize, at| normals[number][face.nearest(at)];
            pixels.normal = self.map(drawn, [0.0; 3], normal);
        }
        pixels.id = self.ids(drawn);
        pixels
    }

    /// The camera's entity indices plus 1 of what its faces drew.
    pub fn ids(&self, drawn: &[Outputs]) -> Vec<u32> {
        let ids: Vec<Vec<u32>> = drawn.iter().map(|drawn| drawn.ids().collect()).collect();
        self.map(drawn, 0, |face, number, at| ids[number].get(face.nearest(at)).copied().unwrap_or(0))
    }

    /// A value for each pixel: of its face, the face's number, and the place in it; `unseen` where there is none.
    fn map<T: Copy + Send + Sync>(
        &self,
        drawn: &[Outputs],
        unseen: T,
        value: impl Fn(&Face, usize, [f32; 2]) -> T + Sync,
    ) -> Vec<T> {
        let of_place = |&Place { face, at }: &Place| {
            let number = face as usize;
            let face = self.faces.get(number).filter(|_| number < drawn.len());
            face.map_or(unseen, |face| value(face, number, at))
        };
        let rows = self.places.chunks(self.width().max(1) as usize);
        map_in_parallel(rows, |row| row.iter().map(of_place).collect::<Vec<T>>()).concat()
    }
}

/// Between the values of four pixels.
fn bilinear([a, b, c, d]: [f64; 4], [x, y]: [f32; 2]) -> f64 {
    let (x, y) = (f64::from(x), f64::from(y));
    let (upper, lower) = (a + (b - a) * x, c + (d - c) * x);
    upper + (lower - upper) * y
}
