//! CDR, the bytes of a message in DDS and ROS 2: plain CDR of version 1, little endian (OMG, "DDS-XTypes 1.3", 7.4.1
//! and 7.6.2; "DDSI-RTPS 2.3", 10.2). Numbers lie at multiples of their size, counted from the end of the header.

use super::checks::unfit;
use std::io::Result;

/// Encapsulation header: `CDR_LE`, and two bytes of options, of which there are none.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// A message that is being encoded.
pub struct Encoder {
    bytes: Vec<u8>,
}

/// Numbers of a fixed size.
pub trait Number: Copy {
    /// Appends it to bytes, little endian.
    fn append(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($($type:ty),*) => {
        $(impl Number for $type {
            fn append(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        })*
    };
}

number!(u8, i8, u16, u32, i32, f64);

impl Default for Encoder {
    fn default() -> Self {
        Self { bytes: HEADER.to_vec() }
    }
}

impl Encoder {
    /// A number, after zeros up to a multiple of its size.
    pub fn number<T: Number>(&mut self, value: T) {
        let place = (self.bytes.len() - HEADER.len()).next_multiple_of(size_of::<T>());
        self.bytes.resize(HEADER.len() + place, 0);
        value.append(&mut self.bytes);
    }

    /// A truth value: one byte.
    pub fn bool(&mut self, value: bool) {
        self.number(u8::from(value));
    }

    /// Numbers whose count the type says.
    pub fn array<T: Number>(&mut self, values: &[T]) {
        values.iter().for_each(|value| self.number(*value));
    }

    /// Number of elements that follow.
    ///
    /// # Errors
    /// More than 4 bytes can count.
    pub fn length(&mut self, length: usize) -> Result<()> {
        let said = u32::try_from(length).map_err(|_| unfit(format!("CDR: {length} elements are too many to count")))?;
        self.number(said);
        Ok(())
    }

    /// Bytes, counted.
    ///
    /// # Errors
    /// Those of [`Self::length`].
    pub fn bytes(&mut self, bytes: &[u8]) -> Result<()> {
        self.length(bytes.len())?;
        self.bytes.extend(bytes);
        Ok(())
    }

    /// Text, counted with the zero byte after it.
    ///
    /// # Errors
    /// Those of [`Self::length`]; a zero byte in the text, which would end it.
    pub fn string(&mut self, text: &str) -> Result<()> {
        if text.contains('\0') {
            return Err(unfit(format!("CDR: {text:?} has a zero byte within")));
        }
        self.length(text.len() + 1)?;
        self.bytes.extend(text.bytes());
        self.bytes.push(0);
        Ok(())
    }

    /// Elements, counted.
    ///
    /// # Errors
    /// Those of [`Self::length`], and of the elements.
    pub fn sequence<T>(&mut self, elements: &[T], mut put: impl FnMut(&mut Self, &T) -> Result<()>) -> Result<()> {
        self.length(elements.len())?;
        elements.iter().try_for_each(|element| put(self, element))
    }

    /// The message.
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lie_at_multiples_of_their_size_after_the_header() {
        let mut cdr = Encoder::default();
        cdr.number(1_u8);
        cdr.number(0x0203_u16);
        cdr.bool(true);
        cdr.number(1.0_f64);
        cdr.number(-2_i8);
        cdr.number(-2_i32);
        let expected = [
            &[0, 1, 0, 0][..],
            &[1, 0, 3, 2, 1, 0, 0, 0],
            &[0, 0, 0, 0, 0, 0, 0xf0, 0x3f],
            &[0xfe, 0, 0, 0, 0xfe, 0xff, 0xff, 0xff],
        ];
        assert_eq!(cdr.finish(), expected.concat());
    }

    #[test]
    fn what_is_counted_says_so_and_nothing_is_before_what_is_not_there() {
        let mut cdr = Encoder::default();
        cdr.string("ab").unwrap();
        // No zeros for numbers of eight bytes that are not there.
        cdr.sequence(&[], |cdr, value: &f64| {
            cdr.number(*value);
            Ok(())
        })
        .unwrap();
        cdr.bytes(&[7]).unwrap();
        cdr.sequence(&[1.0], |cdr, value: &f64| {
            cdr.number(*value);
            Ok(())
        })
        .unwrap();
        let expected = [
            &[0, 1, 0, 0][..],
            &[3, 0, 0, 0, b'a', b'b', 0, 0],
            &[0, 0, 0, 0, 1, 0, 0, 0],
            &[7, 0, 0, 0, 1, 0, 0, 0],
            &[0, 0, 0, 0, 0, 0, 0xf0, 0x3f],
        ];
        assert_eq!(cdr.finish(), expected.concat());
    }

    #[test]
    fn text_with_its_own_end_is_refused() {
        let error = Encoder::default().string("a\0b").unwrap_err().to_string();
        assert_eq!(error, "CDR: \"a\\0b\" has a zero byte within");
    }
}
