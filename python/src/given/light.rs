//! Lights as they are described: kind, colour, reach, size.

use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Argument, Keywords, required};
use crate::given::described::{read, take};
use crate::given::values::Placing;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::systems::describe::{Field, schema};
use relief::systems::lights::{self, LightDescription, LightFields, LightKind};
use serde_json::{Value, json};

/// Settings of a light. An intensity of 1 at attenuation 1 lights a white surface that faces the light to a radiance of
/// 1.
#[pyclass(frozen, from_py_object, module = "relief")]
#[derive(Clone, Debug)]
pub struct Light(pub lights::Light);

impl Argument for Light {
    fn expected() -> String {
        "a Light, such as relief.Light.point(4)".into()
    }
}

/// A light that shines in all directions is not turned.
pub fn refuse_turned(light: &lights::Light, placing: &Placing) -> Outcome<()> {
    if matches!(light.kind, LightKind::Point) && placing.is_turned() {
        let message = "yaw, pitch, roll and look_at: a point light shines in all directions; \
                       relief.Light.spot and relief.Light.directional are turned";
        return Err(Failure::value(message));
    }
    Ok(())
}

impl Light {
    /// Reads the fields of a kind of light. `usual`: those that are otherwise than in scene files where they are not
    /// given.
    fn of_kind(
        kind: &'static str,
        intensity: &Bound<'_, PyAny>,
        range: Option<&Bound<'_, PyAny>>,
        fields: Option<&Bound<'_, PyDict>>,
        usual: impl FnOnce(&mut Value),
    ) -> PyResult<Self> {
        let all = fields.map_or_else(|| Ok(PyDict::new(intensity.py())), |fields| fields.copy())?;
        required::<f64>("intensity", intensity)?;
        all.set_item("intensity", intensity)?;
        range.map_or(Ok(()), |range| all.set_item("range", range))?;
        let mut arguments = Keywords::new(Some(&all));
        let is_of_kind = |field: &Field| field.is_of(kind);
        let whole = |fields| serde_json::from_value::<LightFields>(fields).map(drop).map_err(|error| error.to_string());
        let mut fields = take(&mut arguments, schema::<LightFields>(), &is_of_kind, &whole)?.into();
        arguments.finish()?;
        usual(&mut fields);
        Ok(Self((&read::<LightDescription>(json!({ kind: fields }))?).into()))
    }
}

#[pymethods]
impl Light {
    /// In all directions from a point. `range`: metres at which it has faded to nothing. Further keywords are the
    /// fields that scene files have for point lights (docs/scenes.md), such as `color`, "#rrggbb" in sRGB or three
    /// linear numbers, `shadows` and `radius`.
    #[staticmethod]
    #[pyo3(signature = (intensity, range=None, **fields))]
    fn point(
        intensity: &Bound<'_, PyAny>,
        range: Option<&Bound<'_, PyAny>>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        Self::of_kind("point", intensity, range, fields, |_| {})
    }

    /// A cone along its −Z, which looks forward where it is placed with `yaw` and `pitch` 0. `outer_degrees`: half the
    /// angle of the cone, up to 85, by default 30; it is full within `inner_degrees`, by default 0.8 of that. Further
    /// keywords are the fields that scene files have for spot lights (docs/scenes.md).
    #[staticmethod]
    #[pyo3(signature = (intensity, range=None, **fields))]
    fn spot(
        intensity: &Bound<'_, PyAny>,
        range: Option<&Bound<'_, PyAny>>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        Self::of_kind("spot", intensity, range, fields, |fields| {
            if ["cutoff_degrees", "exponent", "outer_degrees"].iter().all(|name| fields[name].is_null()) {
                fields["outer_degrees"] = json!(30.0);
            }
        })
    }

    /// Parallel light along its −Z, as the sun's. Further keywords are the fields that scene files have for directional
    /// lights (docs/scenes.md), such as `angle_degrees`, its angular diameter, by default 0.53.
    #[staticmethod]
    #[pyo3(signature = (intensity, **fields))]
    fn directional(intensity: &Bound<'_, PyAny>, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        Self::of_kind("directional", intensity, None, fields, |_| {})
    }

    fn __repr__(&self) -> String {
        format!("<light description, {}, intensity {}>", self.0.kind.name(), self.0.intensity)
    }
}
