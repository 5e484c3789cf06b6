//! Memory that is freed and allocated again in every frame is not given back in between.

#![cfg(all(target_os = "linux", target_env = "gnu"))]

use relief::renderer::keep_freed_memory;

/// Pages that the system has given to this process so far: field 10 of /proc/self/stat, `minflt` of proc(5).
fn faults() -> u64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("this process");
    let behind_name = stat.rsplit_once(')').expect("a name in brackets").1;
    behind_name.split_whitespace().nth(7).and_then(|field| field.parse().ok()).expect("a number")
}

/// A driver's frame: many blocks, all of them written to.
fn frame() -> u64 {
    let before = faults();
    let blocks: Vec<Vec<u8>> = (0..400).map(|i| vec![i as u8 | 1; 64 << 10]).collect();
    std::hint::black_box(&blocks);
    drop(blocks);
    faults() - before
}

#[test]
fn what_was_freed_is_used_again() {
    keep_freed_memory();
    let first = frame();
    let others: u64 = (0..8).map(|_| frame()).sum();
    assert!(others < first.max(100), "{first} faults in the first frame, {others} in eight others");
}
