//! Touches as an MCAP file, for Foxglove and other readers of robots' recordings: the messages of [`TouchMessages`].

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};

use super::SessionEvent;
use super::touch_messages::{MessagesAt, TOPICS, TouchMessages, topics};
use crate::live::LiveUpdate;

/// A file that is being written.
pub struct McapLog {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    channels: [u16; TOPICS],
    sequence: u32,
    touches: TouchMessages,
}

impl McapLog {
    /// Begins a file, never over an older one; `link` is the frame that places are in.
    ///
    /// # Errors
    /// A message naming the file.
    pub fn create(path: &Path, link: &str) -> Result<Self, String> {
        let file = File::create_new(path).map_err(|e| {
            if e.kind() == std::io::ErrorKind::AlreadyExists {
                let why = "it exists, and is not written over. Choose another name";
                format!("{}: {why}", path.display())
            } else {
                format!("{}: {e}", path.display())
            }
        })?;
        Self::begin(path, file, link)
    }

    /// Begins a file in place of an older one.
    ///
    /// # Errors
    /// A message naming the file.
    pub fn replace(path: &Path, link: &str) -> Result<Self, String> {
        let file = File::create(path).map_err(|e| format!("{}: {e}", path.display()))?;
        Self::begin(path, file, link)
    }

    fn begin(path: &Path, file: File, link: &str) -> Result<Self, String> {
        let failed = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let options = WriteOptions::new().compression(None).library("hapdef");
        let writer = options.create(BufWriter::new(file));
        let mut writer = writer.map_err(|e| failed(&e))?;
        let mut channels = [0; TOPICS];
        for (channel, (topic, schema, fields)) in channels.iter_mut().zip(topics()) {
            let data = fields.to_string();
            let id = writer.add_schema(schema, "jsonschema", data.as_bytes());
            let id = id.map_err(|e| failed(&e))?;
            let added = writer.add_channel(id, topic, "json", &BTreeMap::new());
            *channel = added.map_err(|e| failed(&e))?;
        }
        Ok(Self {
            path: path.to_owned(),
            writer,
            channels,
            sequence: 0,
            touches: TouchMessages::new(link, false),
        })
    }

    /// Of a recording: when it began (ns since 1970), where nothing in it tells.
    pub fn began(&mut self, began_ns: u64) {
        self.touches.began(began_ns);
    }

    /// Writes what an event of a connection tells of touches.
    ///
    /// # Errors
    /// Why it can be written no more.
    pub fn event(&mut self, event: &SessionEvent) -> Result<(), String> {
        match event {
            SessionEvent::Clock { unix_us, time_us } => {
                self.touches.clock(unix_us.saturating_mul(1000), *time_us);
            }
            SessionEvent::Sample { update, .. } => self.sample(update)?,
            _ => {}
        }
        Ok(())
    }

    /// Writes what touches at a sample.
    ///
    /// # Errors
    /// Why it can be written no more.
    pub fn sample(&mut self, update: &LiveUpdate) -> Result<(), String> {
        let MessagesAt { at_ns, messages } = self.touches.of(update);
        for (channel, message) in messages {
            self.sequence = self.sequence.wrapping_add(1);
            let header = MessageHeader {
                channel_id: self.channels[channel],
                sequence: self.sequence,
                log_time: at_ns,
                publish_time: at_ns,
            };
            let bytes = message.to_string();
            let written = self
                .writer
                .write_to_known_channel(&header, bytes.as_bytes());
            written.map_err(|e| ended(&self.path, e))?;
        }
        Ok(())
    }

    /// Writes its index: without it a file is read more slowly.
    ///
    /// # Errors
    /// Why it can be written no more.
    pub fn finish(&mut self) -> Result<(), String> {
        let finished = self.writer.finish();
        finished.map(drop).map_err(|e| ended(&self.path, e))
    }
}

/// That a file ends here, and why: the library's own words leave out what the system said.
fn ended(path: &Path, error: McapError) -> String {
    let why = match error {
        McapError::Io(error) => error.to_string(),
        error => error.to_string(),
    };
    format!(
        "{}: it ends here, because it can be written no more: {why}",
        path.display()
    )
}
