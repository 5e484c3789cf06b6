//! Faults, and their places in what is described.

use std::fmt::{self, Display};

/// One step from a value to one inside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// A field of a struct.
    Field(&'static str),
    /// An element of a list or tuple.
    Index(usize),
    /// An entry of a map, by its position.
    Entry(usize),
}

/// A fault, and the steps to the value that has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Steps from the outermost value.
    pub steps: Vec<Step>,
    /// The steps for people: `entities[3].light.range`.
    pub place: String,
    /// Expected and found value.
    pub message: String,
}

/// `range: expected …`; the message alone where the whole is at fault.
impl Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.place.is_empty() { f.write_str(&self.message) } else { write!(f, "{}: {}", self.place, self.message) }
    }
}

/// A place in something that is walked through.
#[derive(Default, Clone, Debug)]
pub struct Trail {
    steps: Vec<Step>,
    place: String,
}

impl Trail {
    /// The same place, one step further in; `key` is the name of a map's entry.
    #[must_use]
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

    /// The same place, in a field of the struct there.
    #[must_use]
    pub fn field(&self, name: &'static str) -> Self {
        self.enter(Step::Field(name), "")
    }

    /// Steps from the outermost value.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// A fault of the value at the place.
    pub fn fault(&self, message: impl Display) -> Fault {
        Fault { steps: self.steps.clone(), place: self.place.clone(), message: message.to_string() }
    }

    /// The same fault, of a value that is itself at the place.
    #[must_use]
    pub fn around(&self, fault: &Fault) -> Fault {
        let dot =
            if self.place.is_empty() || fault.place.is_empty() || fault.place.starts_with('[') { "" } else { "." };
        Fault {
            steps: self.steps.iter().chain(&fault.steps).copied().collect(),
            place: format!("{}{dot}{}", self.place, fault.place),
            message: fault.message.clone(),
        }
    }
}
