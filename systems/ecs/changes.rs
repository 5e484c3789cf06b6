//! Finding the few rows of a table that changed.
//!
//! A column with a summary tick (`#[component(summary_tick)]`) tells by one comparison that none of its rows changed.
//! Others, and those in which something did, are compared row by row, a vector at a time: 4 bytes per row, which for a
//! million rows is a quarter of a millisecond. All columns that are looked at in every frame have one.
//!
//! ```text
//! for (transforms, meshes) in objects.contiguous_iter().into_iter().flatten() {
//!     let ((transforms, placed), (meshes, chosen)) = (ContiguousRef::split(transforms), ContiguousRef::split(meshes));
//!     for_each_changed_in([Some(&placed), Some(&chosen)], |row| …);
//! }
//! ```

use super::bits::for_each_set;
use super::parallel::in_parallel;
use bevy_ecs::change_detection::{ContiguousComponentTicksMut, ContiguousComponentTicksRef, MAX_CHANGE_AGE, Tick};
use bevy_tasks::ComputeTaskPool;
use std::ops::Range;

/// Rows that are looked at together: few enough that one changed row does not cost much, enough for a vector.
const TOGETHER: usize = 64;

/// Calls `visit` with each row whose component changed since the system last ran, ascending.
pub(crate) fn for_each_changed(ticks: &ContiguousComponentTicksRef, visit: impl FnMut(usize)) {
    for_each_changed_in([Some(ticks)], visit);
}

/// Calls `visit` once with each row of a table in which any of some components changed since the system last ran,
/// ascending. Columns that are `None` count as unchanged; those whose summary tick says so are not read.
pub(crate) fn for_each_changed_in<const N: usize>(
    columns: [Option<&ContiguousComponentTicksRef>; N],
    visit: impl FnMut(usize),
) {
    if let Some((since, columns)) = suspects(columns) {
        let rows = columns.iter().map(|column| column.len()).max().unwrap_or(0);
        since.for_each(columns, 0..rows, visit);
    }
}

/// Finds the beginning of work on a table's changed rows, for tasks to share. It is the first of the rows that
/// [`for_each_changed_in`] visits, or one shortly before it, with the result of [`suspects`]. `None` where nothing
/// changed.
pub(crate) fn first_changed<'w, const N: usize>(
    columns: [Option<&ContiguousComponentTicksRef<'w>>; N],
) -> Option<(usize, Since, [&'w [Tick]; N])> {
    let (since, columns) = suspects(columns)?;
    let mut first = None;
    for column in columns {
        // No further than in those before.
        let mut parts = column.chunks(TOGETHER).take(first.unwrap_or(usize::MAX));
        first = parts.position(|part| since.any(part)).or(first);
    }
    Some((first? * TOGETHER, since, columns))
}

/// Writes down a bit for each row of a table, row r in bit r % 64 of word r / 64: whether any of some components
/// changed since the system last ran. Returns how many such rows there are. For tasks that are each to look through all
/// of them.
pub(crate) fn note_changed<const N: usize>(
    columns: [Option<&ContiguousComponentTicksRef>; N],
    bits: &mut Vec<u64>,
) -> usize {
    bits.clear();
    let Some((since, columns)) = suspects(columns) else { return 0 };
    let rows = columns.iter().map(|column| column.len()).max().unwrap_or(0);
    bits.resize(rows.div_ceil(TOGETHER), 0);
    let words = rows_per_task(rows, LIGHT_ROWS).div_ceil(TOGETHER);
    in_parallel(bits.chunks_mut(words).enumerate(), |(task, bits)| {
        for (word, first) in bits.iter_mut().zip((task * words * TOGETHER..).step_by(TOGETHER)) {
            *word = since.bits(&columns.map(|column| part(column, first..first + TOGETHER)));
        }
    });
    bits.iter().map(|word| word.count_ones() as usize).sum()
}

/// Result of [`first_changed`] where all rows are to be visited, from one of the table's columns.
pub(crate) fn all_rows<'w, const N: usize>(
    column: &ContiguousComponentTicksRef<'w>,
) -> (usize, Since, [&'w [Tick]; N]) {
    let mut columns = [&[][..]; N];
    columns[0] = column.changed();
    (0, Since { this_run: column.this_run().get(), age: u32::MAX }, columns)
}

/// Rows of a table per task, where so many are to be done and `least` are worth a task.
pub(crate) fn rows_per_task(rows: usize, least: usize) -> usize {
    rows.div_ceil(4 * ComputeTaskPool::get().thread_num()).max(least)
}

/// Rows that are worth a task where each takes a few nanoseconds.
pub(crate) const LIGHT_ROWS: usize = 1 << 12;

/// The ticks of the columns that may have changed; of the others, none. `None` where none have.
fn suspects<'w, const N: usize>(
    columns: [Option<&ContiguousComponentTicksRef<'w>>; N],
) -> Option<(Since, [&'w [Tick]; N])> {
    let columns = columns.map(|column| column.filter(|column| column.summary_tick_is_changed() != Some(false)));
    let first = columns.iter().flatten().next()?;
    let since = Since::new(first.last_run(), first.this_run());
    Some((since, columns.map(|column| column.map_or(&[][..], ContiguousComponentTicksRef::changed))))
}

/// Makes the summary tick of a column say that some row may have changed; no row counts as changed by it.
pub(crate) fn touch(column: ContiguousComponentTicksMut) {
    column.slice(0..0).mark_all_as_changed();
}

/// The time since a system last ran.
#[derive(Clone, Copy)]
pub(crate) struct Since {
    this_run: u32,
    age: u32,
}

impl Since {
    pub(crate) fn new(last_run: Tick, this_run: Tick) -> Self {
        let age = this_run.get().wrapping_sub(last_run.get()).min(MAX_CHANGE_AGE);
        Self { this_run: this_run.get(), age }
    }

    /// [`Tick::is_newer_than`], which as it stands does not fit the vectors of every processor.
    #[inline(always)]
    pub(crate) fn contains(self, tick: &Tick) -> bool {
        self.this_run.wrapping_sub(tick.get()) < self.age
    }

    /// Tells if any of some ticks is in it.
    #[inline(always)]
    pub(crate) fn any(self, ticks: &[Tick]) -> bool {
        ticks.iter().fold(false, |any, tick| any | self.contains(tick))
    }

    /// Tells if all of some ticks are in it.
    #[inline(always)]
    fn all(self, ticks: &[Tick]) -> bool {
        ticks.iter().fold(true, |all, tick| all & self.contains(tick))
    }

    /// Calls `visit` once with each of the rows of which any tick is in it, ascending. Columns may be empty.
    pub(crate) fn for_each<const N: usize>(
        self,
        columns: [&[Tick]; N],
        rows: Range<usize>,
        mut visit: impl FnMut(usize),
    ) {
        for start in rows.clone().step_by(TOGETHER) {
            let end = rows.end.min(start + TOGETHER);
            let parts = columns.map(|column| part(column, start..end));
            if parts.iter().any(|part| part.len() == end - start && self.all(part)) {
                (start..end).for_each(&mut visit);
            } else {
                for_each_set(self.bits(&parts), |row| visit(start + row as usize));
            }
        }
    }

    /// A bit for each of the rows, no more than [`TOGETHER`], of which any tick is in it.
    #[inline(always)]
    fn bits(self, columns: &[&[Tick]]) -> u64 {
        if !columns.iter().any(|column| self.any(column)) {
            return 0;
        }
        // Without a branch that would be hard to predict.
        let mut is_changed = [0u8; TOGETHER];
        for column in columns {
            for (is_changed, tick) in is_changed.iter_mut().zip(*column) {
                *is_changed |= u8::from(self.contains(tick));
            }
        }
        let (words, _) = is_changed.as_chunks();
        // The factor brings the lowest bits of eight bytes together in the highest byte.
        let bits = words.iter().map(|&word| u64::from_le_bytes(word).wrapping_mul(0x0102_0408_1020_4080) >> 56);
        bits.zip((0..).step_by(8)).fold(0, |all, (bits, first)| all | bits << first)
    }
}

/// Some rows of a column, those of them that it has.
#[inline(always)]
fn part(column: &[Tick], rows: Range<usize>) -> &[Tick] {
    &column[rows.start.min(column.len())..rows.end.min(column.len())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef};
    use bevy_ecs::prelude::*;
    use bevy_ecs::system::RunSystemOnce;

    #[derive(Component)]
    struct Foreign(u32);
    #[derive(Component)]
    #[component(summary_tick)]
    struct Own(u32);
    /// Splits the entities over two tables.
    #[derive(Component)]
    struct Other;

    #[derive(Resource, Default, PartialEq, Debug)]
    struct Found(Vec<Entity>);

    fn search(all: Query<(Entity, Ref<Foreign>, Ref<Own>)>, mut found: ResMut<Found>, mut bits: Local<Vec<u64>>) {
        found.0.clear();
        for (entities, foreign, own) in all.contiguous_iter().expect("tables") {
            let (foreign, own) = (ContiguousRef::split(foreign).1, ContiguousRef::split(own).1);
            let columns = [Some(&foreign), None, Some(&own)];
            let first = found.0.len();
            for_each_changed_in(columns, |row| found.0.push(entities[row]));
            let count = note_changed(columns, &mut bits);
            let mut noted = Vec::new();
            for (&word, start) in bits.iter().zip((0..).step_by(TOGETHER)) {
                for_each_set(word, |bit| noted.push(entities[start + bit as usize]));
            }
            assert_eq!((&noted[..], count), (&found.0[first..], noted.len()));
        }
    }

    type EitherChanged = Or<(Changed<Foreign>, Changed<Own>)>;

    fn filter(all: Query<Entity, EitherChanged>, mut found: ResMut<Found>) {
        found.0 = all.iter().collect();
    }

    #[test]
    fn the_rows_are_those_of_the_changed_filter() {
        crate::ecs::parallel::set_threads(Some(4));
        let mut world = World::new();
        world.init_resource::<Found>();
        // Enough for several tasks.
        let many = 4 * LIGHT_ROWS + 300;
        let entities: Vec<Entity> = (0..many as u32).map(|i| world.spawn((Foreign(i), Own(i))).id()).collect();
        entities.iter().step_by(3).for_each(|&entity| _ = world.entity_mut(entity).insert(Other));
        let (mut ours, mut theirs) = (IntoSystem::into_system(search), IntoSystem::into_system(filter));
        ours.initialize(&mut world);
        theirs.initialize(&mut world);
        let mut both = |world: &mut World| {
            ours.run((), world).expect("runs");
            let found = world.resource_mut::<Found>().0.split_off(0);
            theirs.run((), world).expect("runs");
            assert_eq!(found, world.resource::<Found>().0);
            found.len()
        };
        assert_eq!(both(&mut world), many, "all are new");
        assert_eq!(both(&mut world), 0);
        for i in [0, 63, 64, 65, 66, 127, 199, 298, many - 1] {
            world.get_mut::<Foreign>(entities[i]).expect("lives").0 += 1;
            world.get_mut::<Own>(entities[(i + 1) % many]).expect("lives").0 += 1;
        }
        assert_eq!(both(&mut world), 14);
        // A change that comes with its row from another table.
        world.get_mut::<Own>(entities[5]).expect("lives").0 += 1;
        world.entity_mut(entities[5]).insert(Other);
        world.despawn(entities[10]);
        assert_eq!(both(&mut world), 1);
    }

    #[test]
    fn a_touched_column_says_that_something_may_have_changed_and_nothing_counts_as_changed() {
        let mut world = World::new();
        world.spawn(Own(1));
        let mut state = world.query::<(&mut Own, Entity)>();
        world.clear_trackers();
        let touch_all = |mut all: Query<&mut Own>| {
            for own in all.contiguous_iter_mut().expect("tables") {
                touch(ContiguousMut::bypass_change_detection_split(own).1);
            }
        };
        let summary = |world: &mut World, state: &mut QueryState<(&mut Own, Entity)>| {
            let (own, _) = state.contiguous_iter_mut(world).expect("tables").next().expect("one");
            let ticks = ContiguousComponentTicksRef::from(ContiguousMut::bypass_change_detection_split(own).1);
            let mut changed = 0;
            for_each_changed(&ticks, |_| changed += 1);
            (ticks.summary_tick_is_changed(), changed)
        };
        assert_eq!(summary(&mut world, &mut state), (Some(false), 0));
        world.run_system_once(touch_all).expect("runs");
        assert_eq!(summary(&mut world, &mut state), (Some(true), 0));
    }
}
