//! What board and studio tell each other.

/// What a board is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hello {
    /// Of the protocol.
    pub version: u8,
    /// Tells boards apart; the same after an unplug.
    pub board: u32,
    /// Channels of a sample, 1–64.
    pub channels: u8,
    /// Of a sample.
    pub bits: u8,
    /// Reference of the converter and supply of the bridges (mV).
    pub reference_mv: u16,
    /// Supply of the bridges (mV).
    pub supply_mv: u16,
    /// Of the amplifiers, in thousandths.
    pub gain_milli: u32,
    /// Frames of data a second.
    pub rate_hz: u16,
    /// For people; as it came.
    pub name: String,
}

/// One thing said on the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WireMessage {
    // From the board.
    /// What the board is.
    Hello(Hello),
    /// Raw counts, a channel each.
    Data(Vec<u32>),
    /// How the board is.
    Status {
        /// Frames that the board could not send in time.
        overruns: u32,
        /// Hundredths of a degree Celsius, where it is known.
        temperature_centi: Option<i16>,
    },
    /// Something that the board says.
    Log {
        /// 0 debug, 1 information, 2 warning, 3 error.
        level: u8,
        /// Its words, as they came.
        text: String,
    },
    /// The answer to the ping of this number.
    Pong(u32),
    // In a recording only.
    /// What the studio did while it recorded.
    Note(String),
    // From the studio.
    /// Say HELLO.
    AskHello,
    /// Send data.
    Start,
    /// Send no more data.
    Stop,
    /// Frames of data a second.
    Rate(u16),
    /// Answer with a PONG of this number.
    Ping(u32),
}
