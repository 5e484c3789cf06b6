//! The frames of a benchmark on a time line, for chrome://tracing or ui.perfetto.dev: frames, their parts, stages and
//! systems on one track, the GPU's passes on another.
//!
//! The two clocks share no zero. A frame ends when the GPU is idle, so its last pass is placed to end there.

use super::frame_cost::{FrameCost, milliseconds as ms};
use serde_json::{Value, json};
use systems::ecs::stats::Stage;

const CPU: u32 = 1;
const GPU: u32 = 2;

/// The trace event format's JSON.
pub(super) fn chrome_trace(costs: &[FrameCost], adapter: &str) -> String {
    let mut events = vec![
        json!({"ph": "M", "pid": 1, "name": "process_name", "args": {"name": "relief bench"}}),
        json!({"ph": "M", "pid": 1, "tid": CPU, "name": "thread_name", "args": {"name": "CPU"}}),
        json!({"ph": "M", "pid": 1, "tid": GPU, "name": "thread_name", "args": {"name": format!("GPU: {adapter}")}}),
    ];
    for (number, cost) in costs.iter().enumerate() {
        add_frame(&mut events, number, cost);
    }
    json!({"displayTimeUnit": "ms", "traceEvents": events}).to_string()
}

/// A span; times in milliseconds, which the format wants in microseconds.
fn span(track: u32, category: &str, name: &str, start_ms: f64, ms: f64) -> Value {
    json!({"ph": "X", "pid": 1, "tid": track, "cat": category, "name": name, "ts": start_ms * 1e3, "dur": ms * 1e3})
}

fn add_frame(events: &mut Vec<Value>, number: usize, cost: &FrameCost) {
    let begin = ms(cost.at);
    events.push(span(CPU, "frame", &format!("frame {number}"), begin, ms(cost.total())));
    let parts = [
        ("move objects", cost.mutate),
        ("simulation", cost.simulate),
        ("prepare", cost.prepare),
        ("encode", cost.encode),
        ("submit, wait for the GPU", cost.submit),
    ];
    let mut at = begin;
    for (name, time) in parts {
        events.push(span(CPU, "part", name, at, ms(time)));
        at += ms(time);
    }
    let simulation = begin + ms(cost.mutate);
    let systems = &cost.frame.systems;
    for (name, stage) in Stage::ALL {
        let mut of_stage = systems.iter().filter(|system| system.stage == stage);
        if let Some(first) = of_stage.next() {
            let start = simulation + first.start_ms;
            events.push(span(CPU, "stage", name, start, cost.frame.stage_ms[stage as usize]));
        }
    }
    events.extend(systems.iter().map(|s| span(CPU, "system", s.name, simulation + s.start_ms, s.ms)));
    let last = cost.passes.iter().map(|pass| pass.start_ms + pass.ms).fold(0.0, f64::max);
    let first = begin + ms(cost.total()) - last;
    events.extend(cost.passes.iter().map(|pass| span(GPU, "pass", pass.name, first + pass.start_ms, pass.ms)));
}
