//! What is said while presses are made by hand: by whoever presses, and to them.

use glam::DVec3;

use crate::units;

/// Nobody presses harder (N).
pub const HARDEST_N: f64 = 1e4;

/// What whoever presses may say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandOrder {
    /// How hard this press is (N).
    Force(f64),
    /// As hard as was meant.
    AsMeant,
    /// It is pressed there (m) and not where it was asked for; or there after all.
    Elsewhere(Option<DVec3>),
    /// Leaves this place out for now.
    Skip,
    /// Ends the run; what was pressed is kept.
    Stop,
}

/// What is said, and of which press of the plan: a press may be taken while somebody says something of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressOrder {
    /// The number in the plan; absent where it is said of whichever is next.
    pub number: Option<usize>,
    pub order: HandOrder,
}

impl From<HandOrder> for PressOrder {
    fn from(order: HandOrder) -> Self {
        let number = None;
        Self { number, order }
    }
}

/// What whoever presses is told.
#[derive(Clone, Debug, PartialEq)]
pub enum HandSays {
    /// Where to press next (m): its number in the plan, and that it is the `which`-th of all.
    Press {
        number: usize,
        which: usize,
        all: usize,
        at: DVec3,
    },
    /// It is taken to be pressed there (m), or where it was asked for.
    Moved(Option<DVec3>),
    /// The board says nothing, or its rest is taken anew: nothing is to be pressed.
    Wait,
    /// Where it is said to be pressed (m) there is no wall.
    OffTheWall(DVec3),
    /// It was read, and may be let go.
    LetGo,
    /// It is over, and how hard it was is not known yet.
    HowHard,
    /// It was not taken: it never stood still, or came before there was a rest.
    Unsteady,
    /// A force was written, and no press waits for one.
    NothingWaits,
    /// What was said is of a press that was taken meanwhile.
    TakenAlready,
    /// It is written down: its number in the plan, with its force (N) where no sensor feels that.
    Taken(usize, Option<f64>),
    /// What the board or the connection says.
    Board(String),
}

impl HandSays {
    /// For whoever presses, with the force that is meant (N).
    #[must_use]
    pub fn in_words(&self, meant_n: f64) -> String {
        let place = |at: DVec3| {
            let mm = units::mm(at);
            format!("({:.1}, {:.1}, {:.1}) mm", mm.x, mm.y, mm.z)
        };
        match self {
            Self::Press { which, all, at, .. } => format!(
                "press {which} of {all}: at {} with about {meant_n} N; hold it for a second",
                place(*at)
            ),
            Self::Moved(Some(at)) => format!("this one is at {}", place(*at)),
            Self::Moved(None) => "this one is where it was asked for".into(),
            Self::Wait => "leave the limb alone until the board's rest is taken anew".into(),
            Self::OffTheWall(at) => {
                format!("{} is not on the limb, and was passed over", place(*at))
            }
            Self::Board(text) => text.clone(),
            Self::LetGo => "read: let go".into(),
            Self::HowHard => format!("how hard was it, in N? (Enter: {meant_n})"),
            Self::Unsteady => {
                "it was not taken: leave the limb alone for a moment, then press again and hold it for a second".into()
            }
            Self::NothingWaits => "no press waits for a force".into(),
            Self::TakenAlready => "that press was taken already, and this was not said of the next".into(),
            Self::Taken(_, Some(force)) => format!("taken, with {force} N"),
            Self::Taken(_, None) => "taken".into(),
        }
    }
}
