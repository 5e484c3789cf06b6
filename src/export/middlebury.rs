//! Optical flow as the Middlebury benchmark has it (Baker and others, "A Database and Evaluation Methodology for
//! Optical Flow", IJCV 2011; its `README.txt`): a number that shows the order of bytes, width, height, then two floats
//! a pixel.

use super::array::Values;
use super::checks::{check_count, pixels_of, unfit};
use std::io::Result;

/// Written for what is not known: more than 1e9 (`README.txt`).
const UNKNOWN: f32 = 1e10;

/// A `.flo` file: pixels to the right and down for each pixel, rows from the top; width and height in pixels.
///
/// # Errors
/// More or fewer flows than pixels; more than 2³¹−1 pixels along a side.
pub fn encode(size: (u32, u32), flow: &[[f32; 2]], is_valid: impl Fn(usize) -> bool) -> Result<Vec<u8>> {
    check_count("Middlebury flow", pixels_of(size), flow.len())?;
    let side = |side: u32| i32::try_from(side).map_err(|_| unfit("Middlebury flow: a side beyond 2³¹−1 pixels"));
    let known = |(pixel, flow): (usize, &[f32; 2])| if is_valid(pixel) { *flow } else { [UNKNOWN; 2] };
    let values: Vec<f32> = flow.iter().enumerate().flat_map(known).collect();
    Ok([b"PIEH", &side(size.0)?.to_le_bytes()[..], &side(size.1)?.to_le_bytes(), &Values::F32(&values).to_le_bytes()]
        .concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_known_byte_by_byte() {
        let bytes = encode((2, 1), &[[1.0, -2.0], [3.0, 4.0]], |pixel| pixel == 0).unwrap();
        // What the first four bytes are as a float.
        assert_eq!(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]), 202_021.25);
        let unknown = UNKNOWN.to_le_bytes();
        let expected = [b"PIEH\x02\0\0\0\x01\0\0\0\0\0\x80\x3f\0\0\0\xc0", &unknown[..], &unknown].concat();
        assert_eq!(bytes, expected);
        assert!(encode((2, 2), &[[0.0; 2]], |_| true).is_err());
    }
}
