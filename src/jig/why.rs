//! Why a jig leaves a gauge out.

/// What keeps an arm from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Why {
    /// The wall leans so far (degrees) from the way that a pad moves in.
    Leans(f64),
    /// It is so near to the rod (mm) that no arm fits between.
    Near(f64),
    /// The rod itself meets the part before it is there.
    Rod,
    /// Its ring or arm meets the part on the way in.
    Arm,
    /// Its pad meets the part on the way in, drawn back by as much as it can be (mm).
    Pad(f64),
}

impl Why {
    /// The end of a sentence that begins with the gauge.
    #[must_use]
    pub fn words(&self) -> String {
        match self {
            Self::Leans(degrees) => format!(
                "its wall leans {degrees:.0}° away from a pad that is pressed out from a rod; 45° is the most"
            ),
            Self::Near(distance) => {
                format!("it is {distance:.0} mm from the rod, too near for an arm between them")
            }
            Self::Rod => "the part is in the way of a straight rod to its height".to_owned(),
            Self::Arm => "the part is in the way of its arm on a straight way in".to_owned(),
            Self::Pad(back) => format!(
                "its pad does not pass the part on a straight way in, drawn back by {back:.1} mm, as far as it can be"
            ),
        }
    }
}

/// A gauge that no arm reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOutGauge {
    /// Its number.
    pub number: usize,
    /// What keeps an arm from it, on a rod in the middle.
    pub why: Why,
}
