//! A log of ROS 2 messages as an MCAP file (the MCAP specification; its profile `ros2`): what `ros2 bag`, Foxglove and
//! rerun open. Messages are written as a run goes on, into chunks with an index each, and the file's own index at its
//! end. Without the end, readers recover all whole chunks.

use super::checks::unfit;
use super::ros::definitions::definition;
use super::ros::message::{Encoded, Message};
use mcap::io::MessageReader;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::{Read, Result, Write};

/// After so many bytes of messages a chunk ends, and memory holds no more. Always the same, so that files are.
const CHUNK_BYTES: u64 = 1 << 20;

/// A topic, its number in the file, and how many messages it has had.
struct Topic {
    channel: u16,
    message_type: String,
    messages: u32,
}

/// A log that is being written.
pub struct Log<W: Write> {
    writer: mcap::Writer<NoSeek<W>>,
    topics: BTreeMap<String, Topic>,
}

impl<W: Write> Log<W> {
    /// Begins a log.
    ///
    /// # Errors
    /// The error of writing.
    pub fn new(to: W) -> Result<Self> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("relief ", env!("CARGO_PKG_VERSION")))
            .compression(None)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true);
        let writer = options.create(NoSeek::new(to)).map_err(failed)?;
        Ok(Self { writer, topics: BTreeMap::new() })
    }

    /// Appends a message of a topic, measured at a time in nanoseconds.
    ///
    /// # Errors
    /// A field that the message cannot hold; another type than the topic's earlier messages; the error of writing.
    pub fn write<M: Message>(&mut self, topic: &str, nanoseconds: u64, message: &M) -> Result<()> {
        self.write_encoded(topic, nanoseconds, &Encoded::of(message)?)
    }

    /// Does the same with a message that is encoded.
    ///
    /// # Errors
    /// Another type than the topic's earlier messages; the error of writing.
    pub fn write_encoded(&mut self, topic: &str, nanoseconds: u64, message: &Encoded) -> Result<()> {
        let Encoded { message_type, fields, bytes } = message;
        self.append(topic, message_type, || definition(fields).into_bytes(), (nanoseconds, bytes))
    }

    /// Appends the messages of another log, in their order. The logs of the parts of a run, one after another, are that
    /// of the run.
    ///
    /// # Errors
    /// A log `from` that is none, or those of [`Self::write`].
    pub fn append_all(&mut self, from: impl Read) -> Result<()> {
        for message in MessageReader::new(from) {
            let message = message.map_err(failed)?;
            let channel = &message.channel;
            let schema = channel.schema.as_ref().ok_or_else(|| unfit("MCAP: a message has no schema"))?;
            let definition = || schema.data.to_vec();
            self.append(&channel.topic, &schema.name, definition, (message.log_time, &message.data))?;
        }
        Ok(())
    }

    /// Appends an encoded message of a type.
    fn append(
        &mut self,
        topic: &str,
        message_type: &str,
        definition: impl FnOnce() -> Vec<u8>,
        (nanoseconds, data): (u64, &[u8]),
    ) -> Result<()> {
        let topic = self.topic(topic, message_type, definition)?;
        let (channel_id, sequence) = (topic.channel, topic.messages);
        topic.messages = topic.messages.wrapping_add(1);
        let header = MessageHeader { channel_id, sequence, log_time: nanoseconds, publish_time: nanoseconds };
        self.writer.write_to_known_channel(&header, data).map_err(failed)
    }

    fn topic(&mut self, name: &str, message_type: &str, definition: impl FnOnce() -> Vec<u8>) -> Result<&mut Topic> {
        let topic = match self.topics.entry(name.to_owned()) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                let schema = self.writer.add_schema(message_type, "ros2msg", &definition()).map_err(failed)?;
                let channel = self.writer.add_channel(schema, name, "cdr", &BTreeMap::new()).map_err(failed)?;
                new.insert(Topic { channel, message_type: message_type.to_owned(), messages: 0 })
            }
        };
        if topic.message_type == message_type {
            return Ok(topic);
        }
        let earlier = &topic.message_type;
        Err(unfit(format!("MCAP topic {name}: expected a {earlier} like those before, found a {message_type}")))
    }

    /// Writes the index and ends the file. A log that is dropped is ended, too, but nothing tells whether that failed.
    ///
    /// # Errors
    /// The error of writing.
    pub fn finish(mut self) -> Result<W> {
        self.writer.finish().map_err(failed)?;
        let mut to = self.writer.into_inner().into_inner();
        to.flush()?;
        Ok(to)
    }
}

/// Converts an error: that of the operating system, where it is one.
fn failed(error: McapError) -> std::io::Error {
    match error {
        McapError::Io(error) => error,
        other => unfit(format!("MCAP: {other}")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::ros::{Clock, Header, Image, Pixels, TfMessage};
    use super::*;
    use std::cell::Cell;
    use std::rc::Rc;

    #[test]
    fn a_topic_has_messages_of_one_type() {
        let mut log = Log::new(Vec::new()).unwrap();
        log.write("/clock", 5, &Clock(5)).unwrap();
        let error = log.write("/clock", 6, &TfMessage(&[])).unwrap_err().to_string();
        let expected = "expected a rosgraph_msgs/msg/Clock like those before, found a tf2_msgs/msg/TFMessage";
        assert_eq!(error, format!("MCAP topic /clock: {expected}"));
    }

    #[test]
    fn a_log_grows_as_it_is_written() {
        #[derive(Clone, Default)]
        struct Counted(Rc<Cell<u64>>);
        impl Write for Counted {
            fn write(&mut self, bytes: &[u8]) -> Result<usize> {
                self.0.set(self.0.get() + bytes.len() as u64);
                Ok(bytes.len())
            }
            fn flush(&mut self) -> Result<()> {
                Ok(())
            }
        }
        let counted = Counted::default();
        let mut log = Log::new(counted.clone()).unwrap();
        let pixels = vec![0; CHUNK_BYTES as usize];
        let header = Header { nanoseconds: 0, frame: "front" };
        let image = Image { header, size: (1 << 10, 1 << 10), pixels: Pixels::Mono8(&pixels) };
        for time in 0..4 {
            log.write("/image", time, &image).unwrap();
            // All chunks but the last are written.
            assert!(counted.0.get() >= time * CHUNK_BYTES, "{time}");
        }
        log.finish().unwrap();
        assert!(counted.0.get() > 4 * CHUNK_BYTES);
    }

    #[test]
    fn what_writing_fails_with_is_told() {
        struct Full(usize);
        impl Write for Full {
            fn write(&mut self, bytes: &[u8]) -> Result<usize> {
                self.0 = self.0.checked_sub(bytes.len()).ok_or(std::io::ErrorKind::StorageFull)?;
                Ok(bytes.len())
            }
            fn flush(&mut self) -> Result<()> {
                Ok(())
            }
        }
        let mut log = Log::new(Full(200)).unwrap();
        log.write("/clock", 5, &Clock(5)).unwrap();
        assert_eq!(log.finish().map(|_| ()).unwrap_err().kind(), std::io::ErrorKind::StorageFull);
    }
}
