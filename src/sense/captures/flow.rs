//! Optical flow of a camera's pixels.

/// Flags of a pixel's flow, added up.
pub mod flags {
    /// It has one.
    pub const VALID: u8 = 1;
    /// It leads to a pixel of the other picture.
    pub const INSIDE: u8 = 2;
    /// The surface that the pixel shows is seen there: the nearest pixel has its number, and its distance to 1 %.
    pub const SEEN: u8 = 4;
    /// It is of the sky.
    pub const SKY: u8 = 8;
}

/// Flow of the pixels of a picture to another.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Flow {
    /// Shifts of the pixels of the picture: to the right and down, pixels. 0 where there is none: (H, W, 2).
    pub pixels: Vec<[f32; 2]>,
    /// [`flags`] of each: (H, W).
    pub flags: Vec<u8>,
}
