//! Routes and signals of a world, as data; signals that are held.

use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Argument, Given, Names, Row, finite, optional, required, wrong_type};
use crate::sims::sim::Sim;
use crate::worlds::world::World;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFrozenSet, PySet};
use relief::glam::DVec3;
use relief::name;
use relief::systems::run::standard_inputs::SetSignal;
use relief::systems::vehicles::routes::{self, Routes};
use relief::systems::vehicles::signals::{Aspect, Signal, Signals};

/// Aspects of signal heads by name.
const ASPECTS: [(&str, Aspect); 3] = [("red", Aspect::Red), ("amber", Aspect::Amber), ("green", Aspect::Green)];

/// A road to follow.
#[pyclass(frozen, module = "relief")]
pub struct Route {
    /// Its name.
    #[pyo3(get)]
    name: String,
    /// Length of its centre line, metres.
    #[pyo3(get)]
    length: f64,
    /// Number of lanes.
    #[pyo3(get)]
    lanes: u8,
    /// Metres from the middle of a lane to that of the next.
    #[pyo3(get)]
    lane_width: f32,
    /// Closed loop: the end is the beginning.
    #[pyo3(get)]
    closed: bool,
    /// Speed limit from the scene at its beginning, m/s.
    #[pyo3(get)]
    speed_limit: f32,
    /// The names of the routes that may follow.
    #[pyo3(get)]
    then: Vec<String>,
    route: routes::Route,
    offsets: Vec<f32>,
    origin: DVec3,
}

#[pymethods]
impl Route {
    /// Points of a lane, or of the centre line where none is given, so many metres along the centre line, in the
    /// scene's coordinates: float64 (N, 3). A closed route goes round; beyond the ends of another it raises ValueError.
    #[pyo3(signature = (along, lane=None))]
    fn points<'py>(
        &self,
        py: Python<'py>,
        along: &Bound<'_, PyAny>,
        lane: Given<'_, '_>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Row(along) = required("along", along)?;
        along.iter().try_for_each(|&at| self.refuse_beyond(at))?;
        let left = match optional::<usize>("lane", lane)? {
            None => 0.0,
            Some(lane) => *self
                .offsets
                .get(lane)
                .ok_or_else(|| Failure::value(format!("lane: expected less than {}, found {lane}", self.lanes)))?,
        };
        let points: Vec<DVec3> = along.iter().map(|&at| self.route.place(at).beside(left) + self.origin).collect();
        Ok(Array2::from_shape_fn((points.len(), 3), |(point, axis)| points[point][axis]).into_pyarray(py))
    }

    /// Heading there: radians about +Y, 0 along +Z, left positive. Raises ValueError as `points` does.
    fn yaw(&self, along: &Bound<'_, PyAny>) -> PyResult<f64> {
        let along = finite("along", required("along", along)?)?;
        self.refuse_beyond(along)?;
        let tangent = self.route.place(along).tangent.as_dvec2();
        Ok(tangent.x.atan2(tangent.y))
    }

    fn __repr__(&self) -> String {
        format!("<route {:?}, {:.1} m, {} lanes>", self.name, self.length, self.lanes)
    }
}

impl Route {
    /// An open route ends.
    fn refuse_beyond(&self, along: f64) -> Outcome<()> {
        if self.closed || (0.0..=self.length).contains(&along) {
            return Ok(());
        }
        Err(Failure::value(format!(
            "along: expected metres from 0 to {}, the route's length, found {along}",
            self.length
        )))
    }
}

impl World {
    pub fn routes(&self) -> Vec<Route> {
        let known = self.simulation.world.resource::<Routes>();
        let name = |id| known.get(id).map_or_else(String::new, |route| route.plan.name.clone());
        let described = |route: &routes::Route| Route {
            name: route.plan.name.clone(),
            length: route.length,
            lanes: route.lanes(),
            lane_width: route.lane_width(),
            closed: route.closed,
            speed_limit: route.plan.speed_limit,
            then: route.then.iter().map(|next| name(next.id)).collect(),
            offsets: (0..route.lanes()).map(|lane| known.offset(route, lane)).collect(),
            origin: self.origin(),
            route: route.clone(),
        };
        known.iter().map(|(_, route)| described(route)).collect()
    }

    /// Names of signals, and what each of their groups shows and for how many seconds still; infinite where it is held.
    pub fn signals(&self) -> Vec<(String, Vec<(&'static str, f32)>)> {
        let signals = self.simulation.world.resource::<Signals>();
        let aspect = |group: &(Aspect, f32)| (name::of(&ASPECTS, group.0), group.1);
        let mut heads = signals.heads().iter().map(aspect);
        let of = |signal: &Signal| (signal.name.clone(), heads.by_ref().take(signal.green.len()).collect());
        signals.iter().map(of).collect()
    }

    /// Number of groups of a signal.
    fn groups(&self, signal: &str) -> Outcome<usize> {
        let signals = self.simulation.world.resource::<Signals>();
        let found = signals.iter().find(|known| known.name == signal);
        found.map(|known| known.green.len()).ok_or_else(|| {
            let known = signals.iter().map(|known| known.name.as_str());
            Failure::Name(name::unknown("signal", known, signal))
        })
    }
}

/// Aspects of so many groups: from one name for all of them, or a name for each.
fn aspects(names: &Names, groups: usize) -> Outcome<Vec<Aspect>> {
    let aspect = |wanted: &String| {
        name::find("aspect", &ASPECTS, wanted).map_err(|message| Failure::value(format!("shows: {message}")))
    };
    match names {
        Names::One(all) => Ok(vec![aspect(all)?; groups]),
        Names::Several(each) if each.len() == groups => each.iter().map(aspect).collect(),
        Names::Several(other) => {
            let found = if other.len() == 1 { "a list of 1".into() } else { other.len().to_string() };
            Err(Failure::value(format!("shows: expected one name, or {groups}, one for each group, found {found}")))
        }
    }
}

#[pymethods]
impl Sim {
    /// Holds a signal: from now on its groups show `shows`, "red", "amber" or "green" each, or one of them for all,
    /// whatever the time. None releases it, and it goes on by its times. While it is held, `signals` has infinite
    /// seconds. It is an input, so recordings have it, and state, so snapshots do. Groups that are held at green
    /// together do not see each other come. Raises KeyError, which names the nearest.
    #[pyo3(signature = (name, shows))]
    fn set_signal(&self, py: Python<'_>, name: &Bound<'_, PyAny>, shows: Given<'_, '_>) -> PyResult<()> {
        let signal: String = required("name", name)?;
        let is_unordered = |given: &Bound<'_, PyAny>| {
            given.is_instance_of::<PySet>() || given.is_instance_of::<PyFrozenSet>() || given.is_instance_of::<PyDict>()
        };
        if let Some(given) = shows.filter(|given| is_unordered(given)) {
            return Err(wrong_type("shows", &Names::expected(), given));
        }
        let names: Option<Names> = optional("shows", shows)?;
        self.with(py, move |world| {
            let groups = world.groups(&signal)?;
            let shows = names.map(|names| aspects(&names, groups)).transpose()?;
            world.apply(SetSignal { signal, shows })
        })
    }
}
