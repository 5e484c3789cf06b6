//! What a draw takes: the same view with each technique in turn, round and round, so that a machine that is slower for a
//! while is so for all of them.

use super::stand::{Lit, Shown, Stand};
use crate::frames::FrameError;
use crate::renderer::{PICTURE_FORMAT, Settings};
use std::time::{Duration, Instant};

/// Rounds at the least and at the most.
const ROUNDS: [usize; 2] = [5, 25];
/// No round begins later, once there are enough.
const PATIENCE: Duration = Duration::from_secs(10);

/// Medians.
pub(super) struct Costs {
    /// Milliseconds of each.
    pub ms: Vec<f64>,
    /// What clock they are by.
    pub by: &'static str,
}

pub(super) fn measure(stand: &mut Stand, size: (u32, u32), shown: &[Shown]) -> Result<Costs, FrameError> {
    let target = stand.renderer.gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: Some("cost"),
        size: wgpu::Extent3d { width: size.0, height: size.1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: PICTURE_FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let target = target.create_view(&wgpu::TextureViewDescriptor::default());
    let (mut times, mut by_passes) = (vec![Vec::new(); shown.len()], true);
    let begun = Instant::now();
    for round in 0..=ROUNDS[1] {
        if round > ROUNDS[0] && begun.elapsed() > PATIENCE {
            break;
        }
        for (&shown, times) in shown.iter().zip(&mut times) {
            stand.prepare(size, shown, Lit::All, Settings::default().samples)?;
            let (idle, passes) = draw(stand, &target);
            by_passes &= passes.is_some();
            // The first round makes pipelines.
            if round > 0 {
                times.push((idle, passes.unwrap_or(idle)));
            }
        }
    }
    let ms = |times: &Vec<(f64, f64)>| {
        let mut ms: Vec<f64> = times.iter().map(|(idle, passes)| if by_passes { *passes } else { *idle }).collect();
        ms.sort_by(f64::total_cmp);
        ms.get(ms.len() / 2).copied().unwrap_or(0.0)
    };
    let by = if by_passes { "the GPU's clock" } else { "waiting until the GPU is idle" };
    Ok(Costs { ms: times.iter().map(ms).collect(), by })
}

/// Milliseconds from handing the commands in until the GPU is idle, and the sum over its passes by its own clock.
fn draw(stand: &mut Stand, target: &wgpu::TextureView) -> (f64, Option<f64>) {
    let commands = stand.renderer.record(target, PICTURE_FORMAT);
    let gpu = stand.renderer.gpu().clone();
    let begun = Instant::now();
    gpu.queue.submit([commands]);
    let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
    let idle = begun.elapsed().as_secs_f64() * 1e3;
    // Those of other pictures before are older.
    let latest = std::iter::from_fn(|| stand.renderer.pass_times()).last();
    (idle, latest.map(|passes| passes.iter().map(|pass| pass.ms).sum()))
}
