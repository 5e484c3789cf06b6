//! Faults found in a file while it is read.

use crate::import::error::{ImportError, Warning};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A file made of nothing but mistakes is not listed to its end.
const MOST: usize = 1000;

/// Collects faults and goes on, so that one reading names them all.
pub struct Report {
    pub path: PathBuf,
    pub errors: Vec<ImportError>,
    pub warnings: Vec<Warning>,
    /// Places and messages of the warnings: each is given once.
    given: BTreeSet<(String, String)>,
}

/// One reason why something cannot be read; becomes an error or, where nothing depends on it, a warning.
#[derive(Clone, Debug)]
pub struct Fault {
    pub kind: FaultKind,
    pub place: String,
    pub message: String,
}

#[derive(Clone, Copy, Debug)]
pub enum FaultKind {
    Unreadable,
    Invalid,
    Unsupported,
    /// glTF allows a buffer without data: what needs it is left out, and the rest still drawn.
    NoData,
}

pub type Read<T> = Result<T, Fault>;

impl Fault {
    pub fn invalid(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { kind: FaultKind::Invalid, place: place.into(), message: message.into() }
    }

    pub fn unsupported(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { kind: FaultKind::Unsupported, place: place.into(), message: message.into() }
    }

    pub fn unreadable(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { kind: FaultKind::Unreadable, place: place.into(), message: message.into() }
    }

    pub fn into_error(self, path: &Path) -> ImportError {
        let Self { kind, place, message } = self;
        let path = path.to_owned();
        match kind {
            FaultKind::Unreadable => ImportError::Unreadable { path, place, message },
            FaultKind::Invalid | FaultKind::NoData => ImportError::Invalid { path, place, message },
            FaultKind::Unsupported => ImportError::Unsupported { path, place, message },
        }
    }
}

impl Report {
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), errors: Vec::new(), warnings: Vec::new(), given: BTreeSet::new() }
    }

    pub fn error(&mut self, fault: Fault) {
        if matches!(fault.kind, FaultKind::NoData) {
            self.warn(fault.place, fault.message);
        } else if self.errors.len() < MOST {
            self.errors.push(fault.into_error(&self.path));
        }
    }

    pub fn invalid(&mut self, place: impl Into<String>, message: impl Into<String>) {
        self.error(Fault::invalid(place, message));
    }

    pub fn unsupported(&mut self, place: impl Into<String>, message: impl Into<String>) {
        self.error(Fault::unsupported(place, message));
    }

    pub fn warn(&mut self, place: impl Into<String>, message: impl Into<String>) {
        let (place, message) = (place.into(), message.into());
        if self.warnings.len() < MOST && self.given.insert((place.clone(), message.clone())) {
            self.warnings.push(Warning { path: self.path.clone(), place, message });
        }
    }

    /// A fault refuses the file only where something that is drawn depends on it.
    pub fn fault(&mut self, needed: bool, fault: Fault) {
        if needed {
            self.error(fault);
        } else {
            self.warn(fault.place, format!("{} (nothing in the scene uses it)", fault.message));
        }
    }
}
