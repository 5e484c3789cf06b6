//! Stands in for logs where the program is built without the feature `mcap`: none can be begun.

use super::checks::unfit;
use super::ros::{Encoded, Message};
use std::convert::Infallible;
use std::io::{Read, Result, Write};
use std::marker::PhantomData;

/// A log, of which there is none.
pub struct Log<W: Write> {
    none: Infallible,
    to: PhantomData<W>,
}

impl<W: Write> Log<W> {
    /// Refuses.
    ///
    /// # Errors
    /// Always.
    pub fn new(_to: W) -> Result<Self> {
        Err(unfit("MCAP: not built in; needs the feature \"mcap\""))
    }

    /// Appends a message.
    ///
    /// # Errors
    /// None, as there is no log.
    pub fn write<M: Message>(&mut self, _topic: &str, _nanoseconds: u64, _message: &M) -> Result<()> {
        match self.none {}
    }

    /// Appends a message that is encoded.
    ///
    /// # Errors
    /// None, as there is no log.
    pub fn write_encoded(&mut self, _topic: &str, _nanoseconds: u64, _message: &Encoded) -> Result<()> {
        match self.none {}
    }

    /// Appends the messages of another log.
    ///
    /// # Errors
    /// None, as there is no log.
    pub fn append_all(&mut self, _from: impl Read) -> Result<()> {
        match self.none {}
    }

    /// Ends the file.
    ///
    /// # Errors
    /// None, as there is no log.
    pub fn finish(self) -> Result<W> {
        match self.none {}
    }
}
