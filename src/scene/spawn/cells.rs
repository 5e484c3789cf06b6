//! Cells and portals of a checked scene, and of models, in the world; and what is doubtful of them.

use crate::import::{RoomPart, RoomRole};
use crate::name;
use crate::scene::format::cells::{Cell as Source, OUTSIDE_NAME, Portal as PortalSource};
use crate::scene::format::scene::Scene;
use crate::scene::format::values::place;
use crate::scene::read::items::Items;
use crate::scene::text::faults::unknown;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use bevy_ecs::system::RunSystemOnce;
use glam::{Affine3A, Vec3};
use std::collections::HashMap;
use systems::Simulation;
use systems::assets::Library;
use systems::cells::{self, Cell, Cells, Door, OUTSIDE, Opening, Portal};
use systems::space::{Aabb, Interpolated, Transform};

/// Metres from a model's portal to the cells that it is between.
const BESIDE: f32 = 0.05;
/// Sheets that are told one by one.
const MOST_SHEETS: usize = 5;

/// Puts the cells of a checked scene, and of models, into the world, with an entity for each portal; after the entities
/// that are leaves of doors. Returns what is doubtful.
pub fn spawn(scene: Option<(&Scene, &Items)>, world: &mut World) -> Vec<String> {
    let parts = take_room_parts(world);
    let has_own = scene.is_some_and(|(scene, _)| scene.cells.entries().len() + scene.portals.len() > 0);
    if !has_own && parts.is_empty() {
        return Vec::new();
    }
    let mut rooms = Rooms::default();
    for (name, source) in scene.iter().flat_map(|(scene, _)| scene.cells.entries()) {
        let items = scene.map(|(_, items)| items);
        rooms.add(name, cell(name, source, items, world));
    }
    for RoomGeometry { role, corners, indices } in &parts {
        if let RoomRole::Cell(name) = role {
            rooms.add(name, Cell::new_hull(name, corners, indices).map_err(|error| error.to_string()));
        }
    }
    let mut openings = Vec::new();
    for source in scene.iter().flat_map(|(scene, _)| &scene.portals) {
        let polygon = source.polygon.iter().map(|&corner| place(corner)).collect();
        let between = [rooms.number(&source.between[0]), rooms.number(&source.between[1])];
        openings.push(Opening { between, polygon, portal: Some(portal(source, world)) });
    }
    let all = Cells::new(rooms.cells.clone(), Vec::new());
    for RoomGeometry { role, corners, .. } in &parts {
        let RoomRole::Portal(names) = role else { continue };
        let Some((polygon, normal)) = outline(corners) else {
            rooms.warnings.push("a model's portal has no area".into());
            continue;
        };
        let middle = polygon.iter().sum::<Vec3>() / polygon.len() as f32;
        let between = match names {
            Some(names) => names.each_ref().map(|name| rooms.known(name)),
            None => [-1.0, 1.0].map(|side| all.at(middle + normal * (side * BESIDE))),
        };
        let portal = world.spawn((Name::new("portal"), Portal::default())).id();
        openings.push(Opening { between, polygon, portal: Some(portal) });
    }
    let Rooms { cells: rooms, mut warnings, .. } = rooms;
    // As at the beginning of the run, before any step.
    if let Err(error) = world.run_system_once(cells::move_doors) {
        warnings.push(error.to_string());
    }
    warnings.extend(cells::problems(&rooms, &openings));
    world.insert_resource(Cells::new(rooms, openings));
    warnings
}

/// Cells by name.
#[derive(Default)]
struct Rooms {
    cells: Vec<Cell>,
    /// 0 where a name is of no cell.
    numbers: HashMap<String, u32>,
    warnings: Vec<String>,
}

impl Rooms {
    fn add(&mut self, name: &str, cell: Result<Cell, String>) {
        if self.numbers.contains_key(name) || name == OUTSIDE_NAME {
            self.warnings.push(format!("cells[{name:?}]: a model has another cell of that name, which is left out"));
            return;
        }
        let number = match cell {
            Ok(cell) => {
                self.cells.push(cell);
                self.cells.len() as u32
            }
            Err(error) => {
                self.warnings.push(format!("cells[{name:?}]: {error}; it counts as outside"));
                OUTSIDE
            }
        };
        self.numbers.insert(name.into(), number);
    }

    fn number(&self, name: &str) -> u32 {
        self.numbers.get(name).copied().unwrap_or(OUTSIDE)
    }

    /// The number of a name that no check has seen.
    fn known(&mut self, name: &str) -> u32 {
        if name != OUTSIDE_NAME && !self.numbers.contains_key(name) {
            self.warnings
                .push(format!("a model's portal: {}", unknown("cell", name, self.numbers.keys().map(String::as_str))));
        }
        self.number(name)
    }
}

/// A model's cell or portal in the world.
struct RoomGeometry {
    role: RoomRole,
    corners: Vec<Vec3>,
    indices: Vec<u32>,
}

/// The models' cells and portals, in the order in which they were spawned.
fn take_room_parts(world: &mut World) -> Vec<RoomGeometry> {
    let mut all = world.query::<(Entity, &RoomPart)>();
    let mut parts: Vec<(Entity, RoomPart)> = all.iter(world).map(|(entity, part)| (entity, part.clone())).collect();
    parts.sort_unstable_by_key(|(entity, _)| entity.index_u32());
    let library = world.resource::<Library>();
    let geometry = |(entity, part): &(Entity, RoomPart)| {
        let mut place = Affine3A::IDENTITY;
        let mut next = Some(*entity);
        while let Some(current) = next {
            place = world.get::<Transform>(current).map_or(Affine3A::IDENTITY, Transform::compute_affine) * place;
            next = world.get::<ChildOf>(current).map(ChildOf::parent);
        }
        let (mut corners, mut indices) = (Vec::new(), Vec::new());
        for entry in part.meshes.iter().filter_map(|&mesh| library.mesh(mesh)) {
            let first = corners.len() as u32;
            corners.extend(entry.mesh.positions.iter().map(|p| place.transform_point3(*p)));
            indices.extend(entry.mesh.indices.iter().map(|index| first + index));
        }
        RoomGeometry { role: part.role.clone(), corners, indices }
    };
    let found = parts.iter().map(geometry).collect();
    parts.iter().for_each(|(entity, _)| _ = world.entity_mut(*entity).remove::<RoomPart>());
    found
}

/// The corners of a flat convex mesh in order around it, and its normal.
fn outline(corners: &[Vec3]) -> Option<(Vec<Vec3>, Vec3)> {
    let first = *corners.first()?;
    let far = corners.iter().copied().max_by(|a, b| a.distance(first).total_cmp(&b.distance(first)))?;
    let across = |p: Vec3| (far - first).cross(p - first);
    let most = corners.iter().copied().max_by(|a, b| across(*a).length().total_cmp(&across(*b).length()))?;
    let normal = across(most).try_normalize()?;
    let middle = corners.iter().sum::<Vec3>() / corners.len() as f32;
    let (x, y) = normal.any_orthonormal_pair();
    let angle = |p: Vec3| (p - middle).dot(y).atan2((p - middle).dot(x));
    let mut outline = corners.to_vec();
    outline.sort_by(|a, b| angle(*a).total_cmp(&angle(*b)));
    outline.dedup_by(|a, b| a.distance(*b) < 1e-4);
    Some((outline, normal))
}

fn cell(name: &str, source: &Source, items: Option<&Items>, world: &World) -> Result<Cell, String> {
    if let Some([min, max]) = source.r#box {
        return Ok(Cell::new_box(name, Aabb { min: place(min), max: place(max) }));
    }
    let mesh = source.hull.as_ref().zip(items).and_then(|(mesh, items)| items.single_mesh(mesh));
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
