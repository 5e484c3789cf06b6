//! Reading memory ahead of its use.
//!
//! Data of a few movers lies all over the memory, and one read from there costs as much as a hundred from a cache. A
//! processor has a dozen and more such reads under way at once, if it comes to the next while it waits for the last:
//! work between them keeps them apart, and a branch that it guesses wrong keeps it from seeing any further. So
//! something of all that is about to be used is read first, in a loop in which no address and no branch depends on what
//! was read. The lists must be short enough for a near cache to keep it.

use std::hint::black_box;

/// Reads what the iterator reads; of what lies across cache lines, the other lines are not read.
#[inline(always)]
pub(crate) fn read_ahead(read: impl Iterator<Item = u32>) {
    black_box(read.fold(0, |all, some| all ^ some));
}
