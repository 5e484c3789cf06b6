//! Contents of the egui interface; uses the viewer and all below it.
//!
//! ```text
//! legend                            colour bars
//! entities, details, object_lights, light_editor, description_editor
//! sensor_panel, weather_panel       switches of sensors, weather
//! panel                             all of these
//! sensor_thumbnails                 thumbnails of sensors, and the one in full size
//! overlay, sensor_overlay           lines to lights over the scene; frusta and points
//! ```

mod description_editor;
pub mod details;
mod entities;
mod legend;
mod light_editor;
pub mod object_lights;
pub mod overlay;
pub mod panel;
pub mod sensor_overlay;
mod sensor_panel;
pub mod sensor_thumbnails;
mod weather_panel;
