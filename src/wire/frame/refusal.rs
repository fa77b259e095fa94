//! Why bytes are no message, and what a person can do about it.

use crate::wire::VERSION;

/// Why bytes between two zeros were no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// No COBS, or longer than any frame.
    Framing,
    /// The check sum does not fit.
    Damaged,
    /// Sound, but of no type or length that is known.
    Unknown,
    /// A HELLO of another version of the protocol.
    Version(u8),
    /// A HELLO with a value that nothing can be computed with.
    Value {
        /// Which value.
        name: &'static str,
        /// What it must be.
        rule: &'static str,
        /// What it is.
        found: u32,
    },
    /// Data of another size (bytes) than the HELLO before them announces.
    Size {
        /// Bytes that came.
        found: usize,
        /// Bytes that the HELLO announces.
        announced: usize,
    },
    /// Data before the board has said how many channels and bits they have.
    NoLayout,
    /// It was there already, or came after one that was sent later.
    Repeated,
}

impl Refusal {
    /// Whether it is the board that is wrong, or unknown to us: it will say the same again. What a bad line does
    /// passes, and so do data that came before their HELLO.
    #[must_use]
    pub fn is_lasting(self) -> bool {
        matches!(
            self,
            Self::Version(_) | Self::Value { .. } | Self::Size { .. }
        )
    }

    /// For people, with what to do; nothing for what any line brings now and then.
    #[must_use]
    pub fn in_words(self) -> Option<String> {
        match self {
            Self::Framing | Self::Damaged | Self::Unknown | Self::Repeated => None,
            Self::Version(version) => Some(format!(
                "the board speaks version {version} of the protocol, and this program version {VERSION}: bring the older of the two up to date"
            )),
            Self::Value { name, rule, found } => Some(format!(
                "the board's HELLO cannot be used: {name} must be {rule}, but is {found}. Correct it in the firmware"
            )),
            Self::Size { found, announced } => Some(format!(
                "the board's DATA have {found} bytes, but the channels and bits of its HELLO take {announced}. Correct the one or the other in the firmware"
            )),
            Self::NoLayout => Some(
                "the board sends DATA, but no HELLO that says how many channels and bits they have. It must answer HELLO?"
                    .to_owned(),
            ),
        }
    }
}
