//! Cells and portals.

use super::walk::Check;
use crate::scene::format::cells::{Cell, Door, OUTSIDE_NAME, Portal};
use crate::scene::text::faults::unknown;
use systems::describe::Step;

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

    fn cell(&mut self, cell: &'a Cell) {
        if cell.r#box.is_some() == cell.hull.is_some() {
            return self.fault("expected either box or hull");
        }
        self.described(cell);
        if let Some([min, max]) = &cell.r#box
            && min.iter().zip(max).any(|(min, max)| min >= max)
        {
            let message = format!("expected the least and the largest corner, found {min:?} and {max:?}");
            self.field("box", |c| c.fault(message));
        }
        if let Some(mesh) = &cell.hull {
            self.field("hull", |c| c.figure(mesh));
        }
        if cell.hull.is_none() && cell.translation != [0.0; 3] {
            self.field("translation", |c| c.fault("only allowed with hull"));
        }
    }

    fn portal(&mut self, portal: &'a Portal) {
        let cells = &self.scene.cells;
        for cell in portal.between.iter().filter(|cell| *cell != OUTSIDE_NAME && cells.get(cell).is_none()) {
            let message = unknown("cell", cell, cells.names().chain([OUTSIDE_NAME]));
            self.field("between", |c| c.fault(message));
        }
        if portal.between[0] == portal.between[1] {
            self.field("between", |c| c.fault("expected two different cells"));
        }
        self.described(portal);
        if let Some(door) = &portal.door {
            self.field("door", |c| c.door(door));
        }
    }

    fn door(&mut self, door: &'a Door) {
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
            let mut doors = self.scene.portals.iter().filter_map(|portal| portal.door.as_ref());
            let first = doors.find(|other| other.leaf.as_ref() == Some(leaf));
            if first.is_some_and(|first| !std::ptr::eq(first, door)) {
                self.field("leaf", |c| c.fault("expected a leaf of its own: another door moves it, too"));
            }
        }
        if door.leaf.is_none() && (door.swing_degrees != 0.0 || door.slide != [0.0; 3]) {
            self.fault("expected `leaf` beside swing_degrees and slide");
        }
    }
}
