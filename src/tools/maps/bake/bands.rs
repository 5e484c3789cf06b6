//! Maps shared out among threads: bands of rows, each written by one of them.

use std::num::NonZero;
use std::sync::Mutex;
use std::thread;

/// Rows of a band, and texels of the squares that it is worked through in, so that rays that lie close together follow
/// each other and find what they need in the caches.
pub const BAND: usize = 16;

/// Some rows of all maps of a bake. A map that is not wanted is empty.
pub struct Band<'a> {
    /// The first of its rows.
    pub first_row: usize,
    /// Texels of a row.
    pub width: usize,
    /// Three for each texel.
    pub normal: &'a mut [f32],
    /// One for each texel.
    pub height: &'a mut [f32],
    /// One for each texel.
    pub occlusion: &'a mut [f32],
    /// One for each texel.
    pub coverage: &'a mut [super::Coverage],
}

impl Band<'_> {
    /// The band's texels square by square: column, row, and the index in the band.
    pub fn texels(&self) -> impl Iterator<Item = (usize, usize, usize)> + use<> {
        let (width, first_row) = (self.width, self.first_row);
        let rows = self.coverage.len() / width;
        (0..width).step_by(BAND).flat_map(move |left| {
            (0..rows)
                .flat_map(move |row| (left..width.min(left + BAND)).map(move |x| (x, first_row + row, row * width + x)))
        })
    }
}

/// Works on all items, each by one of the threads, the first first. `done(n)` is told how many are finished. Returns
/// what the items gave, in no order.
pub fn share_out<T: Send, R: Send>(
    items: impl Iterator<Item = T> + Send,
    threads: Option<NonZero<usize>>,
    work: impl Fn(T) -> R + Sync,
    done: &(dyn Fn(usize) + Sync),
) -> Vec<R> {
    let threads = threads.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZero::get);
    let items = Mutex::new(items);
    let results = Mutex::new(Vec::new());
    let next = || items.lock().ok().and_then(|mut items| items.next());
    let run = || {
        while let Some(item) = next() {
            let result = work(item);
            if let Ok(mut results) = results.lock() {
                results.push(result);
                done(results.len());
            }
        }
    };
    thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(run);
        }
        run();
    });
    results.into_inner().unwrap_or_default()
}
