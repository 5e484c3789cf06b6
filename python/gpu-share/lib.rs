//! Buffers of a Vulkan device whose memory other interfaces, such as CUDA, can import by a file descriptor; and arrays
//! in such memory, as libraries of Python hand them on ([`dlpack`]).
//!
//! The only crate of the workspace with unsafe code, behind functions that are safe to call. Memory is exported as
//! `VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD` (Vulkan 1.3, 12.2.2 "External Memory Handle Types"), each buffer in an
//! allocation of its own. On other systems than Linux this crate is empty.
#![cfg(target_os = "linux")]

pub mod dlpack;
mod vulkan;

use std::os::fd::OwnedFd;

/// Reasons why a buffer cannot be shared.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ShareError {
    /// The device cannot share memory in this way.
    #[error("{device} cannot share its memory: {reason}")]
    Unsupported {
        /// Name of the graphics adapter, or of what there is in its place.
        device: String,
        /// Missing part.
        reason: String,
    },
    /// A call of the driver failed.
    #[error("{call}: {reason}")]
    Failed {
        /// Function of Vulkan.
        call: &'static str,
        /// Result of it.
        reason: String,
    },
}

/// Identity of a device that all interfaces agree on: `VkPhysicalDeviceIDProperties::deviceUUID`, in CUDA
/// `cudaDeviceProp::uuid`.
///
/// # Errors
/// [`ShareError::Unsupported`] of adapters that are not Vulkan's.
pub fn device_uuid(adapter: &wgpu::Adapter) -> Result<[u8; 16], ShareError> {
    vulkan::device_uuid(adapter)
}

/// A storage buffer in memory that can be imported elsewhere.
#[derive(Debug)]
pub struct SharedBuffer {
    buffer: wgpu::Buffer,
    memory: vulkan::Exported,
}

impl SharedBuffer {
    /// Usages of [`Self::buffer`].
    pub const USAGE: wgpu::BufferUsages =
        wgpu::BufferUsages::STORAGE.union(wgpu::BufferUsages::COPY_SRC).union(wgpu::BufferUsages::COPY_DST);

    /// A buffer of at least one byte, in memory of the device where there is such. Its bytes are undefined.
    ///
    /// # Errors
    /// [`ShareError`]: the device or its driver cannot export memory, has none left, or allows no buffer so large.
    pub fn new(adapter: &wgpu::Adapter, device: &wgpu::Device, bytes: u64) -> Result<Self, ShareError> {
        let most = device.limits().max_buffer_size;
        let bytes = bytes.max(4).checked_next_multiple_of(4).filter(|bytes| *bytes <= most).ok_or_else(|| {
            ShareError::Failed { call: "vkCreateBuffer", reason: format!("{bytes} bytes; expected at most {most}") }
        })?;
        let (buffer, memory) = vulkan::exported_buffer(adapter, device, bytes)?;
        Ok(Self { buffer, memory })
    }

    /// The buffer as wgpu has it. It cannot be mapped.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Size of its memory, bytes: importers have to name it, and it may be more than that of the buffer.
    pub fn allocation_size(&self) -> u64 {
        self.memory.size()
    }

    /// A new file descriptor of its memory. Importers such as CUDA own what they import, so each needs another one.
    ///
    /// # Errors
    /// [`ShareError::Failed`], such as where the process has too many files open.
    pub fn fd(&self) -> Result<OwnedFd, ShareError> {
        self.memory.fd()
    }
}
