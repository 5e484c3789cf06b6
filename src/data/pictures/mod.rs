//! Values of sensors as colours, for those who look at them: outputs of cameras as pictures, points of lidars from
//! above.
//!
//! ```text
//! distances    viridis by their logarithm, the nearer the brighter; nothing is black
//! amounts      viridis, the more the brighter
//! normals      0.5 + 0.5·n
//! numbers      hues that lie far apart for neighbours; 0 is black
//! classes      their own colours; one that is black has that of its number
//! flow         directions as hues, lengths as brightness
//! ```

mod colors;
mod picture;

pub use colors::{Scale, rgb_of_class, rgb_of_number};
pub use picture::{Picture, PointColors, PointValue, reach_from_above};
