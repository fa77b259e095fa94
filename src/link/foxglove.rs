//! Touches as they come, for Foxglove and whoever else speaks its WebSocket protocol (version 1,
//! <https://github.com/foxglove/ws-protocol>): the messages of [`TouchMessages`], each topic for those who ask for it.
//!
//! It has a thread of its own, on which nothing waits for anybody: whoever does not read misses messages, and is let go
//! after a while, and whoever listens to the board is not held up.

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::json;
use tungstenite::handshake::HandshakeError;
use tungstenite::handshake::MidHandshake;
use tungstenite::handshake::server::{ErrorResponse, Request, Response, ServerHandshake};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket, accept_hdr_with_config};

use super::touch_messages::{MessagesAt, TOPICS, TouchMessages, topics};
use crate::live::LiveUpdate;

/// Names of the protocol; the newer program asks for the first. The messages used here are the same.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
const HEADER: &str = "sec-websocket-protocol";
/// How long somebody may take to ask for it.
const HELLO: Duration = Duration::from_secs(5);
/// How long somebody may read nothing of what waits for them.
const BEHIND: Duration = Duration::from_secs(10);
/// How often it is looked whether somebody came or said something.
const LOOK: Duration = Duration::from_millis(10);
/// Samples that may wait for the thread: beyond, the newest are left out.
const SAMPLES: usize = 1024;
/// Connections at once.
const MOST: usize = 32;
/// Most that waits for one who does not read (bytes), and the longest that they may say.
const WAITING: usize = 1 << 17;
const LONGEST: usize = 1 << 16;
/// What is heard of one at once, so that nobody holds up the rest.
const AT_ONCE: usize = 64;
/// Of a binary message, that it holds data.
const DATA: u8 = 1;

type Choose = fn(&Request, Response) -> Result<Response, ErrorResponse>;
type Greeting = MidHandshake<ServerHandshake<WatchedStream, Choose>>;

/// Serves touches, until it is dropped.
pub struct FoxgloveServer {
    address: Option<SocketAddr>,
    /// What touches at a sample; nothing where nobody knows any more. Closed when it ends.
    samples: Option<SyncSender<Option<LiveUpdate>>>,
    thread: Option<JoinHandle<()>>,
}

/// What its thread looks after.
struct ServerThread {
    listener: TcpListener,
    /// Those who have not said yet what they want.
    coming: Vec<(Instant, Greeting)>,
    viewers: Vec<Viewer>,
    touches: TouchMessages,
}

impl FoxgloveServer {
    /// Serves at `HOST:PORT`; `link` is the frame that places are in.
    ///
    /// # Errors
    /// That nothing can be served there.
    pub fn open(address: &str, link: &str) -> Result<Self, String> {
        let listener = TcpListener::bind(address).and_then(|listener| {
            listener.set_nonblocking(true)?;
            Ok(listener)
        });
        let failed = |e| format!("{address}: nothing can be served there ({e})");
        let listener = listener.map_err(failed)?;
        let at = listener.local_addr().ok();
        let room = ServerThread {
            listener,
            coming: Vec::new(),
            viewers: Vec::new(),
            touches: TouchMessages::new(link, true),
        };
        let (samples, inbox) = sync_channel(SAMPLES);
        let thread = std::thread::Builder::new().name("foxglove".into());
        let thread = thread.spawn(move || room.serve(&inbox)).map_err(failed)?;
        Ok(Self {
            address: at,
            samples: Some(samples),
            thread: Some(thread),
        })
    }

    /// Where it serves.
    #[must_use]
    pub fn address(&self) -> Option<SocketAddr> {
        self.address
    }

    /// Sends what touches at a sample to those who ask for it.
    pub fn sample(&self, update: &LiveUpdate) {
        self.hand_over(Some(update.clone()));
    }

    /// Says that nothing is known to touch any more: the board is gone.
    pub fn let_go(&self) {
        self.hand_over(None);
    }

    fn hand_over(&self, sample: Option<LiveUpdate>) {
        if let Some(samples) = &self.samples {
            // Where it is full, the thread has no time: what it has comes first.
            let _ = samples.try_send(sample);
        }
    }
}

impl Drop for FoxgloveServer {
    fn drop(&mut self) {
        // The port is free again when this is over.
        self.samples = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl ServerThread {
    fn serve(mut self, inbox: &Receiver<Option<LiveUpdate>>) {
        let mut looked = Instant::now();
        loop {
            match inbox.recv_timeout(LOOK) {
                Ok(sample) => {
                    let now = match &sample {
                        Some(update) => self.touches.of(update),
                        None => self.touches.none(),
                    };
                    self.viewers.retain_mut(|viewer| viewer.tell(&now));
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            if looked.elapsed() >= LOOK {
                looked = Instant::now();
                self.turn();
            }
        }
    }

    /// Lets in who comes, hears what they ask for, and sends what waits.
    fn turn(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            if self.coming.len() + self.viewers.len() < MOST {
                self.greet(stream);
            }
        }
        for (since, hello) in std::mem::take(&mut self.coming) {
            if since.elapsed() < HELLO {
                self.enter(since, hello.handshake());
            }
        }
        self.viewers.retain_mut(Viewer::turn);
    }

    fn greet(&mut self, stream: TcpStream) {
        // Small messages, each of which is wanted at once.
        let _ = stream.set_nodelay(true);
        if stream.set_nonblocking(true).is_ok() {
            let config = WebSocketConfig::default()
                .write_buffer_size(0)
                .max_write_buffer_size(WAITING)
                .max_message_size(Some(LONGEST))
                .max_frame_size(Some(LONGEST));
            let stream = WatchedStream {
                stream,
                moved: Instant::now(),
            };
            let asked = accept_hdr_with_config(stream, choose as Choose, Some(config));
            self.enter(Instant::now(), asked);
        }
    }

    fn enter(
        &mut self,
        since: Instant,
        asked: Result<
            WebSocket<WatchedStream>,
            HandshakeError<ServerHandshake<WatchedStream, Choose>>,
        >,
    ) {
        match asked {
            Ok(socket) => self.viewers.extend(Viewer::new(socket)),
            Err(HandshakeError::Interrupted(hello)) => self.coming.push((since, hello)),
            // It was told what is wrong.
            Err(HandshakeError::Failure(_)) => {}
        }
    }
}

/// A connection, and when bytes went into it last.
struct WatchedStream {
    stream: TcpStream,
    moved: Instant,
}

impl Read for WatchedStream {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl Write for WatchedStream {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.stream.write(bytes)?;
        if written > 0 {
            self.moved = Instant::now();
        }
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.stream.flush()
    }
}

/// Takes the first protocol that is known here.
#[allow(
    clippy::result_large_err,
    reason = "what the library asks for, once a connection"
)]
fn choose(request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let offered = request.headers().get_all(HEADER).iter();
    let words = offered.filter_map(|offer| offer.to_str().ok());
    let mut names = words.flat_map(|offer| offer.split(',')).map(str::trim);
    let known = names.find_map(|name| PROTOCOLS.into_iter().find(|known| *known == name));
    let Some(known) = known else {
        let words = format!("this speaks {}", PROTOCOLS.join(" and "));
        let mut refused = ErrorResponse::new(Some(words));
        *refused.status_mut() = StatusCode::BAD_REQUEST;
        return Err(refused);
    };
    let headers = response.headers_mut();
    headers.insert(HEADER, HeaderValue::from_static(known));
    Ok(response)
}

/// What a client says.
#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
enum Asked {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
    /// What is not offered here.
    #[serde(other)]
    Other,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: usize,
}

/// Somebody who looks.
struct Viewer {
    socket: WebSocket<WatchedStream>,
    /// The topics asked for, by the number that they are asked for by.
    topics: BTreeMap<u32, usize>,
}

impl Viewer {
    /// Tells somebody who has just come what there is.
    fn new(socket: WebSocket<WatchedStream>) -> Option<Self> {
        let mut viewer = Self {
            socket,
            topics: BTreeMap::new(),
        };
        let channels: Vec<_> = (0..)
            .zip(topics())
            .map(|(id, (topic, schema, fields))| {
                json!({
                    "id": id, "topic": topic, "encoding": "json", "schemaName": schema,
                    "schema": fields.to_string(), "schemaEncoding": "jsonschema",
                })
            })
            .collect();
        let info = json!({ "op": "serverInfo", "name": "HapDef Studio", "capabilities": [] });
        let advertise = json!({ "op": "advertise", "channels": channels });
        let there = [info, advertise].iter().all(|said| viewer.say(said));
        there.then_some(viewer)
    }

    fn say(&mut self, said: &serde_json::Value) -> bool {
        let sent = self.socket.send(Message::text(said.to_string()));
        self.is_there(sent)
    }

    /// Whether it is still there after something was sent.
    fn is_there(&mut self, sent: Result<(), Error>) -> bool {
        match sent {
            Ok(()) => true,
            Err(Error::WriteBufferFull(_)) => self.socket.get_ref().moved.elapsed() < BEHIND,
            Err(e) if waits(&e) => self.socket.get_ref().moved.elapsed() < BEHIND,
            Err(_) => false,
        }
    }

    /// Hears what is asked for and sends what waits; whether it is still there.
    fn turn(&mut self) -> bool {
        for _ in 0..AT_ONCE {
            match self.socket.read() {
                Ok(Message::Text(text)) => {
                    if !self.hear(text.as_str()) {
                        return false;
                    }
                }
                Ok(_) => {}
                Err(e) if waits(&e) => break,
                Err(_) => return false,
            }
        }
        let sent = self.socket.flush();
        self.is_there(sent)
    }

    fn hear(&mut self, text: &str) -> bool {
        let refused = |why: String| json!({ "op": "status", "level": 2, "message": why });
        match serde_json::from_str(text) {
            Ok(Asked::Subscribe { subscriptions }) => {
                for Subscription { id, channel_id } in subscriptions.into_iter().take(MOST) {
                    if channel_id >= TOPICS {
                        let why = format!("there is no channel {channel_id}");
                        if !self.say(&refused(why)) {
                            return false;
                        }
                    } else if self.topics.len() < MOST {
                        self.topics.insert(id, channel_id);
                    }
                }
                true
            }
            Ok(Asked::Unsubscribe { subscription_ids }) => {
                self.topics.retain(|id, _| !subscription_ids.contains(id));
                true
            }
            Ok(Asked::Other) => true,
            Err(e) => self.say(&refused(format!("it is not understood: {e}"))),
        }
    }

    /// Sends what was asked for of a sample; whether it is still there.
    fn tell(&mut self, now: &MessagesAt) -> bool {
        for (topic, message) in &now.messages {
            let asked: Vec<u32> = (self.topics.iter())
                .filter_map(|(id, of)| (of == topic).then_some(*id))
                .collect();
            let text = if asked.is_empty() {
                String::new()
            } else {
                message.to_string()
            };
            for id in asked {
                let mut bytes = vec![DATA];
                bytes.extend(id.to_le_bytes());
                bytes.extend(now.at_ns.to_le_bytes());
                bytes.extend(text.as_bytes());
                let sent = self.socket.send(Message::binary(bytes));
                if !self.is_there(sent) {
                    return false;
                }
            }
        }
        true
    }
}

/// Whether there is only nothing to be read or no room to write into just now.
fn waits(error: &Error) -> bool {
    matches!(error, Error::Io(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted))
}
