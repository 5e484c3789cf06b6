//! Weather of a world: as data, and changes of it.

use crate::errors::Failure;
use crate::given::arguments::{Given, Keywords, optional, within};
use crate::given::described;
use crate::sims::sim::Sim;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::scene::weather_preset;
use relief::systems::describe::{Field, fields_of, schema};
use relief::systems::ecs::clock::Clock;
use relief::systems::run::standard_inputs::SetWeather;
use relief::systems::space::GeoOrigin;
use relief::systems::weather::{Weather, WeatherTimeline};
use serde_json::Value;

#[pymethods]
impl Sim {
    /// Weather at this step: a dict with the fields of `weather` in a scene, and its date at this step.
    #[getter]
    fn weather<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let now = self.with(py, |world| {
            let world = &world.simulation.world;
            Ok(world.resource::<WeatherTimeline>().now(world.resource::<Clock>()))
        })?;
        described::shown(py, &described::values(&now)?, schema::<Weather>())
    }

    /// Changes the weather: to that of `preset`, or as it is now where none is given, with `fields` in the place of its
    /// own, by the names that `weather` has. The change takes `over_seconds` of the clock, 0 to 86400, and is linear
    /// in each field; `sky` changes at once. None takes a direction of sun or moon away, which stand by the date then.
    /// It is an input, so recordings have it, and state, so snapshots do. Raises ValueError, also for a sun by date
    /// in a scene without `geo_origin`.
    #[pyo3(signature = (preset=None, *, over_seconds=None, **fields))]
    fn set_weather(
        &self,
        py: Python<'_>,
        preset: Given<'_, '_>,
        over_seconds: Given<'_, '_>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let over_seconds = within("over_seconds", over_seconds, "seconds", 0.0..=SetWeather::LONGEST)?.unwrap_or(0.0);
        let named: Option<String> = optional("preset", preset)?;
        let base = named.map(|name| weather_preset(&name).map_err(Failure::value)).transpose()?;
        let schema = schema::<Weather>();
        let mut arguments = Keywords::new(fields);
        let read =
            |fields: Value| serde_json::from_value::<Weather>(fields).map(drop).map_err(|error| error.to_string());
        let mut given = described::take(&mut arguments, schema, &|_| true, &read)?;
        arguments.finish()?;
        let own = |name: &str| fields.and_then(|all| all.get_item(name).ok().flatten());
        let is_taken_away =
            |field: &Field| field.schema["default"].is_null() && own(field.name).is_some_and(|given| given.is_none());
        let taken_away = fields_of(schema).filter(is_taken_away);
        given.extend(taken_away.map(|field| (field.name.to_owned(), Value::Null)));
        self.with(py, move |world| {
            let own = &world.simulation.world;
            let now = own.resource::<WeatherTimeline>().now(own.resource::<Clock>());
            let base = base.map(|preset| Weather { date: now.date, time_speed: now.time_speed, ..preset });
            let mut all =
                serde_json::to_value(base.unwrap_or(now)).map_err(|error| Failure::value(error.to_string()))?;
            given.into_iter().for_each(|(name, value)| all[name] = value);
            let weather: Weather = described::checked(all)?;
            if weather.needs_place() && own.get_resource::<GeoOrigin>().is_none() {
                return Err(Failure::value(Weather::EXPECTED_PLACE));
            }
            world.apply(SetWeather { weather, over_seconds })
        })
    }
}
