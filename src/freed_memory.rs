//! Keeping freed memory in the process, where the C library would hand it back to the system at once.

/// What glibc's thresholds follow at most (`DEFAULT_MMAP_THRESHOLD_MAX`: 32 MiB on 64 bits), less room for its own
/// header and for rounding to pages.
const LARGEST: usize = (32 << 20) - (64 << 10);

/// Has the C library keep up to 64 MiB of freed memory for the next allocations.
///
/// A software driver allocates tens of megabytes in each frame and frees them at its end. glibc returns free memory at
/// the end of its heap to the system when it is more than 128 KiB, and the system clears every page that it hands out
/// again. The limit grows to twice the size of the largest block that was ever mapped by itself and freed (`mallopt(3)`,
/// "dynamic mmap threshold"): one such block, of which no page is touched, is all it takes. With other C libraries
/// nothing changes.
pub fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGEST)));
}
