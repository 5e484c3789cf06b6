//! Steps and edits: the state of a world, the records of what is drawn, and frames between steps.

mod interpolation;
mod records;
mod state;
