//! Keeps `docs/scenes.md` true: its examples parse. And the lists of names in other documents.

use super::format::entities::{Camera, Entity, Spin, Transform};
use super::format::generators::{Generator, Place};
use super::format::roads::{FASTEST_KMH, Route, Signal, Vehicle};
use super::format::scene::{Clock, Environment, Scene};
use super::format::surfaces::{Map, Material, MeshSource, Sampler, Uv};
use super::format::vehicle_types as vehicles;
use super::text::parse::parse;
use std::collections::{BTreeSet, HashMap};
use systems::lights::LightDescription;

const DOCS: &str = concat!(
    include_str!("../../docs/scenes.md"),
    "\n",
    include_str!("../../docs/vehicles.md"),
    "\n",
    include_str!("../../docs/sensors.md"),
    "\n",
    include_str!("../../docs/weather.md")
);

#[test]
fn every_example_parses_as_what_it_says_it_is() {
    let mut counts: HashMap<&str, u32> = HashMap::new();
    let mut blocks = DOCS.split("```").skip(1).step_by(2);
    blocks
        .try_for_each(|block| {
            let (info, text) = block.split_once('\n').ok_or("an empty block")?;
            if info == "text" || info.starts_with("rust") {
                return Ok(());
            }
            let parses = match info.strip_prefix("ron ").unwrap_or_default() {
                "scene" => parse::<Scene>(text).map(drop),
                "environment" => parse::<Environment>(text).map(drop),
                "clock" => parse::<Clock>(text).map(drop),
                "material" => parse::<Material>(text).map(drop),
                "map" => parse::<Map>(text).map(drop),
                "uv" => parse::<Uv>(text).map(drop),
                "sampler" => parse::<Sampler>(text).map(drop),
                "mesh" => parse::<MeshSource>(text).map(drop),
                "entity" => parse::<Entity>(text).map(drop),
                "transform" => parse::<Transform>(text).map(drop),
                "rig" => parse::<Vec<Entity>>(text).map(drop),
                "light" => parse::<LightDescription>(text).map(drop),
                "camera" => parse::<Camera>(text).map(drop),
                "spin" => parse::<Spin>(text).map(drop),
                "generator" => parse::<Generator>(text).map(drop),
                "place" => parse::<Place>(text).map(drop),
                "route" => parse::<Route>(text).map(drop),
                "signal" => parse::<Signal>(text).map(drop),
                "vehicle" => parse::<Vehicle>(text).map(drop),
                "vehicle type" => parse::<vehicles::VehicleType>(text).map(drop),
                _ => return Err(format!("what is a block of {info:?}?")),
            };
            *counts.entry(info).or_default() += 1;
            parses.map_err(|slip| format!("{info}: {slip:?}\n{text}"))
        })
        .unwrap_or_else(|e: String| panic!("{e}"));
    assert_eq!(counts.len(), 20, "an example of each kind: {counts:?}");
}

#[test]
fn every_name_of_a_technique_and_a_tone_map_is_read() {
    for (name, technique) in systems::assets::Technique::ALL {
        let material = parse::<Material>(&format!("(technique: {name})"));
        assert_eq!(material.map(|material| material.technique).ok(), Some(technique), "{name}");
    }
    for (name, tone_map) in systems::draw::ToneMap::ALL {
        let environment = parse::<Environment>(&format!("(tone_map: {name})"));
        assert_eq!(environment.map(|environment| environment.tone_map).ok(), Some(tone_map), "{name}");
    }
}

/// The names in a document's table that begins with such a line: those in backticks in its first column.
fn names_in(document: &str, head: &str) -> BTreeSet<String> {
    let mut lines = document.lines().skip_while(|line| !line.starts_with(head));
    assert!(lines.next().is_some(), "no table {head}");
    let cells = lines.take_while(|line| line.starts_with('|')).filter_map(|line| line.split('|').nth(1));
    cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).map(str::to_owned).collect()
}

#[test]
fn the_documents_list_every_name() {
    let techniques = systems::assets::Technique::ALL.map(|(name, _)| name.to_owned());
    assert_eq!(names_in(include_str!("../../docs/techniques.md"), "| technique | needs"), techniques.into());
    // Others say by their name what they show.
    let explained = crate::renderer::DebugView::ALL.into_iter().filter(|(_, view)| !view.shows().is_empty());
    let explained = explained.map(|(name, _)| name.to_owned()).collect();
    assert_eq!(names_in(include_str!("../../docs/lights.md"), "| view | shows"), explained);
}

/// A build without vehicles reads routes, too, so that their defaults are written down twice.
#[test]
fn a_route_begins_with_the_defaults_of_a_plan() {
    let route = parse::<Route>("(points: [])").expect("a route");
    let plan = systems::vehicles::routes::RoutePlan::default();
    assert_eq!((route.lanes, route.lane_width), (plan.lanes, plan.lane_width));
    assert!((FASTEST_KMH - systems::vehicles::FASTEST * 3.6).abs() < 1e-9);
}
