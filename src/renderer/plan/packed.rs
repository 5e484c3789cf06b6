//! The layout of arrays that a pack pass writes: what views show, view after view, in one buffer.

use crate::renderer::gpu::error::RenderError;

/// An array of a value per pixel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PackedArray {
    /// Tone-mapped, sRGB: three bytes.
    Color,
    /// Metres along the viewing direction, infinite where there is nothing: a 32-bit float.
    Depth,
    /// Steps of a scale that the depth has passed, plus 1; 255 where there is nothing: a byte.
    DepthSteps,
    /// [`PackedLabels::instance`] of what is seen: 32 bits.
    Instance,
    /// [`PackedLabels::part`] of what is seen: 32 bits.
    Part,
    /// [`PackedLabels::class`] of what is seen: a byte.
    Class,
}

impl PackedArray {
    /// Bytes of a pixel.
    pub fn pixel_bytes(self) -> u64 {
        match self {
            Self::Color => 3,
            Self::Depth | Self::Instance | Self::Part => 4,
            Self::Class | Self::DepthSteps => 1,
        }
    }
}

/// Labels of an entity, as the arrays have them. Of index 0 they are those of nothing, of index i + 1 of entity i.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PackedLabels {
    /// Number of the thing that it belongs to.
    pub instance: u32,
    /// Its own number.
    pub part: u32,
    /// Semantic class: a byte.
    pub class: u32,
    /// Fills up a texel.
    pub unused: u32,
}

/// Places of arrays in a buffer. Rows are tightly packed, from the top; views begin at multiples of four pixels.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PackedLayout {
    /// Width and height of each view, pixels.
    pub size: (u32, u32),
    /// Number of views.
    pub views: usize,
    /// Arrays, and where they begin, bytes.
    pub arrays: Vec<(PackedArray, u64)>,
    /// Bytes of all.
    pub bytes: u64,
}

/// Arrays begin at multiples of these, as memory of other interfaces does.
const ALIGNMENT: u64 = 256;

impl PackedLayout {
    /// Layout of some arrays.
    pub fn new(size: (u32, u32), views: usize, arrays: impl IntoIterator<Item = PackedArray>) -> Self {
        let mut layout = Self { size, views, arrays: Vec::new(), bytes: 0 };
        for array in arrays {
            layout.arrays.push((array, layout.bytes));
            layout.bytes += (layout.view_bytes(array) * views as u64).next_multiple_of(ALIGNMENT);
        }
        layout
    }

    /// Checks that a device can bind all arrays at once.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`].
    pub fn check(&self, device: &wgpu::Device) -> Result<(), RenderError> {
        let limit = device.limits().max_storage_buffer_binding_size;
        if self.bytes <= limit {
            return Ok(());
        }
        Err(RenderError::TooLarge { what: "the arrays of all views", unit: "bytes", needed: self.bytes, limit })
    }

    /// Threads that pack a view: one for four pixels.
    pub(crate) fn quads(&self) -> u64 {
        (u64::from(self.size.0) * u64::from(self.size.1)).div_ceil(4)
    }

    /// Bytes from a view to the next.
    pub fn view_bytes(&self, array: PackedArray) -> u64 {
        self.quads() * 4 * array.pixel_bytes()
    }

    /// The beginning of an array, bytes; `None` where it is not packed.
    pub fn start(&self, array: PackedArray) -> Option<u64> {
        self.arrays.iter().find(|(own, _)| *own == array).map(|(_, start)| *start)
    }
}
