//! An image as the map tools see it, and rows of one on all cores.

use crate::name::named;
use bevy_tasks::ComputeTaskPool;
use std::sync::Mutex;
use std::thread;

/// Callback for the progress of a tool: rows or lines finished, and their total. Any thread may call it.
pub type Advance<'a> = &'a (dyn Fn(usize, usize) + Sync);

named! {
    /// Content beyond the edges of a map.
    #[derive(Default)]
    pub enum Edges {
        /// Repeat the map (tileable)
        #[default]
        Wrap = "wrap",
        /// Repeat the edge texel
        Clamp = "clamp",
    }
}

impl Edges {
    /// The place on a side of that many texels that `at` stands for.
    pub fn inside(self, at: isize, size: usize) -> usize {
        match self {
            Self::Wrap => at.rem_euclid(size as isize) as usize,
            Self::Clamp => at.clamp(0, size as isize - 1) as usize,
        }
    }
}

fn thread_count() -> usize {
    let cores = || thread::available_parallelism().map_or(1, usize::from);
    ComputeTaskPool::try_get().map_or_else(cores, |pool| pool.thread_num())
}

/// Texels of `channels` floats each, top left first, rows one after the other.
#[derive(Clone, PartialEq, Debug)]
pub struct Raster {
    /// Texels.
    pub width: usize,
    /// Texels.
    pub height: usize,
    /// Values of a texel.
    pub channels: usize,
    /// `width · height · channels` values; 0..1 where a file is to hold them as integers.
    pub values: Vec<f32>,
}

impl Raster {
    /// All zero.
    pub fn new(width: usize, height: usize, channels: usize) -> Self {
        Self { width, height, channels, values: vec![0.0; width * height * channels] }
    }

    /// Computes every row: `fill(y, row)` writes row y, `width · channels` values that are 0 before. Rows are shared
    /// out among as many threads as [`systems::set_threads`] says, else one per core; `done(n)` is told how many are
    /// finished, from any of them.
    pub fn from_rows(
        (width, height, channels): (usize, usize, usize),
        fill: impl Fn(usize, &mut [f32]) + Sync,
        done: &(dyn Fn(usize) + Sync),
    ) -> Self {
        let mut raster = Self::new(width, height, channels);
        let finished = Mutex::new(0);
        let rows = Mutex::new(raster.values.chunks_mut((width * channels).max(1)).enumerate());
        let next = || rows.lock().ok().and_then(|mut rows| rows.next());
        let work = || {
            while let Some((y, row)) = next() {
                fill(y, row);
                if let Ok(mut finished) = finished.lock() {
                    *finished += 1;
                    done(*finished);
                }
            }
        };
        thread::scope(|scope| {
            for _ in 1..thread_count() {
                scope.spawn(work);
            }
            work();
        });
        raster
    }

    /// A value of the texel at (x, y), which may lie beyond the edges.
    pub fn at(&self, x: isize, y: isize, channel: usize, edges: Edges) -> f32 {
        let (x, y) = (edges.inside(x, self.width), edges.inside(y, self.height));
        self.values[(y * self.width + x) * self.channels + channel]
    }
}
