//! What board and studio tell each other.

/// What a board is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hello {
    pub version: u8,
    /// Tells boards apart; the same after an unplug.
    pub board: u32,
    pub channels: u8,
    /// Of a sample.
    pub bits: u8,
    /// Reference of the converter and supply of the bridges (mV).
    pub reference_mv: u16,
    pub supply_mv: u16,
    /// Of the amplifiers, in thousandths.
    pub gain_milli: u32,
    /// Frames of data a second.
    pub rate_hz: u16,
    pub name: String,
}

/// One thing said on the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Message {
    // From the board.
    Hello(Hello),
    /// Raw counts, a channel each.
    Data(Vec<u32>),
    Status {
        /// Frames that the board could not send in time.
        overruns: u32,
        /// Hundredths of a degree Celsius, where it is known.
        temperature_centi: Option<i16>,
    },
    Log {
        level: u8,
        text: String,
    },
    Pong(u32),
    // In a recording only.
    /// What the studio did while it recorded.
    Note(String),
    // From the studio.
    AskHello,
    Start,
    Stop,
    /// Frames of data a second.
    Rate(u16),
    Ping(u32),
}
