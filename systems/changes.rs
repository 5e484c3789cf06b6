//! Finding the few rows of a table that changed.

use bevy_ecs::change_detection::{ContiguousComponentTicksRef, Tick};

/// Rows that are looked at together: few enough that one changed row does not cost much, enough for a vector.
const TOGETHER: usize = 32;

/// Calls `visit` with each row whose component changed since the system last ran. Where none of some rows did, their
/// ticks are compared a vector at a time, several times as fast as row by row; where the table has a summary tick, one
/// comparison does.
pub(crate) fn for_each_changed(ticks: &ContiguousComponentTicksRef, mut visit: impl FnMut(usize)) {
    if ticks.summary_tick_is_changed() == Some(false) {
        return;
    }
    let (last_run, this_run) = (ticks.last_run(), ticks.this_run());
    let is_changed = |tick: &Tick| tick.is_newer_than(last_run, this_run);
    for (chunk, rows) in ticks.changed().chunks(TOGETHER).enumerate() {
        if rows.iter().fold(false, |any, tick| any | is_changed(tick)) {
            for (row, _) in rows.iter().enumerate().filter(|(_, tick)| is_changed(tick)) {
                visit(chunk * TOGETHER + row);
            }
        }
    }
}
