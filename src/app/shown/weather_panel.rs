//! Weather of the scene, to be changed: presets, the time of day, and the fields of the weather.

use crate::app::shown::description_editor;
use crate::app::shown::panel::choice;
use bevy_ecs::prelude::*;
use egui::{Grid, Slider, Ui};
use serde_json::Value;
use systems::describe::{check, fields};
use systems::ecs::clock::Clock;
use systems::run::inputs::Inputs;
use systems::run::standard_inputs::SetWeather;
use systems::space::GeoOrigin;
use systems::weather::{Date, PRESETS, Weather, WeatherTimeline};

const SECONDS_PER_HOUR: f64 = 3600.0;
const SECONDS_PER_DAY: f64 = 86_400.0;

/// Shows the weather of now, and queues a change as an input.
pub fn show(ui: &mut Ui, world: &mut World) {
    let now = world.resource::<WeatherTimeline>().now(world.resource::<Clock>());
    let mut wanted = now.clone();
    choice(ui, "preset", |ui| {
        for preset in PRESETS {
            if ui.button(preset.name.replace('_', " ")).clicked() {
                wanted = Weather::preset(preset.name).map_or(wanted.clone(), |preset| Weather {
                    date: now.date,
                    time_speed: now.time_speed,
                    ..preset
                });
            }
        }
    });
    let is_somewhere = world.get_resource::<GeoOrigin>().is_some();
    if is_somewhere && wanted.sun_azimuth_degrees.is_some() && ui.button("sun and moon by date").clicked() {
        wanted = Weather {
            sun_azimuth_degrees: None,
            sun_elevation_degrees: None,
            moon_azimuth_degrees: None,
            moon_elevation_degrees: None,
            ..wanted
        };
    }
    Grid::new("weather").num_columns(2).min_col_width(70.0).show(ui, |ui| {
        if wanted.sun_azimuth_degrees.is_none()
            && let Some(date) = time_of_day(ui, wanted.date)
        {
            wanted.date = date;
        }
        let Ok(Value::Object(mut values)) = serde_json::to_value(&wanted) else { return };
        let others = fields::<Weather>().into_iter().filter(|field| field.name != "date");
        if description_editor::show(ui, others, &mut values)
            && let Ok(edited) = serde_json::from_value(Value::Object(values))
        {
            wanted = edited;
        }
    });
    if wanted != now && check(&wanted).is_ok() && (is_somewhere || !wanted.needs_place()) {
        world.resource_mut::<Inputs>().push(SetWeather { weather: wanted, over_seconds: 0.0 });
    }
}

/// A slider over the hours of the date's day, UTC; another date where it was moved.
fn time_of_day(ui: &mut Ui, date: Date) -> Option<Date> {
    let begin = date.0 - date.0.rem_euclid(SECONDS_PER_DAY);
    let mut hours = (date.0 - begin) / SECONDS_PER_HOUR;
    ui.weak("time").on_hover_text(format!("Time of day, UTC: {date}"));
    ui.spacing_mut().slider_width = 80.0;
    let shown = |hours: f64, _: std::ops::RangeInclusive<usize>| {
        format!("{:02.0}:{:02.0}", hours.floor(), hours.fract() * 60.0)
    };
    let slider = Slider::new(&mut hours, 0.0..=23.999).custom_formatter(shown);
    let has_changed = ui.add(slider).changed();
    ui.end_row();
    has_changed.then_some(Date(begin + hours * SECONDS_PER_HOUR))
}
