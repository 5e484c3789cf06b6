//! GPU time of each pass, by timestamp queries, without ever waiting for the GPU.
//!
//! A pass asks for its [`Timestamps::render_pass`] or [`Timestamps::compute_pass`] when it begins; at the end of the
//! frame, [`Timestamps::finish`] copies the times into one of a few buffers, which is mapped once the commands are
//! handed in; [`Timestamps::take`] reads the oldest one that has arrived, a frame or more later. A frame for which no
//! buffer is free goes without.

use super::device::Gpu;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex};

/// Passes of a frame that are timed; more go without.
const MOST_PASSES: u32 = 512;
/// Frames whose times may be on their way.
const MOST_FRAMES: usize = 4;

/// When the GPU worked on a pass.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PassTime {
    /// The pass's label.
    pub name: &'static str,
    /// Milliseconds since the first pass of its frame began.
    pub start_ms: f64,
    /// Milliseconds.
    pub ms: f64,
}

/// Read-back of a frame's times that is under way.
#[derive(Debug)]
struct Arrival {
    buffer: wgpu::Buffer,
    /// The passes, two times each.
    names: Vec<&'static str>,
    state: Arc<AtomicU8>,
}

/// [`Arrival::state`]: not mapped yet.
const UNDER_WAY: u8 = 0;
/// Mapped.
const HERE: u8 = 1;
/// Could not be mapped.
const LOST: u8 = 2;

/// The queries of a device.
#[derive(Debug)]
pub(crate) struct Timestamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Nanoseconds per tick.
    period: f64,
    /// The passes of the frame that is being encoded. Behind a lock, because encoding borrows the renderer shared.
    names: Mutex<Vec<&'static str>>,
    arrivals: VecDeque<Arrival>,
    free: Vec<wgpu::Buffer>,
}

impl Timestamps {
    /// None where the device was opened without [`wgpu::Features::TIMESTAMP_QUERY`].
    pub fn new(gpu: &Gpu) -> Option<Self> {
        let device = &gpu.device;
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let buffer = |label, usage| {
            let size = u64::from(2 * MOST_PASSES) * u64::from(wgpu::QUERY_SIZE);
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let readable = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        Some(Self {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST_PASSES,
            }),
            resolved: buffer("timestamps", wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            period: gpu.queue.get_timestamp_period().into(),
            names: Mutex::default(),
            arrivals: VecDeque::new(),
            free: (0..MOST_FRAMES).map(|_| buffer("timestamps to read", readable)).collect(),
        })
    }

    /// The queries of the next pass.
    fn next(&self, name: &'static str) -> Option<(u32, u32)> {
        let mut names = self.names.lock().ok()?;
        let pass = names.len() as u32;
        (pass < MOST_PASSES).then(|| {
            names.push(name);
            (2 * pass, 2 * pass + 1)
        })
    }

    /// For the descriptor of a render pass that begins now.
    pub fn render_pass(&self, name: &'static str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.next(name).map(|(begin, end)| wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(begin),
            end_of_pass_write_index: Some(end),
        })
    }

    /// For the descriptor of a compute pass that begins now.
    pub fn compute_pass(&self, name: &'static str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.next(name).map(|(begin, end)| wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(begin),
            end_of_pass_write_index: Some(end),
        })
    }

    /// At the end of a frame's commands: sends its times on their way.
    pub fn finish(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let names = self.names.get_mut().map(std::mem::take).unwrap_or_default();
        let queries = 2 * names.len() as u32;
        if queries == 0 {
            return;
        }
        let Some(buffer) = self.free.pop() else { return };
        let bytes = u64::from(queries) * u64::from(wgpu::QUERY_SIZE);
        encoder.resolve_query_set(&self.queries, 0..queries, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &buffer, 0, bytes);
        let state = Arc::new(AtomicU8::new(UNDER_WAY));
        let arrived = state.clone();
        encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Read, 0..bytes, move |mapped| {
            arrived.store(if mapped.is_ok() { HERE } else { LOST }, Ordering::Release);
        });
        self.arrivals.push_back(Arrival { buffer, names, state });
    }

    /// The times of the oldest frame that have arrived since the last call, in the order of its passes.
    pub fn take(&mut self) -> Option<Vec<PassTime>> {
        let oldest = self.arrivals.front()?;
        let state = oldest.state.load(Ordering::Acquire);
        if state == UNDER_WAY {
            return None;
        }
        let arrival = self.arrivals.pop_front()?;
        let times = (state == HERE).then(|| self.read(&arrival)).flatten();
        arrival.buffer.unmap();
        self.free.push(arrival.buffer);
        times
    }

    fn read(&self, arrival: &Arrival) -> Option<Vec<PassTime>> {
        let bytes = 2 * arrival.names.len() as u64 * u64::from(wgpu::QUERY_SIZE);
        let mapped = arrival.buffer.slice(..bytes).get_mapped_range().ok()?;
        let tick = |bytes: &[u8]| bytes.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        let ticks: Vec<u64> = mapped.chunks_exact(wgpu::QUERY_SIZE as usize).map(tick).collect();
        let first = ticks.iter().copied().min()?;
        let ms = |ticks: u64| ticks as f64 * self.period / 1e6;
        let passes = arrival.names.iter().zip(ticks.chunks_exact(2));
        Some(
            passes
                .map(|(name, t)| PassTime { name, start_ms: ms(t[0] - first), ms: ms(t[1].saturating_sub(t[0])) })
                .collect(),
        )
    }
}
