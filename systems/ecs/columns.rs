//! Writing a column of a table in parts, for tasks to share.
//!
//! A contiguous column that is written past change detection owes two notes: the change tick of each row, and the
//! summary tick of the column, without which readers pass over it (`changes.rs`). A [`Column`] gives both.

use super::changes::touch;
use bevy_ecs::change_detection::{ContiguousComponentTicksMut, ContiguousMut, Tick};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// A column that is being written. When it is dropped, its summary tick tells of it if any row was.
pub(crate) struct Column<'w, T> {
    values: &'w mut [T],
    ticks: ContiguousComponentTicksMut<'w>,
    is_written: AtomicBool,
}

impl<'w, T> Column<'w, T> {
    pub fn new(column: ContiguousMut<'w, T>) -> Self {
        let (values, ticks) = ContiguousMut::bypass_change_detection_split(column);
        Self { values, ticks, is_written: AtomicBool::new(false) }
    }

    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// The rows from `first` on, so many to a part.
    pub fn parts(&mut self, first: usize, rows: usize) -> impl ExactSizeIterator<Item = ColumnPart<'_, T>> {
        let (this_run, is_written) = (self.ticks.this_run(), &self.is_written);
        let parts = self.values[first..].chunks_mut(rows).zip(self.ticks.changed_mut()[first..].chunks_mut(rows));
        parts.enumerate().map(move |(part, (values, changed))| ColumnPart {
            first: first + part * rows,
            values,
            changed,
            this_run,
            has_written: false,
            is_written,
        })
    }
}

impl<T> Drop for Column<'_, T> {
    fn drop(&mut self) {
        if *self.is_written.get_mut() {
            touch(self.ticks.reborrow());
        }
    }
}

/// Some rows of a [`Column`]; they keep their numbers.
pub(crate) struct ColumnPart<'a, T> {
    first: usize,
    values: &'a mut [T],
    changed: &'a mut [Tick],
    this_run: Tick,
    has_written: bool,
    is_written: &'a AtomicBool,
}

impl<T> ColumnPart<'_, T> {
    pub fn rows(&self) -> Range<usize> {
        self.first..self.first + self.values.len()
    }

    #[inline(always)]
    pub fn get(&self, row: usize) -> &T {
        &self.values[row - self.first]
    }

    /// Tells if the row was written in this run.
    #[inline(always)]
    pub fn is_written(&self, row: usize) -> bool {
        self.changed[row - self.first] == self.this_run
    }

    /// Writes a row, which counts as changed.
    #[inline(always)]
    pub fn set(&mut self, row: usize, value: T) {
        let row = row - self.first;
        (self.values[row], self.changed[row]) = (value, self.this_run);
        self.has_written = true;
    }

    /// Writes a row that is another now.
    #[inline(always)]
    pub fn set_if_neq(&mut self, row: usize, value: T)
    where
        T: PartialEq,
    {
        if *self.get(row) != value {
            self.set(row, value);
        }
    }
}

impl<T> Drop for ColumnPart<'_, T> {
    fn drop(&mut self) {
        if self.has_written {
            self.is_written.store(true, Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ecs::parallel::in_parallel;
    use bevy_ecs::prelude::*;
    use bevy_ecs::system::RunSystemOnce;

    #[derive(Component, PartialEq, Debug)]
    #[component(summary_tick)]
    struct Number(usize);

    /// Writes `what` to the rows from `first` on, four to a task; returns which changed, and whether the column says
    /// so.
    fn write(world: &mut World, first: usize, what: fn(usize) -> Option<Number>) -> (Vec<usize>, Option<bool>) {
        world.clear_trackers();
        let write = move |mut numbers: Query<&mut Number>| {
            for numbers in numbers.contiguous_iter_mut().into_iter().flatten() {
                let mut column = Column::new(numbers);
                in_parallel(column.parts(first, 4), |mut part| {
                    for row in part.rows() {
                        what(row).into_iter().for_each(|number| part.set_if_neq(row, number));
                    }
                });
            }
        };
        world.run_system_once(write).expect("runs");
        let mut numbers = world.query::<&mut Number>();
        let column = numbers.contiguous_iter_mut(world).expect("a table").next().expect("one");
        let (_, ticks) = ContiguousMut::bypass_change_detection_split(column);
        let ticks = bevy_ecs::change_detection::ContiguousComponentTicksRef::from(ticks);
        let mut changed = Vec::new();
        crate::ecs::changes::for_each_changed(&ticks, |row| changed.push(row));
        (changed, ticks.summary_tick_is_changed())
    }

    #[test]
    fn rows_that_are_written_are_known_row_by_row_and_for_the_column() {
        crate::ecs::parallel::set_threads(Some(4));
        let mut world = World::new();
        world.spawn_batch((0..22).map(Number));
        assert_eq!(write(&mut world, 0, |row| Some(Number(row))), (vec![], Some(false)), "as it was");
        assert_eq!(write(&mut world, 0, |row| (row == 21).then_some(Number(7))), (vec![21], Some(true)));
        let later = write(&mut world, 5, |_| Some(Number(1)));
        assert_eq!(later, ((5..22).collect(), Some(true)));
        let numbers: Vec<usize> = world.query::<&Number>().iter(&world).map(|number| number.0).collect();
        assert_eq!(numbers, [vec![0, 1, 2, 3, 4], vec![1; 17]].concat());
    }
}
