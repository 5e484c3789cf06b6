//! Lights: what they shine like, and those of a world.

use crate::entity::Entity;
use crate::errors::{Failure, Outcome};
use crate::values::Numbers;
use pyo3::prelude::*;
use pyo3::types::PyString;
use relief::glam::Vec3;
use relief::systems::assets::color::linear_from_srgb;
use relief::systems::lights::{self, LightKind};
use relief::systems::run::standard_inputs::EditLight;

/// What a light shines like. An intensity of 1 at attenuation 1 lights a white surface that faces the light to a
/// radiance of 1.
#[pyclass(frozen, from_py_object, module = "relief")]
#[derive(Clone, Debug)]
pub struct Light(pub lights::Light);

/// A colour: "#rrggbb" in sRGB, or three linear numbers.
fn color(given: &Bound<'_, PyAny>) -> PyResult<Vec3> {
    if let Ok(text) = given.cast::<PyString>() {
        let text = text.to_cow()?;
        return Ok(from_hex(&text)?);
    }
    let numbers: Numbers<3> = given.extract()?;
    let color = numbers.vector().as_vec3();
    if color.min_element() < 0.0 || color.max_element() > 1e6 {
        return Err(Failure::value(format!("color: expected linear numbers from 0 to 1e6, found {color}")).into());
    }
    Ok(color)
}

fn from_hex(text: &str) -> Outcome<Vec3> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii());
    let part = |i: usize| u8::from_str_radix(digits?.get(2 * i..2 * i + 2)?, 16).ok();
    match (part(0), part(1), part(2)) {
        (Some(r), Some(g), Some(b)) => Ok(Vec3::from([r, g, b].map(|byte| linear_from_srgb(f32::from(byte) / 255.0)))),
        _ => Err(Failure::value(format!("color: expected \"#rrggbb\" or three linear numbers, found {text:?}"))),
    }
}

fn number(name: &str, value: f64, least: f64, most: f64) -> Outcome<f32> {
    let is_fit = (least..=most).contains(&value);
    is_fit
        .then_some(value as f32)
        .ok_or_else(|| Failure::value(format!("{name}: expected a number from {least} to {most}, found {value}")))
}

/// Metres up to which a light reaches; infinite: no end.
fn range(value: f64) -> Outcome<f32> {
    if value == f64::INFINITY { Ok(f32::INFINITY) } else { number("range", value, 1e-3, 1e6) }
}

impl Light {
    fn painted(self, given: Option<&Bound<'_, PyAny>>, shadows: bool) -> PyResult<Self> {
        let color = given.map(color).transpose()?.unwrap_or(Vec3::ONE);
        Ok(Self(lights::Light { color, shadows, ..self.0 }))
    }
}

#[pymethods]
impl Light {
    /// In all directions from a point. `range`: metres at which it has faded to nothing. `color`: "#rrggbb" in sRGB or
    /// three linear numbers.
    #[staticmethod]
    #[pyo3(signature = (intensity, range=f64::INFINITY, *, color=None, shadows=false))]
    fn point(intensity: f64, range: f64, color: Option<&Bound<'_, PyAny>>, shadows: bool) -> PyResult<Self> {
        let intensity = number("intensity", intensity, 0.0, 1e9)?;
        Self(lights::Light::point(intensity, self::range(range)?)).painted(color, shadows)
    }

    /// A cone along its −Z, which looks forward where it is placed with `yaw` and `pitch` 0. `outer_degrees`: half the
    /// angle of the cone, up to 85; it is full within `inner_degrees`, by default 0.8 of that.
    #[staticmethod]
    #[pyo3(signature = (
        intensity, range=f64::INFINITY, *, outer_degrees=30.0, inner_degrees=None, color=None, shadows=false
    ))]
    fn spot(
        intensity: f64,
        range: f64,
        outer_degrees: f64,
        inner_degrees: Option<f64>,
        color: Option<&Bound<'_, PyAny>>,
        shadows: bool,
    ) -> PyResult<Self> {
        let intensity = number("intensity", intensity, 0.0, 1e9)?;
        let outer = number("outer_degrees", outer_degrees, 0.1, 85.0)?.to_radians();
        let inner = inner_degrees.map(|inner| number("inner_degrees", inner, 0.0, outer_degrees)).transpose()?;
        let mut light = lights::Light::spot(intensity, self::range(range)?, outer);
        if let Some(inner) = inner {
            light.kind = LightKind::Spot { outer, inner: Some(inner.to_radians()), exponent: 0.0 };
        }
        Self(light).painted(color, shadows)
    }

    /// Parallel light along its −Z, as the sun's.
    #[staticmethod]
    #[pyo3(signature = (intensity, *, color=None, shadows=false))]
    fn directional(intensity: f64, color: Option<&Bound<'_, PyAny>>, shadows: bool) -> PyResult<Self> {
        let intensity = number("intensity", intensity, 0.0, 1e9)?;
        Self(lights::Light::directional(intensity)).painted(color, shadows)
    }

    fn __repr__(&self) -> String {
        format!("<light description, {}, intensity {}>", self.0.kind.name(), self.0.intensity)
    }
}

/// A light of a world. Setting what it shines like takes effect at once; a recording has it.
#[pyclass(frozen, extends = Entity, module = "relief")]
pub struct LightEntity;

#[pymethods]
impl LightEntity {
    /// "point", "spot" or "directional".
    #[getter]
    fn kind(own: PyRef<'_, Self>) -> PyResult<&'static str> {
        read(&own, |light| light.kind.name())
    }

    /// Times its colour.
    #[getter]
    fn intensity(own: PyRef<'_, Self>) -> PyResult<f32> {
        read(&own, |light| light.intensity)
    }

    #[setter]
    fn set_intensity(own: PyRef<'_, Self>, intensity: f64) -> PyResult<()> {
        let intensity = number("intensity", intensity, 0.0, 1e9)?;
        edit(&own, move |light| light.intensity = intensity)
    }

    /// Metres at which it has faded to nothing; infinite: no end.
    #[getter]
    fn range(own: PyRef<'_, Self>) -> PyResult<f32> {
        read(&own, |light| light.range)
    }

    #[setter]
    fn set_range(own: PyRef<'_, Self>, range: f64) -> PyResult<()> {
        let range = self::range(range)?;
        edit(&own, move |light| light.range = range)
    }

    /// Linear red, green and blue. It may be set to "#rrggbb" in sRGB, too.
    #[getter]
    fn color(own: PyRef<'_, Self>) -> PyResult<(f32, f32, f32)> {
        read(&own, |light| light.color.into())
    }

    #[setter]
    fn set_color(own: PyRef<'_, Self>, color: &Bound<'_, PyAny>) -> PyResult<()> {
        let color = self::color(color)?;
        edit(&own, move |light| light.color = color)
    }

    /// Whether it is on.
    #[getter]
    fn enabled(own: PyRef<'_, Self>) -> PyResult<bool> {
        read(&own, |light| light.enabled)
    }

    #[setter]
    fn set_enabled(own: PyRef<'_, Self>, enabled: bool) -> PyResult<()> {
        edit(&own, move |light| light.enabled = enabled)
    }

    /// Whether it casts shadows, if it is among the most important lights for a picture.
    #[getter]
    fn shadows(own: PyRef<'_, Self>) -> PyResult<bool> {
        read(&own, |light| light.shadows)
    }

    #[setter]
    fn set_shadows(own: PyRef<'_, Self>, shadows: bool) -> PyResult<()> {
        edit(&own, move |light| light.shadows = shadows)
    }

    /// Gives it all of another description.
    fn change(own: PyRef<'_, Self>, light: Light) -> PyResult<()> {
        edit(&own, move |now| *now = light.0)
    }
}

fn read<T: Send>(own: &PyRef<'_, LightEntity>, value: impl FnOnce(&lights::Light) -> T + Send) -> PyResult<T> {
    let entity: &Entity = own.as_super();
    let id = entity.id;
    entity.with(own.py(), move |world| {
        let light = world.component::<lights::Light>(id)?;
        light.as_ref().map(value).ok_or_else(|| Failure::Gone(format!("the light of entity {}", id.0 + 1)))
    })
}

fn edit(own: &PyRef<'_, LightEntity>, change: impl FnOnce(&mut lights::Light) + Send) -> PyResult<()> {
    let entity: &Entity = own.as_super();
    let id = entity.id;
    entity.with(own.py(), move |world| {
        let light = world.component::<lights::Light>(id)?;
        let mut light = light.ok_or_else(|| Failure::Gone(format!("the light of entity {}", id.0 + 1)))?;
        change(&mut light);
        world.apply(EditLight { entity: id, light })
    })
}
