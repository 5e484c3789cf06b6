//! A message, and its header.

use crate::export::cdr::Encoder;
use std::io::Result;

/// A message that can be sent or logged.
pub trait Message {
    /// Its type, as ROS 2 names it: `sensor_msgs/msg/Image`.
    const TYPE: &'static str;
    /// Its fields in the language of `.msg` files, a line each.
    const FIELDS: &'static str;

    /// Appends its fields in the order of its definition.
    ///
    /// # Errors
    /// A value that its type has no place for.
    fn put(&self, cdr: &mut Encoder) -> Result<()>;

    /// Bytes of it, as it is sent and stored.
    ///
    /// # Errors
    /// Those of [`Self::put`].
    fn encode(&self) -> Result<Vec<u8>> {
        let mut cdr = Encoder::default();
        self.put(&mut cdr)?;
        Ok(cdr.finish())
    }
}

/// The bytes of a message, and its type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Encoded {
    /// [`Message::TYPE`].
    pub message_type: &'static str,
    /// [`Message::FIELDS`].
    pub fields: &'static str,
    /// [`Message::encode`].
    pub bytes: Vec<u8>,
}

impl Encoded {
    /// Encodes a message.
    ///
    /// # Errors
    /// Those of [`Message::put`].
    pub fn of<M: Message>(message: &M) -> Result<Self> {
        Ok(Self { message_type: M::TYPE, fields: M::FIELDS, bytes: message.encode()? })
    }
}

/// Time and frame of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header<'a> {
    /// Nanoseconds of simulation.
    pub nanoseconds: u64,
    /// The name of the frame.
    pub frame: &'a str,
}

impl Header<'_> {
    /// Appends it as `std_msgs/Header`.
    pub(super) fn put(&self, cdr: &mut Encoder) -> Result<()> {
        put_time(cdr, self.nanoseconds);
        cdr.string(self.frame)
    }
}

/// Appends a time as `builtin_interfaces/Time`, which ends after 68 years; what is later has its last second.
pub(super) fn put_time(cdr: &mut Encoder, nanoseconds: u64) {
    const SECOND: u64 = 1_000_000_000;
    cdr.number(i32::try_from(nanoseconds / SECOND).unwrap_or(i32::MAX));
    cdr.number((nanoseconds % SECOND) as u32);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::ros::frames::Clock;

    #[test]
    fn a_time_is_seconds_and_nanoseconds_and_ends() {
        // 500,000,000 is 0x1DCD6500.
        assert_eq!(Clock(1_500_000_000).encode().unwrap(), [0, 1, 0, 0, 1, 0, 0, 0, 0, 0x65, 0xcd, 0x1d]);
        let last = Clock(u64::MAX).encode().unwrap();
        assert_eq!(last[4..8], i32::MAX.to_le_bytes());
    }

    #[test]
    fn a_header_is_its_time_and_its_frame() {
        let mut cdr = Encoder::default();
        Header { nanoseconds: 7, frame: "a" }.put(&mut cdr).unwrap();
        assert_eq!(cdr.finish()[4..], [0, 0, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0, b'a', 0]);
    }
}
