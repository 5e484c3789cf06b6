//! Doubts about cells and portals, as messages for people.

use super::cells::{Cell, Cells, OUTSIDE, Opening};
use super::geometry::{Plane, Solid, area_vector, clip, middle};
use super::occupied::EDGE;
use crate::assets::library::Library;
use crate::assets::mesh::MeshId;
use crate::assets::object_bounds::world_box;
use crate::space::bounds::Aabb;
use crate::space::transform::GlobalTransform;
use bevy_ecs::prelude::*;
use glam::Vec3;

/// Metres by which a portal may be bent.
const BENT: f32 = 0.005;
/// Metres that a portal may be away from a cell's wall: what is further apart is outside, and light is lost there.
const APART: f32 = 0.001;
/// Metres that a portal may reach beyond a cell's wall, along that.
const BEYOND: f32 = 0.1;
/// The cosine of the angle to a portal below which a wall is beside it rather than along it.
const ALONG: f32 = 0.7;
/// Metres that cells may reach into each other, and of portals that lie over each other.
const OVERLAP: f32 = 0.05;
/// Metres: a thinner object is a sheet.
const SHEET: f32 = 0.02;

/// Lists faults of cells and of the openings between them. Each names a place: an opening's own first. Numbers of cells
/// are those that [`Cells::new`] gives.
pub fn problems(cells: &[Cell], openings: &[Opening]) -> Vec<String> {
    let all = Cells::new(cells.to_vec(), Vec::new());
    let mut found = Vec::new();
    for (i, opening) in openings.iter().enumerate() {
        found.extend(of_opening(&all, opening).into_iter().map(|message| format!("portals[{i}]: {message}")));
        for (j, other) in openings[..i].iter().enumerate() {
            if lie_over_each_other(&opening.polygon, &other.polygon) {
                found.push(format!("portals[{i}]: lies over portals[{j}]"));
            }
        }
    }
    for (i, cell) in cells.iter().enumerate() {
        for other in &cells[..i] {
            if let Some(metres) = common_depth(cell, other) {
                let [a, b] = [&cell.name, &other.name];
                found.push(format!("cells[{a:?}]: overlaps cells[{b:?}] by {metres:.2} m; cells have to be disjoint"));
            }
        }
    }
    found
}

fn of_opening(cells: &Cells, opening: &Opening) -> Vec<String> {
    let polygon = &opening.polygon;
    let Some(normal) = area_vector(polygon).try_normalize() else { return vec!["has no area".into()] };
    let (center, mut found) = (middle(polygon), Vec::new());
    let bent = polygon.iter().map(|p| normal.dot(*p - center).abs()).fold(0.0, f32::max);
    if bent > BENT {
        found.push(format!("its polygon is not planar, by {:.0} mm", bent * 1000.0));
    }
    let is_convex = polygon.iter().enumerate().all(|(i, &a)| {
        let side = normal.cross(polygon[(i + 1) % polygon.len()] - a).normalize_or_zero();
        polygon.iter().all(|p| side.dot(*p - a) > -BENT)
    });
    if !is_convex {
        found.push("its polygon is not convex".into());
    }
    for number in opening.between {
        match cells.cell(number) {
            Some(cell) => {
                let [apart, beyond] = outside(polygon, normal, cell);
                // What coordinates round by, of portal and wall.
                let rounding = 2.0 * f32::EPSILON * polygon.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
                if apart > APART + rounding {
                    let (name, gap) = (&cell.name, 1000.0 * apart);
                    let gap = if gap < 10.0 { format!("{gap:.1}") } else { format!("{gap:.0}") };
                    found.push(format!("does not touch cells[{name:?}]: {gap} mm away; what is between is outside"));
                } else if beyond > BEYOND {
                    found.push(format!("reaches {beyond:.2} m beyond cells[{:?}]", cell.name));
                }
            }
            None => {
                // Outside is on one side of it.
                let beyond = [1.0, -1.0].map(|side| cells.at(center + normal * (side * 2.0 * BEYOND)));
                if let (false, Some(cell)) = (beyond.contains(&OUTSIDE), cells.cell(beyond[0])) {
                    found.push(format!("does not lead outside: cells[{:?}] is there", cell.name));
                }
            }
        }
    }
    found
}

/// Metres by which a portal is outside a cell: by walls along it, and by those beside it.
fn outside(polygon: &[Vec3], normal: Vec3, cell: &Cell) -> [f32; 2] {
    let (along, beside): (Vec<&Plane>, _) = cell.planes.iter().partition(|p| p.normal.dot(normal).abs() > ALONG);
    [along, beside].map(|walls| {
        let distances = polygon.iter().flat_map(|p| walls.iter().map(|wall| -wall.distance(*p)));
        distances.fold(0.0, f32::max)
    })
}

fn lie_over_each_other(a: &[Vec3], b: &[Vec3]) -> bool {
    let (Some(normal), center) = (area_vector(b).try_normalize(), middle(b)) else { return false };
    let common = b.iter().enumerate().fold(a.to_vec(), |common, (i, &corner)| {
        let side = normal.cross(b[(i + 1) % b.len()] - corner).normalize_or_zero();
        clip(&common, &Plane { normal: side, offset: side.dot(corner) })
    });
    let is_near = common.iter().all(|p| normal.dot(*p - center).abs() < OVERLAP);
    is_near && 0.5 * area_vector(&common).length() > OVERLAP * OVERLAP
}

/// Metres by which two cells reach into each other, if they do.
fn common_depth(a: &Cell, b: &Cell) -> Option<f32> {
    let common = Aabb { min: a.aabb().min.max(b.aabb().min), max: a.aabb().max.min(b.aabb().max) };
    let half = (common.max - common.min) * 0.5;
    if half.min_element() * 2.0 < OVERLAP {
        return None;
    }
    let mut planes = a.planes.iter().chain(&b.planes);
    let solid = planes.try_fold(Solid::new_box(half), |solid, plane| {
        solid.clip(&Plane { normal: plane.normal, offset: -plane.distance(common.center()) })
    })?;
    let depth = solid.extent().min_element();
    (depth > OVERLAP).then_some(depth)
}

/// Objects that are sheets on the border of two cells, which the light of both reaches: each with the names of these.
/// After a frame.
pub fn shared_sheets(world: &mut World) -> Vec<(Entity, [String; 2])> {
    let mut objects = world.query::<(Entity, &MeshId, &GlobalTransform)>();
    let (cells, library) = (world.resource::<Cells>(), world.resource::<Library>());
    let shared = |(object, &mesh, place): (Entity, &MeshId, &GlobalTransform)| {
        let aabb = world_box(library, mesh, place)?;
        let (center, half) = (aabb.center(), (aabb.max - aabb.min) * 0.5);
        if half.min_element() * 2.0 > SHEET {
            return None;
        }
        let is_on_border = |cell: &&Cell| cell.overlap(center, half).abs() < EDGE;
        let mut names = cells.cells().iter().filter(is_on_border).map(|cell| cell.name.clone());
        Some((object, [names.next()?, names.next()?]))
    };
    objects.iter(world).filter_map(shared).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(name: &str, min: [f32; 3], max: [f32; 3]) -> Cell {
        Cell::new_box(name, Aabb { min: min.into(), max: max.into() })
    }

    fn door(x: f32, z: f32, between: [u32; 2]) -> Opening {
        let polygon = [(0.0, 0.0), (0.0, 1.0), (2.0, 1.0), (2.0, 0.0)].map(|(y, dz)| Vec3::new(x, y, z + dz));
        Opening { between, polygon: polygon.to_vec(), portal: None }
    }

    #[test]
    fn everything_doubtful_is_said() {
        let rooms = [cell("a", [0.0; 3], [4.0, 3.0, 4.0]), cell("b", [4.0, 0.0, 0.0], [8.0, 3.0, 4.0])];
        let none: [String; 0] = [];
        assert_eq!(problems(&rooms, &[door(4.0, 1.0, [1, 2]), door(8.0, 1.0, [2, OUTSIDE])]), none);
        let mut bent = door(4.0, 1.0, [1, 2]);
        bent.polygon[2].x += 0.08;
        let mut dented = door(4.0, 1.0, [1, 2]);
        dented.polygon.insert(1, Vec3::new(4.0, 0.5, 1.5));
        let far = door(4.5, 1.0, [1, 2]);
        let over = door(4.02, 1.5, [2, 1]);
        let inside = door(4.0, 3.0, [1, OUTSIDE]);
        let found = problems(&rooms, &[bent, far, over, inside, dented]);
        assert_eq!(
            found,
            [
                "portals[0]: its polygon is not planar, by 20 mm",
                "portals[0]: does not touch cells[\"a\"]: 80 mm away; what is between is outside",
                "portals[1]: does not touch cells[\"a\"]: 500 mm away; what is between is outside",
                "portals[2]: does not touch cells[\"a\"]: 20 mm away; what is between is outside",
                "portals[2]: lies over portals[0]",
                "portals[3]: does not lead outside: cells[\"a\"] is there",
                "portals[4]: its polygon is not convex",
                "portals[4]: lies over portals[2]",
            ]
        );
        let into = [rooms[0].clone(), cell("c", [3.5, 0.0, 0.0], [8.0, 3.0, 4.0])];
        assert_eq!(problems(&into, &[]), ["cells[\"c\"]: overlaps cells[\"a\"] by 0.50 m; cells have to be disjoint"]);
    }

    #[test]
    fn portals_beside_their_cells_are_said_with_their_distance() {
        let of = |gap: f32, change: fn(&mut Vec<Vec3>)| {
            // Cells that end at the inner faces of a wall around x = 4, and a portal in its middle.
            let rooms = [cell("a", [0.0; 3], [4.0 - gap, 3.0, 4.0]), cell("b", [4.0 + gap, 0.0, 0.0], [8.0, 3.0, 4.0])];
            let mut door = door(4.0, 1.0, [1, 2]);
            change(&mut door.polygon);
            problems(&rooms, &[door])
        };
        let both = |gap: &str| {
            ["a", "b"].map(|cell| {
                format!("portals[0]: does not touch cells[{cell:?}]: {gap} mm away; what is between is outside")
            })
        };
        let none: [String; 0] = [];
        assert_eq!(of(0.0, |_| ()), none);
        assert_eq!(of(0.0005, |_| ()), none, "within a millimetre they touch");
        assert_eq!(of(0.002, |_| ()), both("2.0"));
        assert_eq!(of(0.1, |_| ()), both("100"));
        // Tilted about its lower edge: its upper one is 30 cm within one room, and as far from the other.
        let tilted = |polygon: &mut Vec<Vec3>| polygon.iter_mut().for_each(|p| p.x += 0.15 * p.y);
        let found = of(0.0, tilted);
        assert_eq!(found, both("300")[..1]);
        // Larger than the wall that it is in: 0.5 m above the ceiling.
        let high = |polygon: &mut Vec<Vec3>| polygon.iter_mut().for_each(|p| p.y *= 1.75);
        let beyond = ["a", "b"].map(|cell| format!("portals[0]: reaches 0.50 m beyond cells[{cell:?}]"));
        assert_eq!(of(0.0, high), beyond);
    }
}
