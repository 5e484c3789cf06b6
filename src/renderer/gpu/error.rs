//! Errors of a renderer: no device, a lost device, a scene or picture that the device cannot hold.

/// No adapter, or none that gives a device. The binary exits with 3 on it.
#[derive(Clone, Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter at all.
    #[error(
        "no graphics adapter found ({0})\n\
         Install a graphics driver, or Mesa's software Vulkan driver:\n  \
         Debian, Ubuntu: apt-get install mesa-vulkan-drivers\n  \
         Fedora: dnf install mesa-vulkan-drivers\n  \
         Arch: pacman -S vulkan-swrast"
    )]
    NoAdapter(String),
    /// There is an adapter, but it does not do what is needed.
    #[error("the graphics adapter {adapter} cannot be used: {reason}")]
    NoDevice {
        /// Its name.
        adapter: String,
        /// Message of the driver.
        reason: String,
    },
    /// The window system refuses a surface.
    #[error("cannot draw to the window: {0}")]
    NoSurface(String),
}

/// Errors that stop rendering.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RenderError {
    /// There is no device to draw with, when one was to be opened.
    #[error(transparent)]
    NoGpu(#[from] GpuError),
    /// The device is gone: its driver was reset or replaced, it was unplugged, or it hung.
    #[error("the graphics device was lost: {reason}")]
    Lost {
        /// Message of the driver.
        reason: String,
    },
    /// A buffer or picture would be larger than the device allows.
    #[error("too large for this graphics adapter: {what}: {needed} {unit}, at most {limit}")]
    TooLarge {
        /// Name of the buffer, or the picture.
        what: &'static str,
        /// Unit of the numbers.
        unit: &'static str,
        /// Needed.
        needed: u64,
        /// Allowed.
        limit: u64,
    },
    /// There is no memory for the picture.
    #[error("out of memory for a picture of {}x{} pixels with {samples} samples each: {reason}", size[0], size[1])]
    NoMemory {
        /// Pixels.
        size: [u32; 2],
        /// Per pixel.
        samples: u32,
        /// Message of the device.
        reason: String,
    },
    /// The device has no memory for the scene's meshes, textures or tables, or finds fault with them.
    #[error("the graphics adapter rejected the scene: {reason}")]
    Refused {
        /// Message of the device.
        reason: String,
    },
    /// A view that there is no picture of.
    #[error("{view}: {reason}")]
    View {
        /// Its name.
        view: String,
        /// The field, and what is wrong with it.
        reason: String,
    },
    /// An image's texels have been taken (`Library::keep_texels`): by another renderer, or by this one before it drew
    /// another world.
    #[error(
        "texels of image {image:?} were released: several renderers, or several worlds of one, need \
         Library::keep_texels(true)"
    )]
    NoTexels {
        /// Its name.
        image: String,
    },
    /// An image of a material has more texels than the device's textures may have.
    #[error(
        "too large for this graphics adapter: image {image:?} of {}x{} texels, at most {limit} along a side",
        size[0],
        size[1]
    )]
    MapTooLarge {
        /// Its name.
        image: String,
        /// Texels.
        size: [u32; 2],
        /// Allowed.
        limit: u32,
    },
}

impl RenderError {
    /// Tells if the device is at fault, and not a scene or a picture beyond its limits. With another device, or more
    /// memory, the same would be drawn.
    pub fn is_of_device(&self) -> bool {
        matches!(self, Self::Lost { .. } | Self::NoMemory { .. } | Self::Refused { .. })
    }
}
