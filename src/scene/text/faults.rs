//! Faults of a scene and their places; suggestions for unknown names.

use super::places::Step;
use std::fmt::Display;

/// A fault, and the steps to the value that has it.
pub struct Fault {
    pub steps: Vec<Step>,
    /// The steps for people: `entities[3].light.range`.
    pub place: String,
    pub message: String,
}

/// A place in the scene while walking it.
#[derive(Default, Clone, Debug)]
pub struct Trail {
    steps: Vec<Step>,
    place: String,
}

impl Trail {
    /// The same place, one step further in; `key` is the name of a map's entry.
    pub fn enter(&self, step: Step, key: &str) -> Self {
        let mut trail = self.clone();
        match step {
            Step::Field(name) if trail.place.is_empty() => trail.place.push_str(name),
            Step::Field(name) => trail.place.push_str(&format!(".{name}")),
            Step::Index(i) => trail.place.push_str(&format!("[{i}]")),
            Step::Entry(_) => trail.place.push_str(&format!("[{key:?}]")),
        }
        trail.steps.push(step);
        trail
    }

    pub fn field(&self, name: &'static str) -> Self {
        self.enter(Step::Field(name), "")
    }

    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    pub fn fault(&self, message: impl Display) -> Fault {
        Fault { steps: self.steps.clone(), place: self.place.clone(), message: message.to_string() }
    }
}

/// `unknown material "brik"; did you mean "brick"?`, or the names there are where none is near.
pub fn unknown<'n>(kind: &str, name: &str, known: impl Iterator<Item = &'n str>) -> String {
    let known: Vec<&str> = known.collect();
    format!("unknown {kind} {name:?}{}", suggestion(name, &known))
}

/// The end of a message about an unknown name.
pub fn suggestion(name: &str, known: &[&str]) -> String {
    // Comparing costs the product of the lengths; no name of a thousand letters is meant.
    let comparable: Vec<&str> = known.iter().copied().filter(|k| k.len() + name.len() < 200).collect();
    if let Some(near) = crate::name::nearest(&comparable, name) {
        return format!("; did you mean {near:?}?");
    }
    if known.is_empty() {
        return "; none are defined".into();
    }
    let shown: Vec<String> = known.iter().take(12).map(|k| format!("{k:?}")).collect();
    let more = if known.len() > shown.len() { ", …" } else { "" };
    format!("; expected one of {}{more}", shown.join(", "))
}
