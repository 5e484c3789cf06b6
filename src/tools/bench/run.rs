//! `relief bench`: one scene, drawn frame after frame, each until the GPU is idle.
//!
//! Waiting in every frame keeps one frame's work out of another's time, at the price of work that could overlap.

use super::floor::Floor;
use super::frame_cost::{FrameCost, milliseconds};
use super::grid::{Grid, GridMesh, GridView};
use super::job::BenchJob;
use super::machine::{Build, peak_memory_mb};
use super::measurement::{Measurement, Spread};
use super::subject::Subject;
use super::trace::chrome_trace;
use crate::frames;
use crate::import::compress::compress_images;
use crate::name;
use crate::output;
use crate::recording::RecordingError;
use crate::renderer::{Gpu, GpuError, Occlusion, PICTURE_FORMAT, RenderError, Settings, SingleView, texture};
use crate::tools::error::ToolError;
use crate::viewpoint::Viewpoint;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use systems::assets::Library;
use systems::assets::texture_memory;
use systems::draw::View;
use systems::ecs::stats::{FrameStats, Stage};
use systems::lights::{LightPolicies, LightPolicy};

/// Draws a world into a texture.
struct Bench {
    subject: Subject,
    renderer: SingleView,
    settings: Settings,
    size: (u32, u32),
    target: wgpu::TextureView,
    frame: u32,
    started: Instant,
}

/// Measures a scene; `started` is when the program started. `progress` is called after
/// each frame with how many are done and how many there will be at the most.
///
/// # Errors
/// [`ToolError`].
pub fn run(job: &BenchJob, started: Instant, mut progress: impl FnMut(u32, u32)) -> Result<Measurement, ToolError> {
    systems::set_threads(job.threads);
    for file in job.picture.iter().chain(&job.trace) {
        output::check_file(file)?;
    }
    if let (Some(picture), Some(trace)) = (&job.picture, &job.trace)
        && output::is_same(picture, trace)
    {
        return Err(RecordingError::taken(trace).into());
    }
    if let GridMesh::Model(model) = &job.plan.mesh {
        let outputs = || job.picture.iter().chain(&job.trace);
        frames::check_outputs(std::slice::from_ref(model), |path| outputs().any(|out| output::is_same(path, out)))?;
    }
    let mut start = Start::new(started);
    let mut bench = Bench::new(job, &mut start)?;
    bench.draw()?;
    start.lap("first draw");

    let (cap, measured) = (Duration::from_secs(job.seconds.into()), job.frames);
    let (warm_up, whole) = (job.warm_up, job.warm_up + measured);
    let begun = Instant::now();
    for done in 1..warm_up {
        if done > 3 && begun.elapsed() > cap / 4 {
            break;
        }
        bench.draw()?;
        progress(done, whole);
    }
    let begun = Instant::now();
    let mut costs = Vec::new();
    while costs.len() < measured as usize && (costs.len() < 5 || begun.elapsed() < cap) {
        costs.push(bench.draw()?);
        progress(warm_up + costs.len() as u32, whole);
    }
    let mut measurement = bench.measurement(job, &costs, start);
    if job.floor {
        measurement.floor_ms_median = bench.floor(costs.len());
    }
    if let Some(path) = &job.picture {
        let picture = bench.renderer.draw_picture();
        bench.renderer.gpu().check()?;
        output::write_png(path, &picture.into())?;
    }
    if let Some(path) = &job.trace {
        output::write_whole(path, chrome_trace(&costs, &measurement.adapter).as_bytes())?;
    }
    Ok(measurement)
}

/// Parts of the time to the first frame.
struct Start {
    started: Instant,
    last: Instant,
    parts: BTreeMap<String, f64>,
}

impl Start {
    fn new(started: Instant) -> Self {
        Self { started, last: started, parts: BTreeMap::new() }
    }

    fn lap(&mut self, part: &str) {
        let now = Instant::now();
        self.parts.insert(part.to_owned(), milliseconds(now - self.last));
        self.last = now;
    }
}

/// Opens the adapter; passes are timed where it has a clock.
fn open() -> Result<SingleView, GpuError> {
    let mut renderer = SingleView::new(&Gpu::headless()?);
    renderer.time_passes();
    Ok(renderer)
}

impl Bench {
    fn new(job: &BenchJob, start: &mut Start) -> Result<Self, ToolError> {
        // The driver takes its time to start; the world is made meanwhile.
        let opening = std::thread::spawn(open);
        let opened = || opening.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        let (mut subject, renderer) = match &job.scene {
            Some(path) => {
                let subject = Subject::scene(path, job);
                start.lap("load the scene");
                let renderer = opened();
                start.lap("waiting for the driver");
                (subject?, renderer?)
            }
            None => {
                let plan = &job.plan;
                let yard = Grid::empty(plan).map(|(mut yard, kit)| {
                    if job.load.compress {
                        compress_images(&mut yard.simulation.world.resource_mut::<Library>(), None);
                    }
                    (yard, kit)
                });
                start.lap("mesh and maps");
                let renderer = opened();
                start.lap("waiting for the driver");
                let ((mut yard, kit), renderer) = (yard?, renderer?);
                yard.fill(plan, &kit);
                start.lap("spawn");
                (Subject::Grid(Box::new(yard)), renderer)
            }
        };
        let gpu = renderer.gpu();
        let world = &mut subject.simulation().world;
        let of_grid = job.scene.is_none().then_some(LightPolicy::Three);
        world.resource_mut::<LightPolicies>().forced = job.lights_policy.or(of_grid);
        world.resource_mut::<Library>().keep_texels(false);
        let limit = gpu.device.limits().max_texture_dimension_2d;
        let longest = job.size.0.max(job.size.1);
        if longest > limit {
            let (needed, limit) = (longest.into(), limit.into());
            return Err(
                RenderError::TooLarge { what: "the picture", unit: "pixels along a side", needed, limit }.into()
            );
        }
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let target = texture(&gpu.device, "benchmark", job.size, PICTURE_FORMAT, 1, usage);
        let target = target.create_view(&wgpu::TextureViewDescriptor::default());
        let settings = Settings {
            technique: job.technique,
            samples: job.samples,
            levels: job.levels,
            occlusion: job.occlusion,
            shadow_maps: job.shadows.unwrap_or(Settings::default().shadow_maps),
            ..Settings::default()
        };
        Ok(Self { subject, renderer, settings, size: job.size, target, frame: 0, started: start.started })
    }

    /// Moves what moves, draws, and waits for the GPU.
    fn draw(&mut self) -> Result<FrameCost, ToolError> {
        let mut clock = Instant::now();
        let at = clock - self.started;
        let mut lap = || {
            let begun = std::mem::replace(&mut clock, Instant::now());
            clock - begun
        };
        self.subject.advance(self.frame);
        let mutate = lap();
        let viewpoint = self.subject.viewpoint();
        let simulation = self.subject.simulation();
        simulation.frame();
        let simulate = lap();
        let view: View = viewpoint.view(&simulation.world, self.size);
        simulation.with_frame(|frame| self.renderer.prepare(frame, &view, &self.settings))?;
        let prepare = lap();
        let commands = self.renderer.encode(&self.target, PICTURE_FORMAT);
        let encode = lap();
        let gpu = self.renderer.gpu();
        gpu.queue.submit([commands]);
        // A lost device has nothing left to wait for.
        gpu.poll(wgpu::PollType::wait_indefinitely());
        let submit = lap();
        self.frame += 1;
        let frame = simulation.world.resource::<FrameStats>().clone();
        let passes = self.renderer.pass_times().unwrap_or_default();
        Ok(FrameCost { at, mutate, simulate, prepare, encode, submit, frame, render: self.renderer.stats(), passes })
    }

    /// Time of the triangles of the objects in view by themselves, milliseconds: the median of so many frames.
    fn floor(&mut self, frames: usize) -> Option<f64> {
        let Subject::Grid(yard) = &mut self.subject else { return None };
        let view = Viewpoint::Camera(yard.camera).view(&yard.simulation.world, self.size);
        let gpu = self.renderer.gpu();
        let floor = Floor::new(gpu, yard, &view)?;
        let times = (0..frames + 2).map(|_| milliseconds(floor.draw(gpu, &self.target)));
        // The first two warm up.
        let times = times.skip(2);
        Some(Spread::of(times).median)
    }

    fn measurement(&mut self, job: &BenchJob, costs: &[FrameCost], start: Start) -> Measurement {
        let (objects, lights) = match &job.scene {
            Some(_) => self.subject.counts(),
            None => (job.plan.objects, job.plan.lights),
        };
        let spread = |of: &dyn Fn(&FrameCost) -> f64| Spread::of(costs.iter().map(of));
        let ms = |of: &dyn Fn(&FrameCost) -> Duration| spread(&|cost| milliseconds(of(cost)));
        let (frame, cpu, gpu) = (ms(&FrameCost::total), ms(&FrameCost::engine), ms(&|c| c.submit));
        let last = costs.last().map(|cost| cost.render).unwrap_or_default();
        let drawn = self.renderer.read_visible_counts();
        let info = self.renderer.gpu().adapter.get_info();
        let view = match &job.scene {
            Some(_) => job.camera.clone().unwrap_or_default(),
            None => name::of(&GridView::ALL, job.plan.view).to_owned(),
        };
        Measurement {
            scene: job.scene.as_ref().map(|path| path.display().to_string()),
            objects,
            lights,
            mesh: if job.scene.is_some() { String::new() } else { job.plan.mesh.name() },
            moving: job.plan.moving,
            view,
            size: self.size.into(),
            samples: job.samples,
            lights_policy: match job.lights_policy {
                Some(policy) => policy.name().to_owned(),
                None if job.scene.is_none() => LightPolicy::Three.name().to_owned(),
                None => "scene".to_owned(),
            },
            technique: job.technique.map(|technique| technique.name().to_owned()),
            levels: job.levels.enabled,
            occlusion: name::of(&Occlusion::ALL, job.occlusion).to_owned(),
            shadow_layers: self.renderer.stats().shadows.layers,
            shadow_passes_median: spread(&|c| f64::from(c.render.shadows.passes)).median,
            compress: job.load.compress,
            hdr: true,
            threads: bevy_tasks::ComputeTaskPool::get().thread_num() as u32,
            frames: costs.len() as u32,
            frame_ms_median: frame.median,
            frame_ms_p05: frame.p05,
            frame_ms_p95: frame.p95,
            cpu_ms_median: cpu.median,
            cpu_ms_p05: cpu.p05,
            cpu_ms_p95: cpu.p95,
            gpu_ms_median: gpu.median,
            gpu_ms_p05: gpu.p05,
            gpu_ms_p95: gpu.p95,
            floor_ms_median: None,
            select_ms_median: spread(&|c| c.frame.stage_ms[Stage::Lights as usize]).median,
            simulate_ms_median: ms(&|c| c.simulate).median,
            prepare_ms_median: ms(&|c| c.prepare).median,
            encode_ms_median: ms(&|c| c.encode).median,
            mutate_ms_median: ms(&|c| c.mutate).median,
            stages: medians(costs, |c| {
                Stage::ALL.iter().map(|&(name, stage)| (name, c.frame.stage_ms[stage as usize])).collect()
            }),
            systems: medians(costs, |c| c.frame.systems.iter().map(|system| (system.name, system.ms)).collect()),
            gpu_passes: Some(medians(costs, |c| c.passes.iter().map(|pass| (pass.name, pass.ms)).collect()))
                .filter(|passes| !passes.is_empty()),
            upload_bytes_median: spread(&|c| c.render.uploaded_bytes() as f64).median as u64,
            draws: last.draws,
            drawn_objects: drawn.objects,
            triangles: drawn.triangles,
            culled_objects: objects.saturating_sub(drawn.objects),
            texture_bytes: texture_memory::used(self.subject.simulation().library()).bytes,
            rss_mb: peak_memory_mb(),
            bytes_per_object: None,
            first_frame_ms: milliseconds(start.last - start.started),
            start_ms: start.parts,
            adapter: self.renderer.gpu().name(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            build: Build::this(),
        }
    }
}

/// The median of every named time; a name's times in a frame are added up.
fn medians(costs: &[FrameCost], times: impl Fn(&FrameCost) -> Vec<(&'static str, f64)>) -> BTreeMap<String, f64> {
    let mut values: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (frame, cost) in costs.iter().enumerate() {
        for (name, ms) in times(cost) {
            let values = values.entry(name).or_default();
            values.resize(frame + 1, 0.0);
            values[frame] += ms;
        }
    }
    let median = |mut values: Vec<f64>| {
        values.resize(costs.len(), 0.0);
        Spread::of(values).median
    };
    values.into_iter().map(|(name, values)| (name.to_owned(), median(values))).collect()
}
