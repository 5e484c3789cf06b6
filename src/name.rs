//! Names for people: those that they type, looked up in a table, and when unknown answered with the nearest that is
//! known; and those of entities.

use bevy_ecs::entity::EntityHashMap;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;

/// The value of a name; else a message that names the nearest.
///
/// # Errors
/// One line: what was expected.
pub fn find<T: Copy>(what: &str, table: &[(&str, T)], wanted: &str) -> Result<T, String> {
    if let Some((_, value)) = table.iter().find(|(name, _)| *name == wanted) {
        return Ok(*value);
    }
    let names: Vec<&str> = table.iter().map(|(name, _)| *name).collect();
    let hint = hint(&names, wanted);
    Err(format!("unknown {what} \"{wanted}\"{hint}; expected one of: {}", names.join(", ")))
}

/// The name of a value in such a table; empty where it has none.
pub fn of<T: PartialEq>(table: &[(&'static str, T)], value: T) -> &'static str {
    table.iter().find(|(_, known)| *known == value).map_or("", |(name, _)| name)
}

/// Declares an enum of values that have names and are told in a line of help: its docs.
#[cfg(feature = "tools")]
macro_rules! named {
    ($(#[$meta:meta])* pub enum $type:ident {
        $(#[doc = $help:literal] $(#[$more:meta])* $variant:ident = $name:literal,)*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        pub enum $type {
            $(#[doc = $help] $(#[$more])* $variant,)*
        }

        impl $type {
            /// All with their names.
            pub const ALL: [(&'static str, Self); [$($name),*].len()] = [$(($name, Self::$variant)),*];

            /// Description in a line.
            pub fn help(self) -> &'static str {
                match self {
                    $(Self::$variant => $help.trim_ascii_start(),)*
                }
            }
        }
    };
}
#[cfg(feature = "tools")]
pub(crate) use named;

/// The entities of a scene file by their places in its list.
#[derive(Resource, Default)]
pub struct SceneEntities(pub EntityHashMap<usize>);

/// An entity's name: its own, else its nearest named ancestor's, else where the file has that or its topmost ancestor,
/// as `entities[3]`, else its id.
pub fn of_entity(world: &World, entity: Entity) -> String {
    let mut next = Some(entity);
    let mut topmost = entity;
    while let Some(current) = next {
        if let Some(name) = world.get::<Name>(current) {
            return name.as_str().to_owned();
        }
        topmost = current;
        next = world.get::<ChildOf>(current).map(ChildOf::parent);
    }
    let listed = world.get_resource::<SceneEntities>().and_then(|listed| listed.0.get(&topmost));
    listed.map_or_else(|| format!("entity {}", entity.index()), |index| format!("entities[{index}]"))
}

/// The known name most like the wanted one, if any is near.
pub fn nearest<'a>(known: &[&'a str], wanted: &str) -> Option<&'a str> {
    let scored = known.iter().map(|name| (strsim::jaro_winkler(name, wanted), *name));
    scored.filter(|(score, _)| *score > 0.7).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
}

/// Message on a name that nothing has: `unknown entity "brik" (did you mean "brick"?)`.
pub fn unknown<'a>(what: &str, known: impl IntoIterator<Item = &'a str>, wanted: &str) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    format!("unknown {what} {wanted:?}{}", hint(&known, wanted))
}

/// Continuation of a message on an unknown name: ` (did you mean "brick"?)`. It is empty where no known one is near.
pub fn hint(known: &[&str], wanted: &str) -> String {
    nearest(known, wanted).map_or(String::new(), |name| format!(" (did you mean \"{name}\"?)"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_is_answered_with_the_nearest() {
        let table = [("off", 1), ("normal", 2)];
        assert_eq!(find("technique", &table, "normal"), Ok(2));
        let message = find("technique", &table, "nomral").unwrap_err();
        assert_eq!(message, "unknown technique \"nomral\" (did you mean \"normal\"?); expected one of: off, normal");
        assert!(!find("technique", &table, "zzz").unwrap_err().contains("did you mean"));
    }

    #[test]
    fn what_has_no_name_is_called_by_its_place_in_the_file() {
        let mut world = World::new();
        let [listed, other, named] = [0, 1, 2].map(|_| world.spawn_empty().id());
        let [child, of_named] = [listed, named].map(|parent| world.spawn(ChildOf(parent)).id());
        world.entity_mut(named).insert(Name::new("lamp"));
        world.insert_resource(SceneEntities([(listed, 7), (named, 8)].into_iter().collect()));
        let names = [child, listed, of_named].map(|entity| of_entity(&world, entity));
        assert_eq!(names, ["entities[7]", "entities[7]", "lamp"]);
        assert_eq!(of_entity(&world, other), format!("entity {}", other.index()));
    }
}
