//! Touches as messages of a robot: JSON, with the fields of ROS's `tactile_msgs` and `geometry_msgs`.
//!
//! | topic | schema | holds |
//! |---|---|---|
//! | `/touch/contacts` | `tactile_msgs/TactileContacts` | all touches: place, normal, wrench in the link's frame, covariances |
//! | `/touch/wrench` | `geometry_msgs/WrenchStamped` | the hardest, in a frame at the contact whose z points outwards |
//! | `/tf` | `foxglove.FrameTransform` | that frame on the link |

use std::time::{SystemTime, UNIX_EPOCH};

use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};

use crate::inference::Contact;
use crate::live::LiveUpdate;

/// The frame at the hardest touch.
const FRAME: &str = "contact";

/// How far the board's clock may leave that of the machine while touches are looked at as they come (ns).
const APART_NS: u64 = 500_000_000;

/// What makes messages of touches. Their time is the board's, from the moment of this machine at which it began; where its
/// clock begins anew, so does that, and no message is earlier than the one before.
pub struct TouchMessages {
    /// The frame that places are in.
    link: String,
    /// Whether samples come as they are read, so that their time is now.
    is_live: bool,
    /// When the first was, where nothing else tells (nanoseconds since 1970).
    began_ns: Option<u64>,
    /// Nanoseconds since 1970 at a time of the board's clock (µs).
    anchor: Option<(u64, u64)>,
    last_us: u64,
    last_ns: u64,
}

/// The messages of one sample.
pub struct MessagesAt {
    /// Nanoseconds since 1970.
    pub at_ns: u64,
    /// With the number of the topic that each is of.
    pub messages: Vec<(usize, Value)>,
}

impl TouchMessages {
    /// `link` is the frame that places are in.
    #[must_use]
    pub fn new(link: &str, is_live: bool) -> Self {
        Self {
            link: link.to_owned(),
            is_live,
            began_ns: None,
            anchor: None,
            last_us: 0,
            last_ns: 0,
        }
    }

    /// Of a recording: when it began (ns since 1970), where nothing in it tells.
    #[cfg(feature = "mcap")]
    pub fn began(&mut self, began_ns: u64) {
        self.began_ns = Some(began_ns);
    }

    /// What the machine's clock said at a time of the board's (ns since 1970, µs), as a recording tells.
    #[cfg(feature = "mcap")]
    pub fn clock(&mut self, unix_ns: u64, time_us: u64) {
        // A clock that was set back does not hold those up that follow.
        self.anchor = Some((unix_ns.max(self.last_ns), time_us));
        self.last_us = time_us;
    }

    /// When a sample was read (ns since 1970), by what this machine's clock says as it comes.
    fn at(&mut self, time_us: u64, now_ns: u64) -> u64 {
        let began_anew = time_us < self.last_us;
        let (wall, first) = *self.anchor.get_or_insert((now_ns, time_us));
        let by_board = wall.saturating_add(time_us.saturating_sub(first).saturating_mul(1000));
        let apart = self.is_live && by_board.abs_diff(now_ns) > APART_NS;
        let at = if began_anew || apart {
            let from = if self.is_live { now_ns } else { self.last_ns };
            self.anchor = Some((from, time_us));
            from
        } else {
            by_board
        };
        self.last_us = time_us;
        self.last_ns = self.last_ns.max(at);
        self.last_ns
    }

    /// That nothing touches any more, as far as anybody knows.
    #[cfg(feature = "foxglove")]
    pub fn none(&mut self) -> MessagesAt {
        self.last_ns = self.last_ns.max(now_ns());
        MessagesAt {
            at_ns: self.last_ns,
            messages: vec![(0, json!({ "contacts": [] }))],
        }
    }

    /// What touches at a sample.
    pub fn of(&mut self, update: &LiveUpdate) -> MessagesAt {
        let now = self.began_ns.unwrap_or_else(now_ns);
        let at_ns = self.at(update.time_us, now);
        let none = Vec::new();
        let touches = update.touches.as_ref().map_or(&none, |t| &t.contacts);
        let contacts: Vec<Value> = (1..)
            .zip(touches)
            .map(|(k, contact)| tactile(k, contact, &self.link, at_ns))
            .collect();
        let mut messages = vec![(0, json!({ "contacts": contacts }))];
        if let Some(contact) = touches.first().or(update.contact.as_ref()) {
            let turn = frame(contact);
            messages.push((1, wrench(contact, &turn, at_ns)));
            messages.push((2, transform(contact, &turn, &self.link, at_ns)));
        }
        MessagesAt { at_ns, messages }
    }
}

fn now_ns() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.map_or(0, |d| d.as_nanos() as u64)
}

fn stamp(ns: u64, fraction: &str) -> Value {
    json!({ "sec": ns / 1_000_000_000, fraction: ns % 1_000_000_000 })
}

fn three(v: DVec3) -> Value {
    json!({ "x": v.x, "y": v.y, "z": v.z })
}

/// Axes of the frame at a contact: z outwards.
fn frame(contact: &Contact) -> DMat3 {
    let z = contact.normal;
    let x = z.any_orthonormal_vector();
    DMat3::from_cols(x, z.cross(x), z)
}

fn tactile(number: usize, contact: &Contact, link: &str, at: u64) -> Value {
    /// Half-axes of a region are of nine in ten: these deviations of a normal distribution in the plane.
    const DEVIATIONS: f64 = 2.145_966;
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    let [a, b] = contact.region.axes.map(|axis| outer(axis / DEVIATIONS));
    let n = outer(contact.normal);
    let along = (DMat3::IDENTITY - n) * contact.drag_deviation.powi(2);
    let force = along + n * contact.force_deviation.powi(2);
    json!({
        "name": format!("touch {number}"),
        "header": { "stamp": stamp(at, "nanosec"), "frame_id": link },
        "position": three(contact.position),
        "normal": three(contact.normal),
        "wrench": { "force": three(contact.on_part()), "torque": three(DVec3::ZERO) },
        "position_covariance": (a + b).to_cols_array(),
        "force_covariance": force.to_cols_array(),
    })
}

fn wrench(contact: &Contact, turn: &DMat3, at: u64) -> Value {
    json!({
        "header": { "stamp": stamp(at, "nanosec"), "frame_id": FRAME },
        "wrench": { "force": three(turn.transpose() * contact.on_part()), "torque": three(DVec3::ZERO) },
    })
}

fn transform(contact: &Contact, turn: &DMat3, link: &str, at: u64) -> Value {
    let q = DQuat::from_mat3(turn);
    json!({
        "timestamp": stamp(at, "nsec"),
        "parent_frame_id": link,
        "child_frame_id": FRAME,
        "translation": three(contact.position),
        "rotation": { "x": q.x, "y": q.y, "z": q.z, "w": q.w },
    })
}

/// How many topics there are.
pub(super) const TOPICS: usize = 3;

/// Topics with the names and fields of their messages.
pub(super) fn topics() -> [(&'static str, &'static str, Value); TOPICS] {
    let number = json!({ "type": "number" });
    let text = json!({ "type": "string" });
    let object = |fields: Value| json!({ "type": "object", "properties": fields });
    let three = object(json!({ "x": number, "y": number, "z": number }));
    let time = |fraction: &str| {
        object(json!({ "sec": { "type": "integer" }, fraction: { "type": "integer" } }))
    };
    let header = object(json!({ "stamp": time("nanosec"), "frame_id": text }));
    let wrench = object(json!({ "force": three, "torque": three }));
    let nine = json!({ "type": "array", "items": number });
    let contact = object(json!({
        "name": text, "header": header, "position": three, "normal": three, "wrench": wrench,
        "position_covariance": nine, "force_covariance": nine,
    }));
    let contacts = object(json!({ "contacts": { "type": "array", "items": contact } }));
    let stamped = object(json!({ "header": header, "wrench": wrench }));
    let turn = object(json!({ "x": number, "y": number, "z": number, "w": number }));
    let transform = object(json!({
        "timestamp": time("nsec"), "parent_frame_id": text, "child_frame_id": text,
        "translation": three, "rotation": turn,
    }));
    [
        ("/touch/contacts", "tactile_msgs/TactileContacts", contacts),
        ("/touch/wrench", "geometry_msgs/WrenchStamped", stamped),
        ("/tf", "foxglove.FrameTransform", transform),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn time_is_of_the_machine_and_never_goes_back() {
        let mut live = TouchMessages::new("shin", true);
        // The board counts on; how late samples are read does not show.
        assert_eq!(live.at(5_000_000, 100 * S), 100 * S);
        assert_eq!(live.at(5_001_000, 100 * S + 9_000_000), 100 * S + 1_000_000);
        // It begins anew, or another one is there, which has run for hours.
        assert_eq!(live.at(1_000, 103 * S), 103 * S);
        assert_eq!(live.at(2_000, 103 * S + 1_000_000), 103 * S + 1_000_000);
        assert_eq!(live.at(9_000_000_000, 104 * S), 104 * S);
        // The machine's clock is put back: no message is earlier.
        assert_eq!(live.at(9_001_000_000, 50 * S), 104 * S);
        #[cfg(feature = "foxglove")]
        assert!(live.none().at_ns >= 104 * S);
    }

    #[test]
    fn a_recording_has_its_own_pace() {
        let mut fast = TouchMessages::new("shin", false);
        assert_eq!(fast.at(0, 100 * S), 100 * S);
        assert_eq!(fast.at(60_000_000, 100 * S + 5), 160 * S);
        assert_eq!(fast.at(0, 100 * S + 6), 160 * S);
        assert_eq!(fast.at(1_000_000, 100 * S + 7), 161 * S);
    }
}
