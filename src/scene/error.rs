//! Refused scenes.

use crate::problem::Problem;
use std::fmt;

/// Problems for which a scene is refused, at least one. Its text is the first and how many more there are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// In the order of the file.
    pub problems: Vec<Problem>,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Some((first, others)) = self.problems.split_first() else { return f.write_str("invalid scene") };
        match others.len() {
            0 => write!(f, "{first}"),
            1 => write!(f, "{first} (and 1 more problem)"),
            n => write!(f, "{first} (and {n} more problems)"),
        }
    }
}

impl std::error::Error for SceneError {}

impl From<Problem> for SceneError {
    fn from(problem: Problem) -> Self {
        Self { problems: vec![problem] }
    }
}
