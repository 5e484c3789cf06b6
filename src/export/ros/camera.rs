//! Pictures, and the cameras that took them.

use super::message::{Header, Message};
use crate::export::array::Values;
use crate::export::cdr::Encoder;
use crate::export::checks::{check_count, pixels_of, unfit};
use std::io::Result;
use systems::sensors::Lens;

/// The values of a picture, rows from the top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pixels<'a> {
    /// `rgb8`: `[height, width, 3]`, sRGB.
    Rgb(&'a [u8]),
    /// `mono8`: `[height, width]`, such as classes.
    Mono8(&'a [u8]),
    /// `16UC1`: `[height, width]`, such as depths in millimetres.
    Unsigned16(&'a [u16]),
    /// `32SC1`: `[height, width]`, such as instances, whose bits these are.
    Signed32(&'a [u32]),
    /// `32FC1`: `[height, width]`, such as depths in metres.
    Float32(&'a [f32]),
}

impl<'a> Pixels<'a> {
    /// Tells if there are no pixels.
    pub fn is_empty(self) -> bool {
        self.parts().2.is_empty()
    }

    /// The name of the form (`sensor_msgs/image_encodings.hpp`), values a pixel, and the values.
    fn parts(self) -> (&'static str, usize, Values<'a>) {
        match self {
            Self::Rgb(values) => ("rgb8", 3, values.into()),
            Self::Mono8(values) => ("mono8", 1, values.into()),
            Self::Unsigned16(values) => ("16UC1", 1, values.into()),
            Self::Signed32(values) => ("32SC1", 1, values.into()),
            Self::Float32(values) => ("32FC1", 1, values.into()),
        }
    }
}

/// A picture, as `sensor_msgs/Image`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Image<'a> {
    /// When it was taken; the frame of the camera.
    pub header: Header<'a>,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Its values.
    pub pixels: Pixels<'a>,
}

impl Message for Image<'_> {
    const TYPE: &'static str = "sensor_msgs/msg/Image";
    const FIELDS: &'static str = "\
        std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n\
        uint32 step\nuint8[] data\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        let (name, channels, values) = self.pixels.parts();
        check_count(&format!("image {name}"), pixels_of(self.size) * channels, values.len())?;
        let step = u32::try_from(self.size.0 as usize * channels * values.value_bytes());
        self.header.put(cdr)?;
        cdr.number(self.size.1);
        cdr.number(self.size.0);
        cdr.string(name)?;
        cdr.bool(false);
        cdr.number(step.map_err(|_| unfit("image: a row has more than 4 GiB"))?);
        cdr.bytes(&values.to_le_bytes())
    }
}

/// Distortion model of a lens (`sensor_msgs/distortion_models.hpp`), with OpenCV's coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distortion {
    /// `plumb_bob`: k1, k2, p1, p2, k3 of Brown and Conrady; all 0 for a pinhole.
    PlumbBob([f64; 5]),
    /// `rational_polynomial`: k1, k2, p1, p2, k3, k4, k5, k6.
    RationalPolynomial([f64; 8]),
    /// `equidistant`: k1 to k4 of Kannala and Brandt.
    Equidistant([f64; 4]),
}

impl Distortion {
    /// Converts a camera's lens.
    pub fn of(lens: &Lens) -> Self {
        match *lens {
            Lens::BrownConrady { coefficients: [k1, k2, p1, p2, k3, k4, k5, k6], .. } => {
                if [k4, k5, k6] == [0.0; 3] {
                    Self::PlumbBob([k1, k2, p1, p2, k3])
                } else {
                    Self::RationalPolynomial([k1, k2, p1, p2, k3, k4, k5, k6])
                }
            }
            Lens::KannalaBrandt { coefficients, .. } => Self::Equidistant(coefficients),
            Lens::FieldOfView { .. } | Lens::FieldOfViewX { .. } | Lens::Pinhole(_) | Lens::Orthographic { .. } => {
                Self::PlumbBob([0.0; 5])
            }
        }
    }

    /// The model's name, and its coefficients.
    pub fn parts(&self) -> (&'static str, &[f64]) {
        match self {
            Self::PlumbBob(d) => ("plumb_bob", d),
            Self::RationalPolynomial(d) => ("rational_polynomial", d),
            Self::Equidistant(d) => ("equidistant", d),
        }
    }
}

/// A camera, as `sensor_msgs/CameraInfo` of one that is no part of a stereo pair: R is the identity, P is K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraInfo<'a> {
    /// Same header as that of its pictures.
    pub header: Header<'a>,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// fx, fy, cx, cy in pixels, whose centres are the integers (OpenCV).
    pub intrinsics: [f64; 4],
    /// Distortion of its lens.
    pub distortion: Distortion,
}

impl Message for CameraInfo<'_> {
    const TYPE: &'static str = "sensor_msgs/msg/CameraInfo";
    const FIELDS: &'static str = "\
        std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n\
        float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n\
        sensor_msgs/RegionOfInterest roi\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        let ([fx, fy, cx, cy], (model, coefficients)) = (self.intrinsics, self.distortion.parts());
        self.header.put(cdr)?;
        cdr.number(self.size.1);
        cdr.number(self.size.0);
        cdr.string(model)?;
        cdr.length(coefficients.len())?;
        cdr.array(coefficients);
        cdr.array(&[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
        cdr.array(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        cdr.array(&[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
        // No binning; the region of interest is the whole picture, which zeros stand for.
        cdr.array(&[0_u32; 6]);
        cdr.bool(false);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_as_many_values_as_its_size_says() {
        let image = |pixels| Image { header: Header { nanoseconds: 0, frame: "" }, size: (2, 1), pixels }.encode();
        assert!(image(Pixels::Rgb(&[0; 6])).is_ok());
        let error = image(Pixels::Rgb(&[0; 2])).unwrap_err().to_string();
        assert_eq!(error, "image rgb8: expected 6 values, found 2");
    }
}
