//! NPY 1.0, numpy's form of an array in a file (`numpy/lib/format.py`, "Format Version 1.0"): six bytes that name the
//! form, its version, and a literal of Python with type, order and shape; then the values.

use super::array::{Array, Column, Values, interleave};
use super::checks::unfit;
use std::io::Result;

/// Bytes before the literal: the name of the form, the version, and the literal's length in two bytes.
const PREFIX: usize = 10;

/// Alignment of the values in bytes, so that they can be mapped into memory.
const ALIGNMENT: usize = 64;

/// A file of an array.
///
/// # Errors
/// More or fewer values than its shape has places.
pub fn encode(array: &Array) -> Result<Vec<u8>> {
    array.check("NPY")?;
    let mut bytes = header(&format!("'{}'", type_name(array.values)), array.shape)?;
    bytes.extend(array.values.to_le_bytes());
    Ok(bytes)
}

/// A file of a structured array of shape `[rows]`, a field for each column, packed (numpy: "structured arrays").
///
/// # Errors
/// A column with more or fewer values than that; a field without a name of its own.
pub fn encode_records(rows: usize, columns: &[Column]) -> Result<Vec<u8>> {
    let mut fields = String::new();
    for (place, Column { name, shape, values }) in columns.iter().enumerate() {
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(unfit(format!("NPY: expected a field name of letters, digits and \"_\", found \"{name}\"")));
        }
        if columns[..place].iter().any(|before| before.name == *name) {
            return Err(unfit(format!("NPY: two fields are named \"{name}\"")));
        }
        let shape = if shape.is_empty() { String::new() } else { format!(", {}", tuple(shape)) };
        fields += &format!("('{name}', '{}'{shape}), ", type_name(*values));
    }
    let mut bytes = header(&format!("[{}]", fields.trim_end_matches(", ")), &[rows])?;
    bytes.extend(interleave(rows, columns)?);
    Ok(bytes)
}

/// Type in the form of numpy's `dtype.str`: order of bytes, kind, bytes of a value.
fn type_name(values: Values) -> &'static str {
    match values {
        Values::U8(_) => "|u1",
        Values::U16(_) => "<u2",
        Values::U32(_) => "<u4",
        Values::I32(_) => "<i4",
        Values::F16(_) => "<f2",
        Values::F32(_) => "<f4",
        Values::F64(_) => "<f8",
    }
}

/// Formats a tuple of Python: one of a single number ends with a comma.
fn tuple(shape: &[usize]) -> String {
    match shape {
        [only] => format!("({only},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn header(descr: &str, shape: &[usize]) -> Result<Vec<u8>> {
    let literal = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {}, }}", tuple(shape));
    // Spaces and a line feed follow on it.
    let length = (PREFIX + literal.len() + 1).next_multiple_of(ALIGNMENT) - PREFIX;
    let said = u16::try_from(length).map_err(|_| unfit("NPY: the fields do not fit into a header of 64 KiB"))?;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(said.to_le_bytes());
    bytes.extend(format!("{literal:<width$}\n", width = length - 1).bytes());
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_its_header_and_its_values() {
        let bytes = encode(&Array::new(&[2, 3], &[1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0][..])).unwrap();
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
        let expected = [b"\x93NUMPY\x01\x00\x76\x00", format!("{header:<117}\n").as_bytes()].concat();
        assert_eq!(expected.len(), 128);
        assert_eq!(&bytes[..128], &expected[..]);
        assert_eq!(&bytes[128..136], &[0, 0, 0x80, 0x3f, 0, 0, 0, 0x40]);
        assert_eq!(bytes.len(), 128 + 24);
    }

    #[test]
    fn shapes_are_pythons_tuples() {
        assert_eq!((tuple(&[]), tuple(&[7]), tuple(&[0, 2])), ("()".into(), "(7,)".into(), "(0, 2)".into()));
    }

    #[test]
    fn records_name_their_fields() {
        let columns = [Column::new("id", &[], &[7_u32][..]), Column::new("uv", &[1, 2], &[1.0_f64, 2.0][..])];
        let bytes = encode_records(1, &columns).unwrap();
        let expected = "{'descr': [('id', '<u4'), ('uv', '<f8', (1, 2))], 'fortran_order': False, 'shape': (1,), }";
        assert_eq!(&bytes[PREFIX..][..expected.len()], expected.as_bytes());
        assert_eq!(bytes.len(), 128 + 20);
    }

    #[test]
    fn what_numpy_could_not_read_is_refused() {
        let refusal = |result: Result<Vec<u8>>| result.unwrap_err().to_string();
        let one = &[1_u8][..];
        assert_eq!(refusal(encode(&Array::new(&[2], one))), "NPY: expected 2 values, found 1");
        let named = |name| Column::new(name, &[], one);
        let error = refusal(encode_records(1, &[named("a'b")]));
        assert_eq!(error, "NPY: expected a field name of letters, digits and \"_\", found \"a'b\"");
        assert_eq!(refusal(encode_records(1, &[named("a"), named("a")])), "NPY: two fields are named \"a\"");
        let long = "a".repeat(70_000);
        assert!(refusal(encode_records(1, &[named(&long)])).contains("64 KiB"));
    }
}
