//! Work in parts, for the threads of a pool to share.
//!
//! Work that is shared out over tasks comes through here. A scope of `bevy_tasks` brings an executor compiled for what
//! it runs, some ten thousand lines of its own. So there is one, which runs numbers.

use bevy_tasks::{ComputeTaskPool, TaskPool, TaskPoolBuilder};
use std::cell::Cell;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// So many parts for each thread keep all busy, whatever each takes.
const ENOUGH: usize = 4;

thread_local! {
    /// Set while this thread does one of enough parts: its own parts are shared out no further.
    static IS_BUSY: Cell<bool> = const { Cell::new(false) };
}

/// Sets the number of worker threads of this process; `None`: one per core. Returns how many there are: only the first
/// call counts, and the first [`Simulation`](crate::Simulation) makes it if nothing did. Results are the same for any
/// number.
pub fn set_threads(threads: Option<usize>) -> usize {
    let pool = ComputeTaskPool::get_or_init(|| {
        let builder = TaskPoolBuilder::new().thread_name("relief".into());
        match threads {
            Some(threads) => builder.num_threads(threads).build(),
            None => builder.build(),
        }
    });
    pool.thread_num()
}

/// Does the parts of some work in tasks. Some are done here and now, one after the other: a single part; all where
/// there is one thread; and those within a part of work that keeps all threads busy, such as a step of one of many
/// worlds.
pub fn in_parallel<T: Send>(parts: impl ExactSizeIterator<Item = T>, work: impl Fn(T) + Sync) {
    on_pool(ComputeTaskPool::get(), parts, work);
}

/// [`in_parallel`] with results, in the order of the parts.
pub fn map_in_parallel<T: Send, R: Send>(
    parts: impl ExactSizeIterator<Item = T>,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    map_on_pool(ComputeTaskPool::get(), parts, work)
}

/// [`in_parallel`] on the threads of a certain pool.
pub fn on_pool<T: Send>(pool: &TaskPool, parts: impl ExactSizeIterator<Item = T>, work: impl Fn(T) + Sync) {
    if parts.len() < 2 || pool.thread_num() < 2 || IS_BUSY.get() {
        return parts.for_each(work);
    }
    let parts: Vec<Mutex<Option<T>>> = parts.map(|part| Mutex::new(Some(part))).collect();
    let is_enough = parts.len() >= ENOUGH * pool.thread_num();
    run(pool, parts.len(), &|number| {
        let _busy = Busy::set(is_enough);
        // Nothing else asks for the part of that number, and nothing panics while it is taken out.
        let part = parts[number].lock().ok().and_then(|mut part| part.take());
        part.into_iter().for_each(&work);
    });
}

/// [`map_in_parallel`] on the threads of a certain pool.
pub fn map_on_pool<T: Send, R: Send>(
    pool: &TaskPool,
    parts: impl ExactSizeIterator<Item = T>,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let mut results: Vec<Option<R>> = Vec::new();
    results.resize_with(parts.len(), || None);
    on_pool(pool, parts.zip(&mut results), |(part, result)| *result = Some(work(part)));
    results.into_iter().flatten().collect()
}

/// [`IS_BUSY`] while it lives.
struct Busy(bool);

impl Busy {
    fn set(is_busy: bool) -> Self {
        Self(IS_BUSY.replace(is_busy))
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        IS_BUSY.set(self.0);
    }
}

/// A task for each thread, the caller's among them, takes number after number: a task of its own for each part would
/// wake threads as often.
fn run(pool: &TaskPool, count: usize, work: &(dyn Fn(usize) + Sync)) {
    let next = &AtomicUsize::new(0);
    let take = move || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&number| number < count);
    let tasks = count.min(pool.thread_num() + 1);
    pool.scope(|scope| (0..tasks).for_each(|_| scope.spawn(async move { std::iter::from_fn(take).for_each(work) })));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_is_done_once_and_results_come_in_order() {
        for threads in 1..4 {
            let pool = TaskPoolBuilder::new().num_threads(threads).build();
            for count in [0, 1, 2, 100] {
                let mut parts: Vec<usize> = vec![0; count];
                on_pool(&pool, parts.iter_mut().enumerate(), |(i, part)| *part += i + 1);
                assert_eq!(parts, (1..=count).collect::<Vec<_>>());
                // A part may be work in parts itself.
                let sums =
                    map_on_pool(&pool, 0..count, |i| map_on_pool(&pool, 0..3, |k| i * 10 + k).iter().sum::<usize>());
                assert_eq!(sums, (0..count).map(|i| 30 * i + 3).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn parts_of_many_parts_stay_on_their_thread() {
        let pool = TaskPoolBuilder::new().num_threads(2).build();
        let here = || std::thread::current().id();
        let strays = |count: usize| {
            let inner = || {
                map_on_pool(&pool, 0..8, |_| {
                    std::thread::sleep(std::time::Duration::from_millis(2));
                    here()
                })
            };
            let found = map_on_pool(&pool, 0..count, |_| (here(), inner()));
            found.iter().flat_map(|(own, inner)| inner.iter().filter(move |thread| *thread != own)).count()
        };
        assert_eq!(strays(8), 0);
        // Few are shared out further: while one thread waits, the others take from it.
        assert!((0..20).any(|_| strays(2) > 0));
        assert!(!IS_BUSY.get());
    }
}
