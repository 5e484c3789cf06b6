//! Cells and portals of scene files: what is wrong with them, and what they become.

use super::check::Check;
use super::faults::unknown;
use super::files::Items;
use super::format::{Cell as Source, Door as DoorSource, Portal as PortalSource, Scene};
use super::places::Step;
use super::values::place;
use crate::name;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::Vec3;
use systems::Simulation;
use systems::assets::Library;
use systems::cells::{self, Cell, Cells, Door, OUTSIDE, Opening, Portal};
use systems::space::{Aabb, Interpolated, Transform};

/// What a portal names where there is no cell.
const OUTSIDE_NAME: &str = "outside";
/// Corners of a portal.
const MOST_CORNERS: usize = 64;
/// Sheets that are told one by one.
const MOST_SHEETS: usize = 5;

impl<'a> Check<'a> {
    pub(super) fn cells(&mut self) {
        let scene = self.scene;
        self.field("cells", |c| {
            c.entries(&scene.cells, Self::cell);
            if let Some(index) = scene.cells.position(OUTSIDE_NAME) {
                let message = "reserved name: outside is what lies in no cell";
                c.inside(Step::Entry(index), OUTSIDE_NAME, |c| c.fault(message));
            }
        });
        self.each("portals", &scene.portals, Self::portal);
    }

    fn cell(&mut self, cell: &'a Source) {
        if cell.r#box.is_some() == cell.hull.is_some() {
            return self.fault("expected either box or hull");
        }
        if let Some([min, max]) = &cell.r#box {
            self.position("box", min);
            self.position("box", max);
            if min.iter().zip(max).any(|(min, max)| min >= max) {
                let message = format!("expected the least and the largest corner, found {min:?} and {max:?}");
                self.field("box", |c| c.fault(message));
            }
        }
        if let Some(mesh) = &cell.hull {
            self.field("hull", |c| c.figure(mesh));
        }
        self.position("translation", &cell.translation);
        if cell.hull.is_none() && cell.translation != [0.0; 3] {
            self.field("translation", |c| c.fault("only allowed with hull"));
        }
    }

    fn portal(&mut self, portal: &'a PortalSource) {
        let cells = &self.scene.cells;
        for cell in portal.between.iter().filter(|cell| *cell != OUTSIDE_NAME && cells.get(cell).is_none()) {
            let message = unknown("cell", cell, cells.names().chain([OUTSIDE_NAME]));
            self.field("between", |c| c.fault(message));
        }
        if portal.between[0] == portal.between[1] {
            self.field("between", |c| c.fault("expected two different cells"));
        }
        if !(3..=MOST_CORNERS).contains(&portal.polygon.len()) {
            let message = format!("expected from 3 to {MOST_CORNERS} corners, found {}", portal.polygon.len());
            self.field("polygon", |c| c.fault(message));
        }
        portal.polygon.iter().for_each(|corner| self.position("polygon", corner));
        self.number("open", portal.open, 0.0, 1.0);
        if let Some(door) = &portal.door {
            self.field("door", |c| c.door(door));
        }
    }

    fn door(&mut self, door: &'a DoorSource) {
        let entities = || self.scene.entities.iter();
        if let Some(leaf) = &door.leaf {
            let named = entities().find(|entity| entity.name.as_ref() == Some(leaf));
            let message = match named {
                None => Some(unknown("entity", leaf, entities().filter_map(|entity| entity.name.as_deref()))),
                Some(entity) if entity.vehicle.is_some() || entity.spin.is_some() => {
                    Some("expected an entity that does not move by itself".into())
                }
                Some(_) => None,
            };
            message.into_iter().for_each(|message| self.field("leaf", |c| c.fault(message)));
        }
        self.number("swing_degrees", door.swing_degrees, -180.0, 180.0);
        self.numbers("slide", &door.slide, -1e3, 1e3);
        self.number("period_seconds", door.period_seconds, 0.0, 1e6);
        self.number("phase_seconds", door.phase_seconds, -1e6, 1e6);
        if door.leaf.is_none() && (door.swing_degrees != 0.0 || door.slide != [0.0; 3]) {
            self.fault("expected `leaf` beside swing_degrees and slide");
        }
    }
}

/// Puts the cells of a checked scene into the world, with an entity for each portal; after the entities that are leaves
/// of doors. Returns what is doubtful.
pub fn spawn(scene: &Scene, items: &Items, world: &mut World) -> Vec<String> {
    if scene.cells.entries().is_empty() && scene.portals.is_empty() {
        return Vec::new();
    }
    let (mut warnings, mut cells) = (Vec::new(), Vec::new());
    // Of each name, 0 where it is none that light stays in.
    let mut numbers = Vec::new();
    for (name, source) in scene.cells.entries() {
        match cell(name, source, items, world) {
            Ok(cell) => {
                cells.push(cell);
                numbers.push(cells.len() as u32);
            }
            Err(error) => {
                warnings.push(format!("cells[{name:?}]: {error}; it counts as outside"));
                numbers.push(OUTSIDE);
            }
        }
    }
    let number = |name: &String| scene.cells.position(name).map_or(OUTSIDE, |index| numbers[index]);
    let mut openings = Vec::new();
    for source in &scene.portals {
        let polygon = source.polygon.iter().map(|&corner| place(corner)).collect();
        let between = [number(&source.between[0]), number(&source.between[1])];
        openings.push(Opening { between, polygon, portal: Some(portal(source, world)) });
    }
    warnings.extend(cells::problems(&cells, &openings));
    world.insert_resource(Cells::new(cells, openings));
    warnings
}

fn cell(name: &str, source: &Source, items: &Items, world: &World) -> Result<Cell, String> {
    if let Some([min, max]) = source.r#box {
        return Ok(Cell::new_box(name, Aabb { min: place(min), max: place(max) }));
    }
    let mesh = source.hull.as_ref().and_then(|mesh| items.single_mesh(mesh));
    let entry = mesh.and_then(|(mesh, _)| world.resource::<Library>().mesh(mesh)).ok_or("its mesh is missing")?;
    let corners: Vec<Vec3> = entry.mesh.positions.iter().map(|p| *p + place(source.translation)).collect();
    Cell::new_hull(name, &corners, &entry.mesh.indices).map_err(|error| error.to_string())
}

fn portal(source: &PortalSource, world: &mut World) -> Entity {
    let name = source.name.clone().unwrap_or_else(|| source.between.join(" – "));
    let entity = world.spawn((Name::new(name), Portal { open: source.open })).id();
    if let Some(door) = &source.door {
        let leaf = door.leaf.as_ref().and_then(|leaf| named(leaf, world));
        let shut = leaf.and_then(|leaf| world.get::<Transform>(leaf).copied()).unwrap_or_default();
        if let Some(leaf) = leaf {
            world.entity_mut(leaf).insert(Interpolated::default());
        }
        world.entity_mut(entity).insert(Door {
            leaf,
            shut,
            swing: door.swing_degrees.to_radians(),
            slide: Vec3::from_array(door.slide),
            period: door.period_seconds,
            phase: door.phase_seconds,
        });
    }
    entity
}

/// The first entity of the scene's own of a name.
fn named(name: &str, world: &mut World) -> Option<Entity> {
    let mut all = world.query_filtered::<(Entity, &Name), Without<ChildOf>>();
    let found = all.iter(world).filter(|(_, own)| own.as_str() == name).map(|(entity, _)| entity);
    found.min_by_key(|entity| entity.index_u32())
}

/// A line for each object that is a sheet between two cells; the rest is counted.
pub fn shared_sheets(simulation: &mut Simulation) -> Vec<String> {
    if simulation.world.resource::<Cells>().is_empty() {
        return Vec::new();
    }
    simulation.frame();
    let sheets = cells::shared_sheets(&mut simulation.world);
    let tell = |(object, [a, b]): &(Entity, [String; 2])| {
        let name = name::of_entity(&simulation.world, *object);
        format!("{name:?} lies where cells {a:?} and {b:?} meet, and light of both reaches it; end cells within walls")
    };
    let mut told: Vec<String> = sheets.iter().take(MOST_SHEETS).map(tell).collect();
    match sheets.len().saturating_sub(MOST_SHEETS) {
        0 => {}
        more => told.push(format!("{more} more objects lie where two cells meet")),
    }
    told
}
