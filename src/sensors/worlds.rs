//! Sensors of several worlds, captured together: views of all their cameras are drawn in one submission.

use super::capture::Capture;
use super::suite::{Asked, SensorSuite};
use crate::renderer::{RenderError, ViewBatches, WorldViews, draw_worlds};
use systems::Simulation;
use systems::ecs::parallel::map_in_parallel;

/// Captures all sensors of some worlds that are due and whose names are wanted. A world's capture is the one that
/// [`SensorSuite::capture_some`] gives, to the bit: whatever the other worlds are, and whatever the number of threads.
/// All suites are to be of one device. `batches`: kept from one capture to the next, in which the order of the worlds
/// is to be the same; another order takes longer.
///
/// # Errors
/// [`RenderError`], of the first world that has one.
pub fn capture_worlds(
    worlds: &mut [(&mut SensorSuite, &mut Simulation)],
    batches: &mut ViewBatches,
    wanted: impl Fn(&str) -> bool + Sync,
) -> Result<Vec<Capture>, RenderError> {
    let asked = map_in_parallel(worlds.iter_mut(), |(suite, simulation)| {
        let due = suite.due(simulation, &wanted);
        suite.ask(due)
    });
    let asked: Vec<Asked> = asked.into_iter().collect::<Result<_, _>>()?;
    let views = worlds.iter_mut().zip(&asked);
    let mut views: Vec<WorldViews<'_>> =
        views.map(|((suite, simulation), asked)| WorldViews::new(suite.renderer(), simulation, &asked.views)).collect();
    let drawn = draw_worlds(&mut views, batches)?;
    drop(views);
    let parts: Vec<_> = worlds.iter_mut().zip(asked).zip(drawn).collect();
    let measured = map_in_parallel(parts.into_iter(), |(((suite, simulation), asked), drawn)| {
        suite.measure(simulation, asked, &drawn)
    });
    measured.into_iter().collect()
}
