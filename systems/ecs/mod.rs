//! Foundation of all other systems, whatever they are about.
//!
//! Components lie in tables, rows by rows. `changes` finds the few rows that changed, by the ticks that bevy keeps of
//! them; `columns` writes a column in parts, for the threads that `parallel` shares work out to. What is known of an
//! entity beside its components is a number by `entity_numbers`, sets of such are `bits`, and `read_ahead` reads memory
//! before its use. [`tables`] are what a GPU's buffers are filled from: records by slot, and which of them changed.
//! The [`clock`] says what time it is in the world, [`sub_steps`] cut a long step, [`stats`] say how long a frame took.
//!
//! Nothing here knows what an entity is: of this crate, this folder uses nothing else.

pub(crate) mod bits;
pub(crate) mod changes;
pub mod clock;
pub(crate) mod columns;
pub(crate) mod entity_numbers;
pub mod parallel;
pub(crate) mod read_ahead;
pub mod stats;
pub mod sub_steps;
pub mod tables;
