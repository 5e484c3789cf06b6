//! Memory of the graphics device that is lent to other interfaces: buffers that are used again once nobody holds them.

use crate::errors::{Failure, Outcome};
use gpu_share::{ShareError, SharedBuffer, device_uuid};
use relief::renderer::Gpu;
use relief::wgpu;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Most bytes that are lent and kept for lending, together.
static MOST_BYTES: AtomicU64 = AtomicU64::new(4 << 30);

/// A buffer that was lent.
#[derive(Debug)]
pub struct Lent {
    pub buffer: SharedBuffer,
    /// Differs from that of every other buffer of the process.
    pub number: u64,
    /// UUID and name of its device.
    pub device: ([u8; 16], String),
    owner: wgpu::Device,
}

/// All buffers that are lent, or could be.
static BUFFERS: Mutex<Vec<Arc<Lent>>> = Mutex::new(Vec::new());

impl From<ShareError> for Failure {
    fn from(error: ShareError) -> Self {
        Self::Gpu(error.to_string())
    }
}

/// Sets how many bytes are lent and kept for lending, together.
pub fn set_most_bytes(bytes: u64) {
    MOST_BYTES.store(bytes, Ordering::Relaxed);
}

/// UUID and name of a device that can share its memory.
pub fn device(gpu: &Gpu) -> Outcome<([u8; 16], String)> {
    SharedBuffer::new(&gpu.adapter, &gpu.device, 4)?;
    Ok((device_uuid(&gpu.adapter)?, gpu.name()))
}

/// Numbers of all buffers that are lent, or could be: what is imported of others is of no more use.
pub fn numbers() -> Vec<u64> {
    BUFFERS.lock().unwrap_or_else(PoisonError::into_inner).iter().map(|own| own.number).collect()
}

/// Lends a buffer of at least so many bytes. It is nobody else's as long as it is held.
pub fn lend(gpu: &Gpu, bytes: u64) -> Outcome<Arc<Lent>> {
    static NUMBERS: AtomicU64 = AtomicU64::new(1);
    let most = MOST_BYTES.load(Ordering::Relaxed);
    let mut buffers = BUFFERS.lock().unwrap_or_else(PoisonError::into_inner);
    let is_free = |own: &Arc<Lent>| Arc::strong_count(own) == 1;
    // Those of a device that was lost are of no use.
    buffers.retain(|own| own.owner == gpu.device || !is_free(own));
    let size = |own: &Arc<Lent>| own.buffer.allocation_size();
    // What is far larger than needed would be missed elsewhere.
    let fits =
        |own: &&Arc<Lent>| is_free(own) && (bytes..=bytes.saturating_mul(2)).contains(&own.buffer.buffer().size());
    if let Some(found) = buffers.iter().filter(fits).min_by_key(|own| size(own)) {
        return Ok(found.clone());
    }
    if buffers.iter().map(size).sum::<u64>().saturating_add(bytes) > most {
        buffers.retain(|own| !is_free(own));
    }
    let held = buffers.iter().map(size).sum::<u64>();
    if held.saturating_add(bytes) > most {
        let (megabytes, held, most) = (bytes >> 20, held >> 20, most >> 20);
        return Err(Failure::Gpu(format!(
            "arrays of {megabytes} MiB beside {held} MiB that captures before them still hold; expected at most {most} \
             MiB of the device: let go of arrays, copy what is to be kept, or call relief.cuda.set_memory_limit"
        )));
    }
    let new = || SharedBuffer::new(&gpu.adapter, &gpu.device, bytes);
    let buffer = new().or_else(|_| {
        // Memory may be what lacks.
        buffers.retain(|own| !is_free(own));
        new()
    })?;
    let lent = Arc::new(Lent {
        buffer,
        number: NUMBERS.fetch_add(1, Ordering::Relaxed),
        device: (device_uuid(&gpu.adapter)?, gpu.name()),
        owner: gpu.device.clone(),
    });
    buffers.push(lent.clone());
    Ok(lent)
}
