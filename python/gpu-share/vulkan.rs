//! Export of memory by Vulkan's functions, which wgpu has none for.
#![allow(unsafe_code)]

use crate::{ShareError, SharedBuffer};
use ash::{khr, vk};
use std::os::fd::{FromRawFd, OwnedFd};
use std::sync::Arc;
use wgpu::hal::api::Vulkan;

const OPAQUE_FD: vk::ExternalMemoryHandleTypeFlags = vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD;

/// A buffer's memory. It lives until both wgpu and whoever exports it have let go of it.
#[derive(Debug)]
pub struct Exported(Arc<Memory>);

struct Memory {
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    size: u64,
    raw: ash::Device,
    external: khr::external_memory_fd::Device,
    /// Keeps `raw` alive.
    _device: wgpu::Device,
}

impl std::fmt::Debug for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Memory").field("memory", &self.memory).field("size", &self.size).finish_non_exhaustive()
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: both were made by `raw`, which `_device` keeps alive, and are destroyed here alone. wgpu has dropped
        // its buffer, which it does after the last submission that uses it has ended. Importers keep a payload of
        // their own (Vulkan 1.3, 12.2.2).
        unsafe {
            self.raw.destroy_buffer(self.buffer, None);
            self.raw.free_memory(self.memory, None);
        }
    }
}

impl Exported {
    pub fn size(&self) -> u64 {
        self.0.size
    }

    pub fn fd(&self) -> Result<OwnedFd, ShareError> {
        let info = vk::MemoryGetFdInfoKHR::default().memory(self.0.memory).handle_type(OPAQUE_FD);
        // SAFETY: the memory was allocated for export as this kind of handle, and lives as long as `self`.
        let fd = unsafe { self.0.external.get_memory_fd(&info) }.map_err(failed("vkGetMemoryFdKHR"))?;
        // SAFETY: the driver gives each caller a descriptor of its own, which nobody else closes.
        Ok(unsafe { OwnedFd::from_raw_fd(fd) })
    }
}

fn failed(call: &'static str) -> impl Fn(vk::Result) -> ShareError {
    move |result| ShareError::Failed { call, reason: result.to_string() }
}

fn unsupported(adapter: &wgpu::Adapter, reason: &str) -> ShareError {
    ShareError::Unsupported { device: adapter.get_info().name, reason: reason.into() }
}

pub fn device_uuid(adapter: &wgpu::Adapter) -> Result<[u8; 16], ShareError> {
    // SAFETY: nothing of the adapter is destroyed.
    let hal = unsafe { adapter.as_hal::<Vulkan>() }.ok_or_else(|| unsupported(adapter, "it is not Vulkan's"))?;
    let mut id = vk::PhysicalDeviceIDProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut id);
    let instance = hal.shared_instance().raw_instance();
    // SAFETY: the physical device is one of this instance, and wgpu asks for Vulkan 1.1, in which this is core.
    unsafe { instance.get_physical_device_properties2(hal.raw_physical_device(), &mut properties) };
    Ok(id.device_uuid)
}

/// Vulkan's usages of [`SharedBuffer::USAGE`].
fn usages() -> vk::BufferUsageFlags {
    vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST
}

pub fn exported_buffer(
    adapter: &wgpu::Adapter,
    device: &wgpu::Device,
    bytes: u64,
) -> Result<(wgpu::Buffer, Exported), ShareError> {
    // SAFETY: nothing of the device is destroyed, but for what is made here.
    let hal = unsafe { device.as_hal::<Vulkan>() }.ok_or_else(|| unsupported(adapter, "it is not Vulkan's"))?;
    if !hal.enabled_device_extensions().contains(&khr::external_memory_fd::NAME) {
        return Err(unsupported(adapter, "its driver lacks VK_KHR_external_memory_fd"));
    }
    let instance = hal.shared_instance().raw_instance();
    let physical = hal.raw_physical_device();
    let asked = vk::PhysicalDeviceExternalBufferInfo::default().usage(usages()).handle_type(OPAQUE_FD);
    let mut offered = vk::ExternalBufferProperties::default();
    // SAFETY: the physical device is one of this instance.
    unsafe { instance.get_physical_device_external_buffer_properties(physical, &asked, &mut offered) };
    let features = offered.external_memory_properties.external_memory_features;
    if !features.contains(vk::ExternalMemoryFeatureFlags::EXPORTABLE) {
        return Err(unsupported(adapter, "its driver does not export the memory of buffers"));
    }
    let raw = hal.raw_device();
    let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(OPAQUE_FD);
    let info = vk::BufferCreateInfo::default()
        .size(bytes)
        .usage(usages())
        .sharing_mode(vk::SharingMode::EXCLUSIVE)
        .push_next(&mut external);
    // SAFETY: the device is alive, the size is not 0 nor beyond the device's largest, and the kind of handle can be
    // exported. Other interfaces read the memory after a wait for the last submission that writes it: then all of it is
    // there, and a release to VK_QUEUE_FAMILY_EXTERNAL would order nothing more.
    let buffer = unsafe { raw.create_buffer(&info, None) }.map_err(failed("vkCreateBuffer"))?;
    let allocated = allocate(instance, physical, raw, buffer);
    let (memory, size) = allocated.inspect_err(|_| {
        // SAFETY: it was made above, and nothing uses it yet.
        unsafe { raw.destroy_buffer(buffer, None) };
    })?;
    let memory = Arc::new(Memory {
        buffer,
        memory,
        size,
        raw: raw.clone(),
        external: khr::external_memory_fd::Device::new(instance, raw),
        _device: device.clone(),
    });
    let kept = memory.clone();
    // SAFETY: `kept` keeps the buffer and its memory until wgpu drops its own, which cannot be mapped by its usages.
    let hal_buffer =
        unsafe { wgpu::hal::vulkan::Buffer::from_raw_externally_owned(buffer, Box::new(move || drop(kept))) };
    let descriptor = wgpu::BufferDescriptor {
        label: Some("shared"),
        size: bytes,
        usage: SharedBuffer::USAGE,
        mapped_at_creation: false,
    };
    // SAFETY: it was made by this device with this size and these usages; any bytes are valid.
    let buffer = unsafe { device.create_buffer_from_hal::<Vulkan>(hal_buffer, &descriptor) };
    Ok((buffer, Exported(memory)))
}

/// Memory for a buffer alone, bound to it; and its size.
fn allocate(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    raw: &ash::Device,
    buffer: vk::Buffer,
) -> Result<(vk::DeviceMemory, u64), ShareError> {
    // SAFETY: the physical device is one of the instance, the buffer one of the device.
    let (needed, types) = unsafe {
        (raw.get_buffer_memory_requirements(buffer), instance.get_physical_device_memory_properties(physical))
    };
    let fits = |&(index, _): &(u32, &vk::MemoryType)| needed.memory_type_bits >> index & 1 == 1;
    let is_own = |kind: &vk::MemoryType| kind.property_flags.contains(vk::MemoryPropertyFlags::DEVICE_LOCAL);
    // The first is the one that the driver prefers (Vulkan 1.3, 11.2.1 "Device Memory Properties").
    let (index, _) = (0..)
        .zip(types.memory_types_as_slice())
        .filter(fits)
        .min_by_key(|(_, kind)| !is_own(kind))
        .ok_or(ShareError::Failed { call: "vkGetBufferMemoryRequirements", reason: "no type of memory".into() })?;
    let mut export = vk::ExportMemoryAllocateInfo::default().handle_types(OPAQUE_FD);
    let mut dedicated = vk::MemoryDedicatedAllocateInfo::default().buffer(buffer);
    let info = vk::MemoryAllocateInfo::default()
        .allocation_size(needed.size)
        .memory_type_index(index)
        .push_next(&mut export)
        .push_next(&mut dedicated);
    // SAFETY: the type is one of the device's, and the size is what the buffer needs.
    let memory = unsafe { raw.allocate_memory(&info, None) }.map_err(failed("vkAllocateMemory"))?;
    // SAFETY: neither was bound before, and the memory has the size that the buffer needs.
    let bound = unsafe { raw.bind_buffer_memory(buffer, memory, 0) }.map_err(failed("vkBindBufferMemory"));
    bound.inspect_err(|_| {
        // SAFETY: it was allocated above, and nothing uses it.
        unsafe { raw.free_memory(memory, None) };
    })?;
    Ok((memory, needed.size))
}
