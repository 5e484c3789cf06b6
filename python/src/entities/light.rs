//! Lights of a world.

use crate::entities::entity::Entity;
use crate::entities::own::with;
use crate::errors::{Failure, Outcome};
use crate::given::arguments::required;
use crate::given::described::{convert, shown, values};
use crate::given::light::Light;
use crate::worlds::world::World;
use pyo3::prelude::*;
use relief::systems::describe::{faults, fields, schema};
use relief::systems::lights::{self, LightDescription, LightFields};
use relief::systems::run::registry::StateId;
use relief::systems::run::standard_inputs::EditLight;
use serde_json::json;

/// A light of a world. Setting one of its fields takes effect at once; a recording has it. Fields are those that scene
/// files have for lights (docs/scenes.md).
#[pyclass(frozen, extends = Entity, module = "relief")]
pub struct LightEntity;

#[pymethods]
impl LightEntity {
    /// "point", "spot" or "directional".
    #[getter]
    fn kind(own: PyRef<'_, Self>) -> PyResult<&'static str> {
        light(&own).map(|light| light.kind.name())
    }

    /// Gives it all of another description.
    fn change(own: PyRef<'_, Self>, light: &Bound<'_, PyAny>) -> PyResult<()> {
        let light: Light = required("light", light)?;
        apply(&own, light.0)
    }

    /// A field of its description.
    fn _field(own: PyRef<'_, Self>, name: &str) -> PyResult<Py<PyAny>> {
        let fields = values(LightDescription::from(&light(&own)?).fields())?;
        Ok(shown(own.py(), &fields[name], &schema::<LightFields>()["properties"][name])?.unbind())
    }

    /// Changes a field of its description.
    fn _set_field(own: PyRef<'_, Self>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let now = light(&own)?;
        let (kind, known) = (now.kind.name(), fields::<LightFields>());
        let Some(field) = known.iter().find(|field| field.name == name) else { return Ok(()) };
        let whole = |value| serde_json::from_value::<LightFields>(json!({ name: value })).map(drop);
        let value = convert(field, value, &|value| whole(value).map_err(|error| error.to_string()))?;
        if !field.is_of(kind) {
            return Err(Failure::value(format!("{name}: {}", field.refusal(&format!("{kind} light")))).into());
        }
        let before = LightDescription::from(&now);
        let mut fields = values(before.fields())?;
        fields[name] = value;
        let edited = before.edited(fields).map_err(|error| Failure::value(error.to_string()))?;
        // Lights of files may be beyond the ranges of descriptions, and are left so.
        let known = faults(&before);
        match faults(&edited).into_iter().find(|fault| !known.contains(fault)) {
            Some(fault) => Err(Failure::value(fault.to_string()).into()),
            None => apply(&own, (&edited).into()),
        }
    }
}

fn light(own: &PyRef<'_, LightEntity>) -> PyResult<lights::Light> {
    with(own, light_of)
}

fn light_of(world: &mut World, id: StateId) -> Outcome<lights::Light> {
    let light = world.component::<lights::Light>(id)?;
    light.ok_or_else(|| Failure::Gone(format!("the light of entity {}", id.0 + 1)))
}

fn apply(own: &PyRef<'_, LightEntity>, light: lights::Light) -> PyResult<()> {
    with(own, |world, entity| {
        light_of(world, entity)?;
        world.apply(EditLight { entity, light })
    })
}
