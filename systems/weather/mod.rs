//! Weather, and the light of sky, sun and moon that follows from it.
//!
//! [`Weather`] is what a person describes; [`WeatherTimeline`] is the state, which says what holds at a step of the
//! clock. Where sun and moon stand follows from date and place (`almanac`), the light of a clear sky from the air
//! (`atmosphere`). A [`Sky`] is the radiance by direction ([`SkyMap`]) and its spherical harmonics ([`Harmonics`]); that of
//! a world, with what comes of sun and moon, is its [`CurrentSky`].

pub mod almanac;
pub(crate) mod atmosphere;
pub(crate) mod bodies;
pub(crate) mod current;
pub(crate) mod date;
pub(crate) mod harmonics;
pub mod openness;
pub(crate) mod prefilter;
pub(crate) mod presets;
pub(crate) mod sky;
pub(crate) mod sky_map;
pub(crate) mod timeline;
#[allow(clippy::module_inception)]
pub(crate) mod weather;

pub use current::CurrentSky;
pub use date::Date;
pub use harmonics::Harmonics;
pub use presets::PRESETS;
pub use sky::{Sky, SkyLight};
pub use sky_map::{SkyMap, SkyTexel};
pub use timeline::WeatherTimeline;
pub use weather::{SkyModel, Weather};
