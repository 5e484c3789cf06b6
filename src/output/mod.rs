//! Files and folders that are written whole or not at all.
//!
//! ```text
//! whole, whole_folder   under temporary names, renamed when they are whole; png: pictures
//! hashes                by which damage is found
//! checks                of names, before work that would be lost
//! error                 why an output is refused, or cannot be written; names: all those of a file
//! ```

mod checks;
mod error;
mod hashes;
mod names;
mod png;
mod whole;
mod whole_folder;

pub use checks::{check_file, check_writable, create_anew, make_folder};
pub use error::{OutputError, check_folder};
pub use hashes::{hash_of, hashes_of};
pub use names::{is_same, real};
pub use png::{encode_png, write_png};
pub use whole::{WholeFile, write_whole, write_whole_with};
pub use whole_folder::WholeFolder;
