//! Descriptions of things as people write them: fields with their documentation, units, ranges and defaults.
//!
//! A described struct derives `Serialize`, `Deserialize` and `JsonSchema`. What its fields are stands on it alone, in
//! doc comments and attributes. Whatever passes fields on reads it there and names no kind of thing: scene files,
//! checks, keywords and properties in Python, type stubs, the window's editor, tables in the docs, schemas for editors.
//!
//! ```
//! use schemars::JsonSchema;
//! use serde::{Deserialize, Serialize};
//! use systems::describe::{Described, check};
//!
//! /// A siren.
//! #[derive(Serialize, Deserialize, JsonSchema, Clone, Debug)]
//! #[serde(default, deny_unknown_fields)]
//! struct Siren {
//!     /// Loudness at 1 m.
//!     #[schemars(range(min = 0.0, max = 140.0), extend("unit" = "dB"))]
//!     loudness: f32,
//! }
//!
//! impl Default for Siren {
//!     fn default() -> Self {
//!         Self { loudness: 90.0 }
//!     }
//! }
//!
//! impl Described for Siren {}
//!
//! let fault = check(&Siren { loudness: 200.0 }).unwrap_err();
//! assert_eq!(fault.to_string(), "loudness: expected a number from 0 to 140, found 200");
//! ```
//!
//! Attributes that schemas do not have are said by `extend`: `"unit"`, by its symbol; `"infinite"`, where infinity is
//! written by leaving the field out; `"of"`, what a list is of, for messages; `"expected"`, a value in its several ways
//! of writing, for messages; `"see"`, such a value in tables of the docs; `"kinds"`, where a field belongs to some
//! kinds of a thing only.

pub(crate) mod angle;
pub(crate) mod check;
pub(crate) mod fault;
pub mod infinite;
pub(crate) mod schema;

pub use angle::degrees;
pub use check::{Described, check, faults, whole_faults};
pub use fault::{Fault, Step, Trail};
pub use schema::{Field, field_names, fields, fields_of, names, of_other_kinds, schema};
