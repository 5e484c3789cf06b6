//! Arguments of calls: what each is read as, and errors that name it, what was expected and what was found.
//!
//! Functions take what is given as it comes, as [`Given`], and read it here by its name. What has many arguments takes
//! them as [`Keywords`].

use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{
    PyByteArray, PyBytes, PyComplex, PyDict, PyFrozenSet, PyIterator, PyMemoryView, PySet, PyString, PyTuple,
};
use relief::name;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// An argument that may be left out; ``None`` stands for that.
pub type Given<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Characters of a wrong value that a message shows.
const MOST_SHOWN: usize = 60;

/// Names of arguments in other programs, with those used here.
const SYNONYMS: [(&str, &str); 5] =
    [("width", "size"), ("height", "size"), ("resolution", "size"), ("fov", "fov_y_degrees"), ("position", "at")];

/// Types that an argument may be read as.
pub trait Argument: for<'a, 'py> FromPyObject<'a, 'py> {
    /// Expected value, for messages.
    fn expected() -> String;
}

macro_rules! argument {
    ($($kind:ty: $expected:expr;)*) => {
        $(impl Argument for $kind {
            fn expected() -> String {
                $expected.into()
            }
        })*
    };
}

argument! {
    bool: "True or False";
    f32: "a number";
    f64: "a number";
    u8: format!("a whole number from 0 to {}", u8::MAX);
    u32: format!("a whole number from 0 to {}", u32::MAX);
    u64: format!("a whole number from 0 to {}", u64::MAX);
    usize: format!("a whole number from 0 to {}", usize::MAX);
    isize: "a whole number";
    String: "a string";
    PathBuf: "a path";
}

/// The items of a sequence or an array. Text and bytes are none of numbers or names, and neither sets nor dicts have an
/// order.
pub fn items<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyIterator>> {
    let is_text = given.is_instance_of::<PyString>() || given.is_instance_of::<PyBytes>();
    let is_bytes = is_text || given.is_instance_of::<PyByteArray>() || given.is_instance_of::<PyMemoryView>();
    let is_set = given.is_instance_of::<PySet>() || given.is_instance_of::<PyFrozenSet>();
    if is_bytes || is_set || given.is_instance_of::<PyDict>() {
        return Err(PyTypeError::new_err("no sequence"));
    }
    given.try_iter()
}

/// A number of a sequence.
pub fn number(given: &Bound<'_, PyAny>) -> PyResult<f64> {
    if is_complex(given) { Err(PyTypeError::new_err("no real number")) } else { given.extract() }
}

/// True of complex numbers, of Python or numpy: these would be read as their real part.
fn is_complex(given: &Bound<'_, PyAny>) -> bool {
    let kind =
        || given.getattr("dtype").and_then(|dtype| dtype.getattr("kind")).and_then(|kind| kind.extract::<char>());
    given.is_instance_of::<PyComplex>() || kind().is_ok_and(|kind| kind == 'c')
}

/// An argument that has to be there.
pub fn required<T: Argument>(name: &str, given: &Bound<'_, PyAny>) -> PyResult<T> {
    if is_complex(given) {
        return Err(wrong_type(name, &T::expected(), given));
    }
    given.extract::<T>().map_err(|error| refused(name, &T::expected(), given, error.into()))
}

/// An argument that may be left out.
pub fn optional<T: Argument>(name: &str, given: Given<'_, '_>) -> PyResult<Option<T>> {
    given.filter(|given| !given.is_none()).map(|given| required(name, given)).transpose()
}

/// A number that may be left out, within a range. `what`: its unit, or what it is.
pub fn within<T: Argument + PartialOrd + Display>(
    name: &str,
    given: Given<'_, '_>,
    what: &str,
    range: RangeInclusive<T>,
) -> PyResult<Option<T>> {
    let number = optional::<T>(name, given)?;
    match number.as_ref().filter(|number| !range.contains(number)) {
        Some(found) => {
            let (least, most) = (range.start(), range.end());
            Err(PyValueError::new_err(format!("{name}: expected {what} from {least} to {most}, found {found}")))
        }
        None => Ok(number),
    }
}

/// The value of a name in a table; the name may be left out.
pub fn one_of<T: Copy>(name: &str, given: Given<'_, '_>, table: &[(&str, T)]) -> PyResult<Option<T>> {
    let wanted = optional::<String>(name, given)?.map(|wanted| name::find(name, table, &wanted));
    wanted.transpose().map_err(PyValueError::new_err)
}

/// Exception for a refused value, with a message that names the argument.
fn refused(name: &str, expected: &str, given: &Bound<'_, PyAny>, error: PyErr) -> PyErr {
    let py = given.py();
    let message = || format!("{name}: expected {expected}, found {}", found(given));
    if error.is_instance_of::<PyTypeError>(py) {
        PyTypeError::new_err(message())
    } else if error.is_instance_of::<PyOverflowError>(py) {
        PyOverflowError::new_err(message())
    } else if error.is_instance_of::<PyValueError>(py) {
        // These are ours, and say more.
        PyValueError::new_err(format!("{name}: {}", error.value(py)))
    } else {
        // Of the value's own code, or of the keyboard.
        error
    }
}

/// An argument of a wrong type.
pub fn wrong_type(name: &str, expected: &str, given: &Bound<'_, PyAny>) -> PyErr {
    PyTypeError::new_err(format!("{name}: expected {expected}, found {}", found(given)))
}

/// A wrong value as a message shows it.
pub fn found(given: &Bound<'_, PyAny>) -> String {
    let kind = given.get_type().name().map_or_else(|_| "something".to_owned(), |name| name.to_string());
    if let Ok(shape) = given.getattr("shape")
        && shape.cast::<PyTuple>().is_ok_and(|shape| !shape.is_empty())
    {
        return format!("{kind} of shape {shape}");
    }
    let Ok(shown) = given.repr() else { return kind };
    let shown = shown.to_string_lossy().replace('\n', " ");
    if shown.chars().count() <= MOST_SHOWN {
        return shown;
    }
    shown.chars().take(MOST_SHOWN).chain("…".chars()).collect()
}

/// The bytes of a ``bytes``, ``bytearray`` or ``memoryview``.
pub struct Bytes(pub Vec<u8>);

impl<'a, 'py> FromPyObject<'a, 'py> for Bytes {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(bytes) = given.cast::<PyBytes>() {
            return Ok(Self(bytes.as_bytes().to_vec()));
        }
        let kind = given.get_type().name()?.to_string();
        if ["bytearray", "memoryview"].contains(&kind.as_str()) {
            let bytes = given.py().get_type::<PyBytes>().call1((&*given,))?;
            return Ok(Self(bytes.cast::<PyBytes>()?.as_bytes().to_vec()));
        }
        Err(PyTypeError::new_err("no bytes"))
    }
}

argument! { Bytes: "bytes, as Sim.snapshot gives them"; }

/// Numbers in a sequence or an array of one axis, finite ones.
pub struct Row(pub Vec<f64>);

impl<'a, 'py> FromPyObject<'a, 'py> for Row {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let numbers: Vec<f64> = items(&given)?.map(|item| number(&item?)).collect::<PyResult<_>>()?;
        match numbers.iter().find(|number| !number.is_finite()) {
            Some(number) => Err(PyValueError::new_err(format!("expected finite numbers, found {number}"))),
            None => Ok(Self(numbers)),
        }
    }
}

argument! { Row: "a list of numbers"; }

/// One name, or several.
pub enum Names {
    One(String),
    Several(Vec<String>),
}

impl Names {
    /// Whichever they are.
    pub fn all(self) -> Vec<String> {
        match self {
            Self::One(name) => vec![name],
            Self::Several(names) => names,
        }
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Names {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        match given.extract::<String>() {
            Ok(name) => Ok(Self::One(name)),
            Err(_) => Ok(Self::Several(given.try_iter()?.map(|item| item?.extract()).collect::<PyResult<_>>()?)),
        }
    }
}

argument! { Names: "a string, or a list of strings"; }

/// A finite number.
pub fn finite(name: &str, number: f64) -> PyResult<f64> {
    if number.is_finite() {
        return Ok(number);
    }
    Err(PyValueError::new_err(format!("{name}: expected a finite number, found {number}")))
}

/// Keyword arguments that are taken out one by one.
pub struct Keywords<'a, 'py> {
    given: Option<&'a Bound<'py, PyDict>>,
    known: Vec<String>,
    /// The argument that they are values of, with a colon; empty where they are those of a call.
    of: String,
}

impl<'a, 'py> Keywords<'a, 'py> {
    pub fn new(given: Option<&'a Bound<'py, PyDict>>) -> Self {
        Self { given, known: Vec::new(), of: String::new() }
    }

    /// The values of an argument that is a dictionary.
    pub fn of(name: &str, given: &'a Bound<'py, PyDict>) -> Self {
        Self { of: format!("{name}: "), ..Self::new(Some(given)) }
    }

    /// Reads a value unconverted.
    pub fn get(&mut self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.known.push(name.to_owned());
        let found = self.given.map(|given| given.get_item(name)).transpose()?.flatten();
        Ok(found.filter(|value| !value.is_none()))
    }

    pub fn take<T: Argument>(&mut self, name: &str) -> PyResult<Option<T>> {
        self.get(name)?.map(|value| required(name, &value)).transpose()
    }

    /// Nothing is left that has no meaning.
    pub fn finish(self) -> PyResult<()> {
        for name in self.given.into_iter().flat_map(|given| given.keys()) {
            let name: String =
                name.extract().map_err(|_| wrong_type(&format!("{}names", self.of), "strings", &name))?;
            let known: Vec<&str> = self.known.iter().map(String::as_str).collect();
            if !known.contains(&name.as_str()) {
                let synonym = SYNONYMS.iter().find(|(other, own)| *other == name && known.contains(own));
                let hint = synonym.map(|(_, own)| *own).or_else(|| name::nearest(&known, &name));
                let hint = hint.map_or(String::new(), |near| format!(" (did you mean {near:?}?)"));
                let (of, known) = (&self.of, known.join(", "));
                let message = format!("{of}unexpected argument {name:?}{hint}; expected one of: {known}");
                return Err(PyTypeError::new_err(message));
            }
        }
        Ok(())
    }
}
