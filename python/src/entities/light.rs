//! Lights of a world.

use crate::entities::entity::Entity;
use crate::errors::Failure;
use crate::given::arguments::required;
use crate::given::light::{self, Color, Light};
use pyo3::prelude::*;
use relief::systems::lights::{self, LightKind};
use relief::systems::run::standard_inputs::EditLight;

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
        let intensity = light::intensity(intensity)?;
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
        let range = light::range(Some(range))?;
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

    /// Switched on.
    #[getter]
    fn enabled(own: PyRef<'_, Self>) -> PyResult<bool> {
        read(&own, |light| light.enabled)
    }

    #[setter]
    fn set_enabled(own: PyRef<'_, Self>, enabled: &Bound<'_, PyAny>) -> PyResult<()> {
        let enabled = required("enabled", enabled)?;
        edit(&own, move |light| light.enabled = enabled)
    }

    /// Casts shadows, if it is among the most important lights for a picture.
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
        let radius = light::radius(required("radius", radius)?)?;
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
        let angle = light::angle(required("angle_degrees", angle_degrees)?)?;
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
