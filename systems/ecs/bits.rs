//! Sets of numbers as bits.

/// Calls `visit` with the place of each bit that is set, ascending.
#[inline(always)]
pub(crate) fn for_each_set(mut bits: u64, mut visit: impl FnMut(u32)) {
    while bits != 0 {
        visit(bits.trailing_zeros());
        bits &= bits - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_visited_from_the_lowest_to_the_highest() {
        for bits in [0, 1, 1 << 63, u64::MAX, 0x8000_0100_0040_0006] {
            let mut visited = Vec::new();
            for_each_set(bits, |bit| visited.push(bit));
            assert_eq!(visited, (0..64).filter(|bit| bits >> bit & 1 != 0).collect::<Vec<_>>());
        }
    }
}
