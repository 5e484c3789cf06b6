//! Gaussian blur of one channel: two passes, along rows and along columns, out to three standard deviations.

use super::{Edges, Raster};

/// The first channel blurred with a standard deviation of `sigma` texels; unchanged where it is 0. `done` is told the
/// rows finished, of twice as many as there are.
pub(super) fn gaussian(of: &Raster, sigma: f32, edges: Edges, done: &(dyn Fn(usize) + Sync)) -> Raster {
    let kernel = kernel(sigma);
    let reach = kernel.len() as isize / 2;
    let size = (of.width, of.height, 1);
    let rows = Raster::from_rows(
        size,
        |y, row| {
            let padded: Vec<f32> =
                (-reach..of.width as isize + reach).map(|x| of.at(x, y as isize, 0, edges)).collect();
            for (weight, from) in kernel.iter().zip(padded.windows(row.len())) {
                add(row, *weight, from);
            }
        },
        done,
    );
    Raster::from_rows(
        size,
        |y, row| {
            for (k, weight) in kernel.iter().enumerate() {
                let from = edges.inside(y as isize + k as isize - reach, of.height);
                add(row, *weight, &rows.values[from * of.width..][..of.width]);
            }
        },
        &|rows| done(of.height + rows),
    )
}

fn add(row: &mut [f32], weight: f32, from: &[f32]) {
    row.iter_mut().zip(from).for_each(|(to, from)| *to += weight * from);
}

/// Odd in number, of sum 1.
fn kernel(sigma: f32) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as i32;
    let weight = |k: i32| if k == 0 { 1.0 } else { (-0.5 * (k as f64 / f64::from(sigma)).powi(2)).exp() };
    let sum: f64 = (-reach..=reach).map(weight).sum();
    (-reach..=reach).map(|k| (weight(k) / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_a_bell_of_sum_one_that_wraps() {
        let mut point = Raster::new(16, 12, 1);
        point.values[0] = 1.0;
        let blurred = gaussian(&point, 1.5, Edges::Wrap, &|_| {});
        let at = |x, y| blurred.at(x, y, 0, Edges::Wrap);
        assert!((blurred.values.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        assert!((at(1, 0) / at(0, 0) - (-0.5f32 / 2.25).exp()).abs() < 1e-5);
        assert_eq!((at(3, 0), at(-2, 2)), (at(-3, 0), at(2, -2)));
        assert_eq!(gaussian(&point, 0.0, Edges::Clamp, &|_| {}), point);
    }

    #[test]
    fn beyond_a_clamped_edge_is_the_edge() {
        let ramp = Raster { width: 3, height: 1, channels: 1, values: vec![1.0, 0.0, 0.0] };
        let blurred = gaussian(&ramp, 0.5, Edges::Clamp, &|_| {});
        let kernel = kernel(0.5);
        assert_eq!(kernel.len(), 5);
        let wanted: f32 = kernel[..3].iter().sum();
        assert!((blurred.values[0] - wanted).abs() < 1e-6);
    }
}
