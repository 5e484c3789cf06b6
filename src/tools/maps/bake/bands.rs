//! Bands of rows, each written by one thread.

/// Rows of a band, and texels of the squares that it is worked through in, so that rays that lie close together follow
/// each other and find what they need in the caches.
pub const BAND: usize = 16;

/// Some rows of all maps of a bake. A map that is not wanted is empty.
pub struct Band<'a> {
    /// The first of its rows.
    pub first_row: usize,
    /// Texels of a row.
    pub width: usize,
    /// Three for each texel.
    pub normal: &'a mut [f32],
    /// One for each texel.
    pub height: &'a mut [f32],
    /// One for each texel.
    pub occlusion: &'a mut [f32],
    /// One for each texel.
    pub coverage: &'a mut [super::Coverage],
}

impl Band<'_> {
    /// The band's texels square by square: column, row, and the index in the band.
    pub fn texels(&self) -> impl Iterator<Item = (usize, usize, usize)> + use<> {
        let (width, first_row) = (self.width, self.first_row);
        let rows = self.coverage.len() / width;
        (0..width).step_by(BAND).flat_map(move |left| {
            (0..rows)
                .flat_map(move |row| (left..width.min(left + BAND)).map(move |x| (x, first_row + row, row * width + x)))
        })
    }
}
