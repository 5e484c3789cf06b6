//! Optimisation for drivers that rasterize on the CPU, and for no others.

use std::sync::Once;

/// Triangles of a frame above which such a driver's memory is worth keeping between frames.
const MANY_TRIANGLES: u64 = 10_000;

/// Largest block that glibc's thresholds follow, less room for its own header and for rounding to pages.
/// `DEFAULT_MMAP_THRESHOLD_MAX` is 32 MiB on 64 bits.
const LARGEST: usize = (32 << 20) - (64 << 10);

/// The adapter, as far as it rasterizes on the CPU.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CpuRasterizer {
    /// It does.
    is_used: bool,
}

impl CpuRasterizer {
    pub fn new(adapter: &wgpu::Adapter) -> Self {
        Self { is_used: adapter.get_info().device_type == wgpu::DeviceType::Cpu }
    }

    /// Before a frame is encoded; `triangles`: of a recent one.
    pub fn begin_frame(self, triangles: u64) {
        // Not earlier: what loading left is given back.
        if self.is_used && triangles > MANY_TRIANGLES {
            keep_freed_memory();
        }
    }
}

/// Has the C library keep up to 64 MiB of freed memory in each of its arenas for the next allocations, from the first
/// call on. Called by itself where it helps.
///
/// A software driver frees at the end of a frame what it holds of the frame's triangles, and allocates it again in the
/// next. glibc returns free memory at the end of an arena to the system when it is more than 128 KiB, and the system
/// clears every page that it hands out again. The limit grows to twice the size of the largest block that was ever
/// mapped by itself and freed (`mallopt(3)`, "dynamic mmap threshold"): one such block, of which no page is touched, is
/// all it takes. With other C libraries nothing changes.
pub fn keep_freed_memory() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let mut block = Vec::<u8>::new();
        // Where so much cannot be had, everything stays as it is.
        let _ = block.try_reserve_exact(LARGEST);
        drop(std::hint::black_box(block));
    });
}
