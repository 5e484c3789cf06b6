//! An image as the map tools see it, and rows of one on all cores.

use crate::name::named;
use bevy_tasks::ComputeTaskPool;
use std::sync::Mutex;
use std::thread;
use systems::assets::{Image, ImageKind};

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

/// Works on all items, each by one of the threads, the first first. `done(n)` is told how many are finished. Returns
/// what the items gave, in no order.
pub(super) fn share_out<T: Send, R: Send>(
    items: impl Iterator<Item = T> + Send,
    threads: usize,
    work: impl Fn(T) -> R + Sync,
    done: &(dyn Fn(usize) + Sync),
) -> Vec<R> {
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
        let rows = raster.values.chunks_mut((width * channels).max(1)).enumerate();
        let cores = || thread::available_parallelism().map_or(1, usize::from);
        let threads = ComputeTaskPool::try_get().map_or_else(cores, |pool| pool.thread_num());
        share_out(rows, threads, |(y, row)| fill(y, row), done);
        raster
    }

    /// An image of 8 bits: grey of one channel, opaque without a fourth.
    pub fn rgba8(&self, name: &str, kind: ImageKind) -> Image {
        let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
        let texel = |texel: &[f32]| {
            let channel = |channel: usize| texel.get(channel).copied().unwrap_or(texel[0]);
            [channel(0), channel(1), channel(2), texel.get(3).copied().unwrap_or(1.0)].map(byte)
        };
        let texels = self.values.chunks(self.channels.max(1)).flat_map(texel).collect();
        Image::rgba8(name, self.width as u32, self.height as u32, kind, texels)
    }

    /// A value of the texel at (x, y), which may lie beyond the edges.
    pub fn at(&self, x: isize, y: isize, channel: usize, edges: Edges) -> f32 {
        let (x, y) = (edges.inside(x, self.width), edges.inside(y, self.height));
        self.values[(y * self.width + x) * self.channels + channel]
    }
}
