//! Boxes in pictures and in space, as Foxglove shows them (`foxglove_msgs`).

use super::message::{Header, Message, put_time};
use crate::export::cdr::Encoder;
use std::io::Result;

/// A box in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxInPicture<'a> {
    /// Left, top, right, bottom in pixels from the picture's corner: pixel (u, v) is from (u, v) to (u+1, v+1).
    pub edges: [f64; 4],
    /// Red, green, blue, alpha from 0 to 1.
    pub color: [f64; 4],
    /// Text above it.
    pub label: &'a str,
}

/// The boxes in a picture, as `foxglove_msgs/ImageAnnotations`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageAnnotations<'a> {
    /// When the picture was taken, in nanoseconds.
    pub nanoseconds: u64,
    /// Boxes in it.
    pub boxes: &'a [BoxInPicture<'a>],
}

/// The pixels that letters are high, and lines wide.
const FONT_SIZE: f64 = 12.0;
const THICKNESS: f64 = 1.0;
const CLEAR: [f64; 4] = [0.0; 4];

impl Message for ImageAnnotations<'_> {
    const TYPE: &'static str = "foxglove_msgs/msg/ImageAnnotations";
    const FIELDS: &'static str = "\
        foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n\
        foxglove_msgs/TextAnnotation[] texts\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        // No circles.
        cdr.length(0)?;
        cdr.sequence(self.boxes, |cdr, BoxInPicture { edges: [left, top, right, bottom], color, .. }| {
            put_time(cdr, self.nanoseconds);
            // LINE_LOOP.
            cdr.number(2_u8);
            let corners = [[*left, *top], [*right, *top], [*right, *bottom], [*left, *bottom]];
            cdr.length(corners.len())?;
            cdr.array(corners.as_flattened());
            cdr.array(color);
            // No colours of single lines.
            cdr.length(0)?;
            cdr.array(&CLEAR);
            cdr.number(THICKNESS);
            Ok(())
        })?;
        cdr.sequence(self.boxes, |cdr, BoxInPicture { edges: [left, top, ..], color, label }| {
            put_time(cdr, self.nanoseconds);
            cdr.array(&[*left, *top]);
            cdr.string(label)?;
            cdr.number(FONT_SIZE);
            cdr.array(color);
            cdr.array(&CLEAR);
            Ok(())
        })
    }
}

/// A box in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxInSpace<'a> {
    /// Its number, which no other box has.
    pub id: u32,
    /// The name of its class.
    pub class: &'a str,
    /// Its middle: x, y, z in metres.
    pub center: [f64; 3],
    /// Rotation from its own axes to those of the frame: x, y, z, w.
    pub rotation: [f64; 4],
    /// In metres along its own x, y, z.
    pub size: [f64; 3],
    /// Red, green, blue, alpha from 0 to 1.
    pub color: [f64; 4],
}

/// All boxes in space, as `foxglove_msgs/SceneUpdate`. Earlier ones are deleted, so that it depends on none of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneUpdate<'a> {
    /// When, and the frame that they are in.
    pub header: Header<'a>,
    /// Boxes of the scene.
    pub boxes: &'a [BoxInSpace<'a>],
}

impl Message for SceneUpdate<'_> {
    const TYPE: &'static str = "foxglove_msgs/msg/SceneUpdate";
    const FIELDS: &'static str = "\
        foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        // One deletion: ALL that are earlier.
        cdr.length(1)?;
        put_time(cdr, self.header.nanoseconds);
        cdr.number(1_u8);
        cdr.string("")?;
        cdr.sequence(self.boxes, |cdr, shown| {
            self.header.put(cdr)?;
            cdr.string(&shown.id.to_string())?;
            // A lifetime of 0: until it is deleted. The frame is the world's.
            cdr.array(&[0_u32; 2]);
            cdr.bool(false);
            cdr.length(1)?;
            cdr.string("class")?;
            cdr.string(shown.class)?;
            // No arrows, one cube.
            cdr.length(0)?;
            cdr.length(1)?;
            cdr.array(&shown.center);
            cdr.array(&shown.rotation);
            cdr.array(&shown.size);
            cdr.array(&shown.color);
            // No spheres, cylinders, lines, triangles, texts and models.
            cdr.array(&[0_u32; 6]);
            Ok(())
        })
    }
}
