//! Keeps `docs/scenes.md` true: its examples parse, its tables have every field and the right defaults. And the lists
//! of names in other documents.

use super::format::cells::Cell;
use super::format::entities::{Camera, Entity, Spin, Transform};
use super::format::generators::{Generator, Grid, Place, Scatter};
use super::format::roads::{Along, Limit, Route, Signal, SignalHead, Stop, Traffic, Vehicle};
use super::format::scene::{Clock, Environment, Scene};
use super::format::surfaces::{Cube, Cylinder, MapSource, Material, MeshSource, Plane, Sampler, Sphere, Torus, Uv};
use super::format::values;
use super::format::vehicle_types as vehicles;
use super::text::parse::parse;
use serde::de::DeserializeOwned;
use std::collections::{BTreeSet, HashMap};
use std::fmt::Debug;
use systems::lights::LightDescription;

const DOCS: &str = concat!(
    include_str!("../../docs/scenes.md"),
    "\n",
    include_str!("../../docs/vehicles.md"),
    "\n",
    include_str!("../../docs/sensors.md")
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
                "map" => parse::<MapSource>(text).map(drop),
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

/// The rows of the table below a heading: field and default. A row may have several fields.
fn table(heading: &str) -> Vec<(&'static str, &'static str)> {
    let title = |line: &str| line.trim_start_matches('#').trim().replace(' ', "").to_lowercase();
    let mut lines = DOCS.lines().skip_while(|line| !line.starts_with('#') || title(line) != heading);
    assert!(lines.next().is_some(), "no heading for {heading}");
    let rows = lines.take_while(|line| !line.starts_with('#')).filter_map(|line| line.strip_prefix("| `"));
    rows.flat_map(|row| {
        let default = row.split('|').nth(2).unwrap_or_default().trim();
        let fields = row.split('|').next().unwrap_or_default();
        fields.split(", ").map(move |field| (field.trim().trim_matches('`'), default))
    })
    .collect()
}

#[test]
fn every_field_has_its_row() {
    let surfaces = include_str!("format/surfaces.rs").replace("struct MapFields", "pub struct Map");
    // Its first struct is what a scene says of a physical vehicle.
    let physical =
        include_str!("../../systems/physics/physical.rs").split("pub struct Tuning").next().unwrap_or_default();
    let types = include_str!("format/vehicle_types.rs");
    let own = [
        include_str!("format/scene.rs"),
        include_str!("format/cells.rs"),
        include_str!("format/entities.rs"),
        include_str!("format/generators.rs"),
        include_str!("format/lights.rs"),
        include_str!("format/sensors.rs"),
        include_str!("format/roads.rs"),
    ];
    let sources = own.into_iter().chain([&*surfaces, types, physical]);
    let mut checked = 0;
    for source in sources {
        let structs = source.split("\npub struct ").skip(1).filter(|s| s.contains("\n}"));
        for text in structs {
            let (name, body) = text.split_once(|c: char| !c.is_alphanumeric()).expect("a name");
            let body = body.split("\n}").next().unwrap_or_default();
            // What a program adds is not the format's.
            let code = body
                .lines()
                .filter(|l| !l.trim().starts_with("//") && !l.contains("custom: Custom") && !l.contains("rigs: Rigs"));
            let fields = code.filter_map(|l| l.trim().strip_prefix("pub ").or(l.strip_prefix("    ")));
            let fields: Vec<&str> =
                fields.filter_map(|l| l.split_once(": ")).map(|(f, _)| f.trim().trim_start_matches("r#")).collect();
            let heading = name.to_lowercase().replace("source", "");
            if ["named", "mounted", "castsshadows"].contains(&heading.as_str()) || (name == "MapSource") {
                continue;
            }
            let rows = table(&heading);
            for field in fields {
                assert!(rows.iter().any(|(row, _)| *row == field), "{name}.{field} is not in docs/scenes.md");
                checked += 1;
            }
        }
    }
    assert!(checked > 100, "found only {checked} fields");
}

/// Writing a field's documented default changes nothing.
fn assert_defaults<T: DeserializeOwned + Debug>(heading: &str, required: &str) {
    let parsed = |text: String| match parse::<T>(&text) {
        Ok(value) => format!("{value:?}"),
        Err(error) => panic!("{heading}: {text}: {error:?}"),
    };
    let plain = parsed(format!("({required})"));
    for (field, default) in table(heading) {
        if let Some(default) = default.strip_prefix('`').and_then(|d| d.strip_suffix('`')) {
            assert_eq!(parsed(format!("({required} {field}: {default})")), plain, "{heading}.{field}");
        }
    }
}

#[test]
fn documented_defaults_are_the_defaults() {
    assert_defaults::<Scene>("scene", "");
    assert_defaults::<Material>("material", "");
    assert_defaults::<Uv>("uv", "");
    assert_defaults::<Plane>("plane", "");
    assert_defaults::<Cube>("cube", "");
    assert_defaults::<Sphere>("sphere", "");
    assert_defaults::<Torus>("torus", "");
    assert_defaults::<Cylinder>("cylinder", "");
    assert_defaults::<Entity>("entity", "");
    assert_defaults::<Transform>("transform", "");
    assert_defaults::<Camera>("camera", "");
    assert_defaults::<Spin>("spin", "");
    assert_defaults::<Route>("route", "points: [(0, 0, 0), (1, 0, 0)],");
    assert_defaults::<Limit>("limit", "from: 0, kmh: 30,");
    assert_defaults::<Stop>("stop", "at: 1,");
    assert_defaults::<Signal>("signal", "green_seconds: [9],");
    assert_defaults::<SignalHead>("signalhead", "signal: \"x\",");
    assert_defaults::<Traffic>("traffic", "");
    assert_defaults::<Cell>("cell", "");
    assert_defaults::<Along>("along", "spacing: 1,");
    assert_defaults::<Vehicle>("vehicle", "type: \"car\",");
    assert_defaults::<systems::physics::Physical>("physical", "");
    assert_defaults::<vehicles::VehicleTypes>("vehicletypes", "");
    assert_defaults::<vehicles::VehicleType>("vehicletype", "model: \"car.glb\",");
    assert_defaults::<vehicles::VehicleLimits>("vehiclelimits", "");
    assert_defaults::<vehicles::Driver>("driver", "");
    assert_defaults::<vehicles::Wheels>("wheels", "nodes: [],");
    assert_defaults::<vehicles::Lamps>("lamps", "nodes: [], kind: head,");
    assert_defaults::<Generator>("generator", "place: grid(counts: (1, 1, 1)),");
    assert_defaults::<Grid>("grid", "counts: (1, 1, 1),");
    assert_defaults::<Scatter>("scatter", "count: 1, region: disc(center: (0, 0, 0), radius: 1),");
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
    let tone_maps = values::names(&systems::draw::ToneMap::ALL).map(|name| format!("`{name}`")).join(", ");
    assert!(DOCS.contains(&format!("| `tone_map` | {tone_maps} |")), "{tone_maps}");
}

/// A build without vehicles reads routes, too, so that their defaults are written down twice.
#[test]
fn a_route_begins_with_the_defaults_of_a_plan() {
    let route = parse::<Route>("(points: [])").expect("a route");
    let plan = systems::vehicles::routes::RoutePlan::default();
    assert_eq!((route.lanes, route.lane_width), (plan.lanes, plan.lane_width));
}
