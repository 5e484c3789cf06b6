//! Lights: what they shine like, and those of a world.

use crate::arguments::{Argument, Given, found, optional, required};
use crate::entity::Entity;
use crate::errors::{Failure, Outcome};
use crate::values::{Numbers, Placing};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyString;
use relief::glam::{DVec3, Vec3};
use relief::systems::assets::color::linear_from_srgb;
use relief::systems::lights::{self, LightKind};
use relief::systems::run::standard_inputs::EditLight;

/// What a light shines like. An intensity of 1 at attenuation 1 lights a white surface that faces the light to a
/// radiance of 1.
#[pyclass(frozen, from_py_object, module = "relief")]
#[derive(Clone, Debug)]
pub struct Light(pub lights::Light);

impl Argument for Light {
    fn expected() -> String {
        "a Light, such as relief.Light.point(4)".into()
    }
}

/// A colour: "#rrggbb" in sRGB, or three linear numbers.
struct Color(Vec3);

impl<'a, 'py> FromPyObject<'a, 'py> for Color {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let fault = || PyValueError::new_err(format!("expected {}, found {}", Self::expected(), found(&given)));
        if let Ok(text) = given.cast::<PyString>() {
            return from_hex(&text.to_cow()?).map(Self).ok_or_else(fault);
        }
        let Numbers::<3>(numbers) = given.extract()?;
        if numbers.iter().any(|part| !(0.0..=1e6).contains(part)) {
            return Err(PyValueError::new_err(format!(
                "expected linear numbers from 0 to 1e6, found {}",
                found(&given)
            )));
        }
        Ok(Self(DVec3::from(numbers).as_vec3()))
    }
}

impl Argument for Color {
    fn expected() -> String {
        "\"#rrggbb\" or three linear numbers".into()
    }
}

fn from_hex(text: &str) -> Option<Vec3> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let part = |i: usize| u8::from_str_radix(digits.get(2 * i..2 * i + 2)?, 16).ok();
    let bytes = [part(0)?, part(1)?, part(2)?];
    Some(Vec3::from(bytes.map(|byte| linear_from_srgb(f32::from(byte) / 255.0))))
}

fn number(name: &str, value: f64, least: f64, most: f64) -> Outcome<f32> {
    let is_fit = (least..=most).contains(&value);
    is_fit
        .then_some(value as f32)
        .ok_or_else(|| Failure::value(format!("{name}: expected a number from {least} to {most}, found {value}")))
}

/// Metres.
fn radius(value: f64) -> Outcome<f32> {
    number("radius", value, 0.0, lights::Light::MOST_RADIUS.into())
}

/// Degrees, to radians.
fn angle(value: f64) -> Outcome<f32> {
    number("angle_degrees", value, 0.0, lights::Light::MOST_DEGREES.into()).map(f32::to_radians)
}

fn intensity(given: &Bound<'_, PyAny>) -> PyResult<f32> {
    Ok(number("intensity", required("intensity", given)?, 0.0, 1e9)?)
}

/// Metres up to which a light reaches; infinite: no end.
fn range(given: Given<'_, '_>) -> PyResult<f32> {
    match optional::<f64>("range", given)? {
        None | Some(f64::INFINITY) => Ok(f32::INFINITY),
        Some(value) => Ok(number("range", value, 1e-3, 1e6)?),
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
    fn painted(self, color: Given<'_, '_>, shadows: Given<'_, '_>) -> PyResult<Self> {
        let color = optional::<Color>("color", color)?.map_or(Vec3::ONE, |color| color.0);
        let shadows = optional("shadows", shadows)?.unwrap_or(false);
        Ok(Self(lights::Light { color, shadows, ..self.0 }))
    }
}

#[pymethods]
impl Light {
    /// In all directions from a point. `range`: metres at which it has faded to nothing. `color`: "#rrggbb" in sRGB or
    /// three linear numbers. `radius`: metres, of what shines; shadows have penumbrae by it.
    #[staticmethod]
    #[pyo3(
        signature = (intensity, range=None, *, color=None, shadows=None, radius=None),
        text_signature = "(intensity, range=..., *, color=None, shadows=False, radius=0.0)"
    )]
    fn point(
        intensity: &Bound<'_, PyAny>,
        range: Given<'_, '_>,
        color: Given<'_, '_>,
        shadows: Given<'_, '_>,
        radius: Given<'_, '_>,
    ) -> PyResult<Self> {
        let light = lights::Light::point(self::intensity(intensity)?, self::range(range)?);
        let radius = optional("radius", radius)?.map(self::radius).transpose()?.unwrap_or(light.radius);
        Self(lights::Light { radius, ..light }).painted(color, shadows)
    }

    /// A cone along its −Z, which looks forward where it is placed with `yaw` and `pitch` 0. `outer_degrees`: half the
    /// angle of the cone, up to 85; it is full within `inner_degrees`, by default 0.8 of that.
    #[staticmethod]
    #[pyo3(
        signature = (
            intensity, range=None, *, outer_degrees=None, inner_degrees=None, color=None, shadows=None, radius=None
        ),
        text_signature = "(intensity, range=..., *, outer_degrees=30.0, inner_degrees=None, color=None, shadows=False, radius=0.0)"
    )]
    fn spot(
        intensity: &Bound<'_, PyAny>,
        range: Given<'_, '_>,
        outer_degrees: Given<'_, '_>,
        inner_degrees: Given<'_, '_>,
        color: Given<'_, '_>,
        shadows: Given<'_, '_>,
        radius: Given<'_, '_>,
    ) -> PyResult<Self> {
        let intensity = self::intensity(intensity)?;
        let outer_degrees = optional("outer_degrees", outer_degrees)?.unwrap_or(30.0);
        let inner_degrees = optional("inner_degrees", inner_degrees)?;
        let outer = number("outer_degrees", outer_degrees, 0.1, 85.0)?.to_radians();
        let inner = inner_degrees.map(|inner| number("inner_degrees", inner, 0.0, outer_degrees)).transpose()?;
        let mut light = lights::Light::spot(intensity, self::range(range)?, outer);
        if let Some(radius) = optional("radius", radius)? {
            light.radius = self::radius(radius)?;
        }
        if let Some(inner) = inner {
            light.kind = LightKind::Spot { outer, inner: Some(inner.to_radians()), exponent: 0.0 };
        }
        Self(light).painted(color, shadows)
    }

    /// Parallel light along its −Z, as the sun's. `angle_degrees`: its angular diameter; shadows have penumbrae by it.
    #[staticmethod]
    #[pyo3(
        signature = (intensity, *, color=None, shadows=None, angle_degrees=None),
        text_signature = "(intensity, *, color=None, shadows=False, angle_degrees=0.53)"
    )]
    fn directional(
        intensity: &Bound<'_, PyAny>,
        color: Given<'_, '_>,
        shadows: Given<'_, '_>,
        angle_degrees: Given<'_, '_>,
    ) -> PyResult<Self> {
        let light = lights::Light::directional(self::intensity(intensity)?);
        let angle = optional("angle_degrees", angle_degrees)?.map(self::angle).transpose()?.unwrap_or(light.angle);
        Self(lights::Light { angle, ..light }).painted(color, shadows)
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
    fn set_intensity(own: PyRef<'_, Self>, intensity: &Bound<'_, PyAny>) -> PyResult<()> {
        let intensity = self::intensity(intensity)?;
        edit(&own, move |light| light.intensity = intensity)
    }

    /// Metres at which it has faded to nothing; infinite: no end. That of a directional light cannot be set.
    #[getter]
    fn range(own: PyRef<'_, Self>) -> PyResult<f32> {
        read(&own, |light| light.range)
    }

    #[setter]
    fn set_range(own: PyRef<'_, Self>, range: &Bound<'_, PyAny>) -> PyResult<()> {
        required::<f64>("range", range)?;
        let range = self::range(Some(range))?;
        if read(&own, |light| matches!(light.kind, LightKind::Directional))? {
            return Err(Failure::value("range: a directional light has none; it reaches everywhere").into());
        }
        edit(&own, move |light| light.range = range)
    }

    /// Linear red, green and blue. It may be set to "#rrggbb" in sRGB, too.
    #[getter]
    fn color(own: PyRef<'_, Self>) -> PyResult<(f32, f32, f32)> {
        read(&own, |light| light.color.into())
    }

    #[setter]
    fn set_color(own: PyRef<'_, Self>, color: &Bound<'_, PyAny>) -> PyResult<()> {
        let Color(color) = required("color", color)?;
        edit(&own, move |light| light.color = color)
    }

    /// Whether it is on.
    #[getter]
    fn enabled(own: PyRef<'_, Self>) -> PyResult<bool> {
        read(&own, |light| light.enabled)
    }

    #[setter]
    fn set_enabled(own: PyRef<'_, Self>, enabled: &Bound<'_, PyAny>) -> PyResult<()> {
        let enabled = required("enabled", enabled)?;
        edit(&own, move |light| light.enabled = enabled)
    }

    /// Whether it casts shadows, if it is among the most important lights for a picture.
    #[getter]
    fn shadows(own: PyRef<'_, Self>) -> PyResult<bool> {
        read(&own, |light| light.shadows)
    }

    #[setter]
    fn set_shadows(own: PyRef<'_, Self>, shadows: &Bound<'_, PyAny>) -> PyResult<()> {
        let shadows = required("shadows", shadows)?;
        edit(&own, move |light| light.shadows = shadows)
    }

    /// Metres, of a point light or a spot: of what shines. Shadows have penumbrae by it; 0: hard edges.
    #[getter]
    fn radius(own: PyRef<'_, Self>) -> PyResult<f32> {
        read(&own, |light| light.radius)
    }

    #[setter]
    fn set_radius(own: PyRef<'_, Self>, radius: &Bound<'_, PyAny>) -> PyResult<()> {
        let radius = self::radius(required("radius", radius)?)?;
        if read(&own, |light| matches!(light.kind, LightKind::Directional))? {
            return Err(Failure::value("radius: a directional light has none; it has angle_degrees").into());
        }
        edit(&own, move |light| light.radius = radius)
    }

    /// Degrees, of a directional light: its angular diameter. Shadows have penumbrae by it; 0: hard edges.
    #[getter]
    fn angle_degrees(own: PyRef<'_, Self>) -> PyResult<f32> {
        read(&own, |light| light.angle.to_degrees())
    }

    #[setter]
    fn set_angle_degrees(own: PyRef<'_, Self>, angle_degrees: &Bound<'_, PyAny>) -> PyResult<()> {
        let angle = self::angle(required("angle_degrees", angle_degrees)?)?;
        if !read(&own, |light| matches!(light.kind, LightKind::Directional))? {
            return Err(Failure::value("angle_degrees: only a directional light has one; others have a radius").into());
        }
        edit(&own, move |light| light.angle = angle)
    }

    /// Gives it all of another description.
    fn change(own: PyRef<'_, Self>, light: &Bound<'_, PyAny>) -> PyResult<()> {
        let light: Light = required("light", light)?;
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
