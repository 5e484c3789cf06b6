//! The list of entities. Names are gathered when the number of entities changes, and only the rows that are seen are
//! laid out, so that the list of a large world costs as little as that of a small one.

use crate::name;
use bevy_ecs::prelude::*;
use egui::{Align, Layout, RichText, ScrollArea, TextEdit, TextStyle};
use systems::assets::MeshId;
use systems::draw::Camera;
use systems::draw::pieces::{PieceOf, WholeMesh};
use systems::lights::Light;
use systems::sensors::Sensor;
use systems::space::GlobalTransform;

/// Points.
const HEIGHT: f32 = 220.0;

/// Main kind of an entity.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Drawn.
    Object,
    /// Shines.
    Light,
    /// Can be looked through.
    Camera,
    /// Measures.
    Sensor,
    /// A place that others hang on.
    Group,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Object => "object",
            Self::Light => "light",
            Self::Camera => "camera",
            Self::Sensor => "sensor",
            Self::Group => "group",
        }
    }
}

struct Row {
    entity: Entity,
    kind: Kind,
    name: String,
}

/// The list with its search field.
#[derive(Default)]
pub struct EntityList {
    rows: Vec<Row>,
    /// The world's archetypes and how many entities each had when the rows were gathered.
    gathered: Option<u64>,
    search: String,
    searched: Option<String>,
    /// Indices of the rows that the search leaves.
    found: Vec<usize>,
}

impl EntityList {
    /// Shows the list; returns the entity that was clicked.
    pub fn show(&mut self, ui: &mut egui::Ui, world: &mut World, selected: Option<Entity>) -> Option<Entity> {
        self.gather(world);
        let hint = "search by name";
        ui.add(TextEdit::singleline(&mut self.search).hint_text(hint).desired_width(f32::INFINITY));
        self.find();
        let mut clicked = None;
        let row_height = ui.text_style_height(&TextStyle::Button).max(ui.spacing().interact_size.y);
        let list = ScrollArea::vertical().max_height(HEIGHT).min_scrolled_height(HEIGHT).auto_shrink([false, true]);
        list.show_rows(ui, row_height, self.found.len(), |ui, range| {
            ui.with_layout(Layout::top_down_justified(Align::LEFT), |ui| {
                for row in self.found.get(range).unwrap_or_default().iter().filter_map(|&index| self.rows.get(index)) {
                    let kind = RichText::new(row.kind.name()).weak().small();
                    let button = egui::Button::selectable(selected == Some(row.entity), &row.name);
                    let button = button.truncate().right_text(kind);
                    if ui.add(button).clicked() {
                        clicked = Some(row.entity);
                    }
                }
            });
        });
        ui.weak(match self.found.len() {
            count if count == self.rows.len() => format!("{count} entities"),
            count => format!("{count} of {} entities", self.rows.len()),
        });
        clicked
    }

    fn gather(&mut self, world: &mut World) {
        let gathered = Some(fingerprint(world));
        if self.gathered == gathered {
            return;
        }
        self.gathered = gathered;
        self.searched = None;
        // Pieces are no entities of their own to a person: their object is in the list.
        type Placed = (With<GlobalTransform>, Without<PieceOf>);
        type Is = (Has<MeshId>, Has<WholeMesh>, Has<Light>, Has<Camera>, Has<Sensor>);
        let mut placed = world.query_filtered::<(Entity, Is), Placed>();
        let kind = |(entity, is): (Entity, (bool, bool, bool, bool, bool))| match is {
            (_, _, true, ..) => (entity, Kind::Light),
            (true, ..) | (_, true, ..) => (entity, Kind::Object),
            (.., true, _) => (entity, Kind::Camera),
            (.., true) => (entity, Kind::Sensor),
            _ => (entity, Kind::Group),
        };
        let kinds: Vec<_> = placed.iter(world).map(kind).collect();
        let row = |(entity, kind)| Row { entity, kind, name: name::of_entity(world, entity) };
        self.rows = kinds.into_iter().map(row).collect();
        self.rows.sort_by_key(|row| row.entity.index_u32());
    }

    fn find(&mut self) {
        if self.searched.as_ref() == Some(&self.search) {
            return;
        }
        let wanted = self.search.trim().to_lowercase();
        let rows = self.rows.iter().enumerate();
        self.found =
            rows.filter(|(_, row)| row.name.to_lowercase().contains(&wanted)).map(|(index, _)| index).collect();
        self.searched = Some(self.search.clone());
    }
}

/// Differs when entities come or go, or change what they are. Costs as much as there are archetypes: few.
fn fingerprint(world: &World) -> u64 {
    world.archetypes().iter().filter(|archetype| !archetype.is_empty()).fold(0, |sum: u64, archetype| {
        let one = (archetype.id().index() as u64) << 32 | u64::from(archetype.len());
        sum.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(one)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_ecs::name::Name;
    use systems::space::Transform;

    fn names(list: &EntityList) -> Vec<&str> {
        list.found.iter().map(|&index| list.rows[index].name.as_str()).collect()
    }

    #[test]
    fn the_list_follows_the_world_and_the_search() {
        let mut world = World::new();
        let mut list = EntityList::default();
        world.spawn((Name::new("Lamp post"), Transform::default(), Light::point(1.0, 1.0)));
        world.spawn((Name::new("Van"), Transform::default()));
        list.gather(&mut world);
        list.find();
        assert_eq!(names(&list), ["Lamp post", "Van"]);
        assert_eq!(list.rows.iter().map(|row| row.kind).collect::<Vec<_>>(), [Kind::Light, Kind::Group]);
        list.search = " LAMP".into();
        list.find();
        assert_eq!(names(&list), ["Lamp post"]);
        world.spawn((Name::new("Lamp 2"), Transform::default()));
        list.gather(&mut world);
        list.find();
        assert_eq!(names(&list), ["Lamp post", "Lamp 2"], "a new entity is searched too");
        let road = world
            .spawn((
                Name::new("Road lamp"),
                Transform::default(),
                WholeMesh { mesh: MeshId::from_slot(0), metres: 8.0 },
            ))
            .id();
        world.spawn((Transform::default(), MeshId::from_slot(1), ChildOf(road), PieceOf(road)));
        list.gather(&mut world);
        list.find();
        assert_eq!(names(&list), ["Lamp post", "Lamp 2", "Road lamp"], "an object in pieces is one row");
        assert_eq!(list.rows.last().map(|row| row.kind), Some(Kind::Object));
    }
}
