//! The adapter and its device: one place that asks for them, whether for a window or for none.

use super::error::{GpuError, RenderError};
use super::faults::{self, Faults};
use std::fmt::Write;

/// An open device.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// Source of adapters and surfaces.
    pub instance: wgpu::Instance,
    /// The adapter in use.
    pub adapter: wgpu::Adapter,
    /// The open device.
    pub device: wgpu::Device,
    /// Queue that work is submitted to.
    pub queue: wgpu::Queue,
    /// Errors recorded for it: see [`Self::check`].
    pub faults: Faults,
}

impl Gpu {
    /// Features that are used where they are there. Without them the same is done in more calls and more memory, or
    /// time, and passes are not timed; heights of more than 8 bits lose some where there is neither of the two for
    /// these.
    pub const USED: wgpu::Features = wgpu::Features::INDIRECT_FIRST_INSTANCE
        .union(wgpu::Features::TEXTURE_COMPRESSION_BC)
        .union(wgpu::Features::FLOAT32_FILTERABLE)
        .union(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM)
        .union(wgpu::Features::TIMESTAMP_QUERY);

    /// Opens the best adapter without a window. `WGPU_BACKEND` and `WGPU_ADAPTER_NAME` choose another. Mesa's Vulkan
    /// layer that sorts adapters asks for displays nevertheless, unless the environment has `NODEVICE_SELECT`.
    ///
    /// # Errors
    /// [`GpuError`] where there is no adapter or it refuses a device.
    pub fn headless() -> Result<Self, GpuError> {
        Self::headless_with(Self::USED)
    }

    /// Opens a device like [`Self::headless`], of the features in [`Self::USED`] only with those that are `wanted`.
    ///
    /// # Errors
    /// [`GpuError`] where there is no adapter or it refuses a device.
    pub fn headless_with(wanted: wgpu::Features) -> Result<Self, GpuError> {
        let mut refused = None;
        for backends in BACKENDS {
            match Self::open(instance(backends), None, wanted) {
                Ok(gpu) => return Ok(gpu),
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        Err(refused.unwrap_or_else(|| GpuError::NoAdapter(String::new())))
    }

    /// Opens an adapter that can present to the surface made by `surface`.
    ///
    /// # Errors
    /// [`GpuError`] where there is no adapter or surface.
    pub fn for_surface(instance: wgpu::Instance, surface: &wgpu::Surface<'_>) -> Result<Self, GpuError> {
        Self::open(instance, Some(surface), Self::USED)
    }

    fn open(
        instance: wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
        wanted: wgpu::Features,
    ) -> Result<Self, GpuError> {
        let mut refused = None;
        for adapter in adapters(&instance, surface)? {
            match Self::of_adapter(instance.clone(), adapter, wanted) {
                Ok(gpu) => {
                    if let Some(error) = refused {
                        tracing::warn!("{error}; {} is used instead", gpu.name());
                    }
                    return Ok(gpu);
                }
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        Err(refused.unwrap_or_else(|| GpuError::NoAdapter(String::new())))
    }

    fn of_adapter(instance: wgpu::Instance, adapter: wgpu::Adapter, wanted: wgpu::Features) -> Result<Self, GpuError> {
        let mut descriptor = Self::device_descriptor(&adapter);
        descriptor.required_features &= wanted;
        // The tables. Not every adapter of Direct3D 12 reads them, and wgpu asks only when a pipeline is made.
        let tables = adapter.get_texture_format_features(wgpu::TextureFormat::Rgba32Uint).flags;
        let needed =
            wgpu::TextureFormatFeatureFlags::STORAGE_READ_ONLY | wgpu::TextureFormatFeatureFlags::STORAGE_WRITE_ONLY;
        if !tables.contains(needed) {
            let reason = "it does not read storage textures of four 32-bit values".to_owned();
            return Err(GpuError::NoDevice { adapter: adapter.get_info().name, reason });
        }
        let opened = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = opened
            .map_err(|error| GpuError::NoDevice { adapter: adapter.get_info().name, reason: error.to_string() })?;
        Ok(Self::of_device(instance, adapter, device, queue))
    }

    /// Descriptor of the device that relief asks an adapter for. It has the [features that are used](Self::USED), as
    /// far as the adapter offers them, and the limits that scenes grow past. A program that opens its own device adds
    /// what it needs itself.
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        let offered = adapter.limits();
        wgpu::DeviceDescriptor {
            label: Some("relief device"),
            required_features: adapter.features() & Self::USED,
            required_limits: wgpu::Limits {
                // Scenes grow past the portable defaults in these; everything else stays portable.
                max_buffer_size: offered.max_buffer_size,
                max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
                max_texture_dimension_2d: offered.max_texture_dimension_2d,
                ..wgpu::Limits::default()
            },
            ..wgpu::DeviceDescriptor::default()
        }
    }

    /// A device that was opened elsewhere. Errors on it are told by [`Self::check`] from now on.
    pub fn of_device(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Self {
        let faults = Faults::watch(&device);
        Self { instance, adapter, device, queue, faults }
    }

    /// Checks for errors since the last call. After an error, the data of read-backs is invalid.
    ///
    /// # Errors
    /// [`RenderError::Lost`], from then on; [`RenderError::Refused`] where the device had no memory for something or
    /// found fault with it.
    pub fn check(&self) -> Result<(), RenderError> {
        if self.faults.is_due() {
            self.device.destroy();
            self.poll(wgpu::PollType::wait_indefinitely());
        }
        // Whatever is known, but not told yet.
        self.poll(wgpu::PollType::Poll);
        self.faults.take()
    }

    /// Has callbacks called, or waits for the device. `false` where there is nothing to wait for any more.
    pub(crate) fn poll(&self, how: wgpu::PollType) -> bool {
        faults::poll(&self.device, how)
    }

    /// Name, kind and backend of the adapter in one line.
    pub fn name(&self) -> String {
        let info = self.adapter.get_info();
        format!("{} ({:?}, {:?})", info.name, info.device_type, info.backend)
    }

    /// Largest distance that the rasteriser may move a vertex, in pixels: it rounds them to parts of a pixel. Geometry
    /// farther than that from all sample positions need not be drawn.
    ///
    /// Vulkan promises sixteenths (`subPixelPrecisionBits`), Direct3D 12 has 256ths
    /// (`D3D12_SUBPIXEL_FRACTIONAL_BIT_COUNT`). What a Vulkan driver has wgpu does not tell; those of the makers below
    /// have 256ths.
    pub fn vertex_rounding(&self) -> f32 {
        let info = self.adapter.get_info();
        match info.backend {
            wgpu::Backend::Dx12 => 1.0 / 256.0,
            wgpu::Backend::Vulkan if FINE_RASTERISERS.contains(&info.vendor) => 1.0 / 256.0,
            _ => 1.0 / 16.0,
        }
    }

    /// Text of `relief info`: adapter, driver, features used, limits.
    pub fn describe(&self) -> String {
        let blocks = self.device.features().contains(wgpu::Features::TEXTURE_COMPRESSION_BC);
        let features = if blocks { "textures in blocks (BC)" } else { "none beyond WebGPU's core" };
        let (info, limits) = (self.adapter.get_info(), self.device.limits());
        let mut text = String::new();
        let rows: [(&str, String); 9] = [
            ("adapter", info.name),
            ("kind", format!("{:?}", info.device_type)),
            ("backend", format!("{:?}", info.backend)),
            ("driver", format!("{} {}", info.driver, info.driver_info).trim().to_owned()),
            ("features used", features.to_owned()),
            ("largest texture", format!("{0} x {0}", limits.max_texture_dimension_2d)),
            ("texture layers", limits.max_texture_array_layers.to_string()),
            ("largest buffer", format!("{} MiB", limits.max_buffer_size >> 20)),
            ("largest storage binding", format!("{} MiB", limits.max_storage_buffer_binding_size >> 20)),
        ];
        for (name, value) in rows {
            let _ = writeln!(text, "{name:24} {value}");
        }
        text
    }
}

/// PCI numbers of AMD, NVIDIA and Intel, and the number that Khronos gave to Mesa for its software driver.
const FINE_RASTERISERS: [u32; 4] = [0x1002, 0x10de, 0x8086, 0x10005];

/// Vulkan first: it is what the pictures are tested with. Then whatever else the system has (Direct3D 12, Metal).
pub(crate) const BACKENDS: [wgpu::Backends; 2] = [wgpu::Backends::VULKAN, wgpu::Backends::all()];

/// An instance of those backends, or of what `WGPU_BACKEND` says.
fn instance(backends: wgpu::Backends) -> wgpu::Instance {
    let descriptor = wgpu::InstanceDescriptor { backends, ..wgpu::InstanceDescriptor::new_without_display_handle() };
    wgpu::Instance::new(instance_flags(descriptor).with_env())
}

/// Without wgpu's own pass over the arguments of every indirect draw: they come from the culling shader, which keeps
/// within the lists that they index, as no slot is in the lists of both phases.
pub fn instance_flags(mut descriptor: wgpu::InstanceDescriptor) -> wgpu::InstanceDescriptor {
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    descriptor
}

/// The adapters that will do, the best first: an old card may refuse what another one has. At least one.
fn adapters(instance: &wgpu::Instance, surface: Option<&wgpu::Surface<'_>>) -> Result<Vec<wgpu::Adapter>, GpuError> {
    let wanted = std::env::var("WGPU_ADAPTER_NAME").ok().map(|name| name.to_lowercase());
    let usable = |adapter: &wgpu::Adapter| {
        surface.is_none_or(|s| adapter.is_surface_supported(s))
            && wanted.as_ref().is_none_or(|name| adapter.get_info().name.to_lowercase().contains(name))
    };
    let rank = |adapter: &wgpu::Adapter| {
        let info = adapter.get_info();
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        };
        (kind, info.backend != wgpu::Backend::Vulkan)
    };
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    found.retain(usable);
    found.sort_by_key(rank);
    if found.is_empty() {
        return Err(GpuError::NoAdapter(match &wanted {
            Some(name) => format!("no adapter name contains \"{name}\""),
            None => "no backend, Vulkan or other, offers one".to_owned(),
        }));
    }
    Ok(found)
}
