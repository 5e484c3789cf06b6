//! Cost of draws: the same view with each technique in turn, round and round. A machine that is slower for a while is
//! so for all of them.

use super::test_scene::{Lit, Shown, TestScene};
use crate::frames::FrameError;
use crate::renderer::{PICTURE_FORMAT, Settings, texture};
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

/// Rounds of techniques that are counted.
pub(super) const ROUNDS: RangeInclusive<usize> = 5..=25;
/// Rounds of the displaced figure, which takes a hundred times as long where there is no GPU.
pub(super) const FEW_ROUNDS: RangeInclusive<usize> = 3..=5;
/// No round begins later, once there are enough.
const PATIENCE: Duration = Duration::from_secs(10);

/// Costs of draws, in the order they were asked for.
pub(super) struct Costs {
    /// Medians, milliseconds.
    pub ms: Vec<f64>,
    /// Medians over the rounds of the time over that of the first.
    pub times_first: Vec<f64>,
    /// Clock of the measurement.
    pub by: &'static str,
}

pub(super) fn measure(
    stand: &mut TestScene,
    size: (u32, u32),
    shown: &[Shown],
    counts: RangeInclusive<usize>,
) -> Result<Costs, FrameError> {
    let device = &stand.renderer.gpu().device;
    let target = texture(device, "cost", size, PICTURE_FORMAT, 1, wgpu::TextureUsages::RENDER_ATTACHMENT);
    let target = target.create_view(&wgpu::TextureViewDescriptor::default());
    let mut rounds = Vec::new();
    let begun = Instant::now();
    // The first makes pipelines and is not counted.
    while rounds.len() <= *counts.end() && (rounds.len() <= *counts.start() || begun.elapsed() < PATIENCE) {
        let mut round = Vec::new();
        for &shown in shown {
            stand.prepare(size, shown, Lit::All, Settings::default().samples)?;
            round.push(draw(stand, &target));
        }
        rounds.push(round);
    }
    rounds.remove(0);
    let by_passes = rounds.iter().flatten().all(|(_, passes)| passes.is_some());
    let ms = |(idle, passes): &(f64, Option<f64>)| passes.filter(|_| by_passes).unwrap_or(*idle);
    let rounds: Vec<Vec<f64>> = rounds.iter().map(|round| round.iter().map(ms).collect()).collect();
    let medians = |of: &dyn Fn(&[f64], usize) -> f64| {
        (0..shown.len()).map(|i| median(rounds.iter().map(|round| of(round, i)).collect())).collect()
    };
    Ok(Costs {
        ms: medians(&|round, i| round[i]),
        times_first: medians(&|round, i| round[i] / round[0].max(1e-9)),
        by: if by_passes { "the GPU's clock" } else { "waiting until the GPU is idle" },
    })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Milliseconds from handing the commands in until the GPU is idle, and the sum over its passes by its own clock.
fn draw(stand: &mut TestScene, target: &wgpu::TextureView) -> (f64, Option<f64>) {
    let commands = stand.renderer.encode(target, PICTURE_FORMAT);
    let gpu = stand.renderer.gpu().clone();
    let begun = Instant::now();
    gpu.queue.submit([commands]);
    gpu.poll(wgpu::PollType::wait_indefinitely());
    let idle = begun.elapsed().as_secs_f64() * 1e3;
    // Those of other pictures before are older.
    let latest = std::iter::from_fn(|| stand.renderer.pass_times()).last();
    (idle, latest.map(|passes| passes.iter().map(|pass| pass.ms).sum()))
}
