//! Boxes of things in a camera's picture.

/// A thing in a picture. Of pixel (u, v), boxes cover [u, u + 1] and [v, v + 1]: the picture is from (0, 0) to (W, H).
/// Coordinates are half a pixel more than places by the camera's matrix K, which are 0 in the middle of the first
/// pixel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ObjectBox {
    /// Its number: `instance`.
    pub id: u32,
    /// Semantic class.
    pub class: u8,
    /// Left, top, right, bottom of the pixels that show it; 0 where none does.
    pub box_visible: [f32; 4],
    /// Left, top, right, bottom of all of it that is farther than the near plane, within and out of the picture.
    pub box_full: [f32; 4],
    /// Share that is seen of what lies within the picture, 0 to 1: its pixels, of those that it has drawn alone.
    pub visible: f32,
    /// The share of its outline that lies out of the picture, 0 to 1. `None` where that is not known: a lens that bends
    /// does not see all of it.
    pub truncated: Option<f32>,
    /// Number of pixels that show it.
    pub pixels: u32,
    /// The middle of its box in space: camera axes, X right, Y down, Z forward, metres.
    pub center: [f64; 3],
    /// Length (along its own Z, forward), width (along its X, to the left) and height (along its Y, up), metres.
    pub size: [f32; 3],
    /// Rotation of its own axes into the camera's: w, x, y, z.
    pub quaternion: [f64; 4],
    /// The middle of its box in space, the scene's coordinates.
    pub world_center: [f64; 3],
    /// Rotation of its own axes into the world's: w, x, y, z.
    pub world_quaternion: [f64; 4],
    /// Motion since the capture before; `None` where that is not known, or it was put elsewhere.
    pub motion: Option<Motion>,
    /// Corners of its box in space, in pixels: of the lower x in its own axes, then of the higher; of each of these the
    /// lower y, then the higher; of each of these the lower z, then the higher. `None`: not before the camera.
    pub corners_uv: [Option<[f32; 2]>; 8],
}

/// Motion of a thing between two captures.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Motion {
    /// Velocity of the middle of its box, metres per second, world axes.
    pub velocity: [f32; 3],
    /// About the world's +Y, radians per second.
    pub yaw_rate: f32,
}
