//! Lights as they are described: kind, colour, reach, size.

use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Argument, Given, found, optional, required};
use crate::given::values::{Numbers, Placing};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyString;
use relief::glam::{DVec3, Vec3};
use relief::systems::assets::color::linear_from_srgb;
use relief::systems::lights::{self, LightKind};

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

/// A colour: "#rrggbb" in sRGB, or three linear numbers.
pub struct Color(pub Vec3);

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
pub fn radius(value: f64) -> Outcome<f32> {
    number("radius", value, 0.0, lights::Light::MOST_RADIUS.into())
}

/// Degrees, to radians.
pub fn angle(value: f64) -> Outcome<f32> {
    number("angle_degrees", value, 0.0, lights::Light::MOST_DEGREES.into()).map(f32::to_radians)
}

pub fn intensity(given: &Bound<'_, PyAny>) -> PyResult<f32> {
    Ok(number("intensity", required("intensity", given)?, 0.0, 1e9)?)
}

/// Metres up to which a light reaches; infinite: no end.
pub fn range(given: Given<'_, '_>) -> PyResult<f32> {
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
