//! What comes to pass with the rest, for whoever looks on.

/// What a pipeline has to say of its rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum News {
    /// Something moves while the rest is taken.
    Waiting,
    /// The rest was taken under a touch that has let go.
    Released,
}

impl News {
    /// For people, with what to do.
    #[must_use]
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Waiting => {
                "the gauges move: the rest is taken as soon as they are still. Do not touch the limb"
            }
            Self::Released => {
                "the rest was taken while something pressed: it is taken again. Where this comes with every touch, the gauges are wired the wrong way round"
            }
        }
    }
}
