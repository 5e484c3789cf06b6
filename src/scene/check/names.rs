//! Names that several cameras or vehicles have: views by such a name show the first of them only. And old names of
//! fields.

use crate::scene::format::entities::Entity;
use crate::scene::format::scene::Scene;
use crate::scene::text::places;
use std::collections::HashMap;
use systems::describe::Step;
use systems::describe::{Fault, Trail};

/// Places of a name that are told. Each is found by reading the text once more.
const PLACES_SHOWN: usize = 8;
/// Names that several cameras or vehicles have, each of which is told.
const SHARED_NAMES_SHOWN: usize = 8;

/// A line for each name that several cameras or vehicles have; the rest is counted. And one for an old name.
pub fn warnings(scene: &Scene, text: &str) -> Vec<String> {
    let Names { shared, old, .. } = names(scene);
    let place = |fault: &Fault| {
        let (line, column) = places::find(text, &fault.steps);
        format!("{} (line {line}, column {column})", fault.place)
    };
    let tell = |name: &Shared| {
        let mut places: Vec<String> = name.faults.iter().map(place).collect();
        if name.more > 0 {
            places.push(format!("{} more", name.more));
        }
        let message = name.faults.first().map_or("", |fault| &fault.message);
        format!("{}: {message}", listed(&places))
    };
    let mut warnings: Vec<String> = shared.iter().take(SHARED_NAMES_SHOWN).map(tell).collect();
    match shared.len().saturating_sub(SHARED_NAMES_SHOWN) {
        0 => {}
        1 => warnings.push("1 more name is shared by several cameras or vehicles".into()),
        more => warnings.push(format!("{more} more names are shared by several cameras or vehicles")),
    }
    warnings.extend(old.iter().map(|fault| format!("{}: {}", place(fault), fault.message)));
    warnings
}

/// `a`, `a and b`, `a, b and c`.
fn listed(all: &[String]) -> String {
    match all {
        [before @ .., last] if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => all.concat(),
    }
}

/// A name of several cameras, or of several vehicles.
struct Shared {
    /// Faults of the second of them and those after it, up to a bound.
    faults: Vec<Fault>,
    /// Number of further ones.
    more: usize,
}

/// Names of cameras, and of vehicles, that earlier ones have, in the order of the file; none of it is refused.
fn names(scene: &Scene) -> Names<'_> {
    let mut names = Names::default();
    names.entities(&Trail::default().field("entities"), &scene.entities);
    names
}

/// Place of the first thing of a name, and the index in [`Names::shared`] if there are more.
struct Known {
    first: String,
    shared: Option<usize>,
}

#[derive(Default)]
struct Names<'a> {
    cameras: HashMap<&'a str, Known>,
    vehicles: HashMap<&'a str, Known>,
    shared: Vec<Shared>,
    /// First place of `by_hand`.
    old: Option<Fault>,
}

impl<'a> Names<'a> {
    fn entities(&mut self, at: &Trail, entities: &'a [Entity]) {
        for (i, entity) in entities.iter().enumerate() {
            // Most have neither, and their place need not be written down.
            let (named, below) = (entity.name.as_deref(), !entity.children.is_empty() || !entity.attach.is_empty());
            let is_reached = named.is_some() && (entity.camera.is_some() || entity.vehicle.is_some());
            let is_old = self.old.is_none() && entity.vehicle.as_ref().is_some_and(|vehicle| vehicle.by_hand);
            if !is_reached && !below && !is_old {
                continue;
            }
            let at = at.enter(Step::Index(i), "");
            if is_old {
                self.old = Some(at.field("vehicle").field("by_hand").fault("deprecated name; use manual"));
            }
            if let Some(name) = named.filter(|_| entity.camera.is_some()) {
                let reached_by = format!("{name:?}");
                note(&mut self.cameras, &mut self.shared, &at, "camera", name, &reached_by);
            }
            if let Some(name) = named.filter(|_| entity.vehicle.is_some()) {
                let reached_by = format!("\"chase {name}\"");
                note(&mut self.vehicles, &mut self.shared, &at, "vehicle", name, &reached_by);
            }
            self.entities(&at.field("children"), &entity.children);
            self.entities(&at.field("attach"), &entity.attach);
        }
    }
}

fn note<'a>(
    known: &mut HashMap<&'a str, Known>,
    all: &mut Vec<Shared>,
    at: &Trail,
    kind: &str,
    name: &'a str,
    reached_by: &str,
) {
    let Some(Known { first, shared }) = known.get_mut(name) else {
        known.insert(name, Known { first: at.fault("").place, shared: None });
        return;
    };
    let index = *shared.get_or_insert_with(|| {
        all.push(Shared { faults: Vec::new(), more: 0 });
        all.len() - 1
    });
    let shared = &mut all[index];
    if shared.faults.len() == PLACES_SHOWN {
        shared.more += 1;
    } else {
        shared.faults.push(at.fault(format_args!(
            "duplicate {kind} name {name:?}: {first} has it, too, and {reached_by} selects that one only"
        )));
    }
}
