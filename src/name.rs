//! Names for people: those that they type, looked up in a table, and when unknown answered with the nearest that is
//! known; and those of entities.

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
    let hint = nearest(&names, wanted).map_or(String::new(), |name| format!(" (did you mean \"{name}\"?)"));
    Err(format!("unknown {what} \"{wanted}\"{hint}; expected one of: {}", names.join(", ")))
}

/// The name of a value in such a table; empty where it has none.
pub fn of<T: PartialEq>(table: &[(&'static str, T)], value: T) -> &'static str {
    table.iter().find(|(_, known)| *known == value).map_or("", |(name, _)| name)
}

/// An entity's name: its own, else its nearest named ancestor's, else its id.
pub fn of_entity(world: &World, entity: Entity) -> String {
    let mut next = Some(entity);
    while let Some(current) = next {
        if let Some(name) = world.get::<Name>(current) {
            return name.as_str().to_owned();
        }
        next = world.get::<ChildOf>(current).map(ChildOf::parent);
    }
    format!("entity {}", entity.index())
}

/// The known name most like the wanted one, if any is near.
pub fn nearest<'a>(known: &[&'a str], wanted: &str) -> Option<&'a str> {
    let scored = known.iter().map(|name| (strsim::jaro_winkler(name, wanted), *name));
    scored.filter(|(score, _)| *score > 0.7).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
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
}
