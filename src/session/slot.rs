//! A result, and what it holds for.

/// A value with the inputs that it was computed from: it holds while these are what is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Slot<I, T> {
    pub inputs: I,
    pub value: T,
}

impl<I: PartialEq, T> Slot<I, T> {
    /// Whether it is what these inputs give.
    #[must_use]
    pub fn holds_for(&self, inputs: &I) -> bool {
        self.inputs == *inputs
    }
}

/// The value of a slot, where there is one and it is what these inputs give.
#[must_use]
pub fn current<'s, I: PartialEq, T>(slot: Option<&'s Slot<I, T>>, inputs: &I) -> Option<&'s T> {
    let slot = slot.filter(|slot| slot.holds_for(inputs))?;
    Some(&slot.value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_had_for_its_own_inputs_only() {
        let slot = Slot {
            inputs: (2, "mm"),
            value: 7.0,
        };
        assert_eq!(current(Some(&slot), &(2, "mm")), Some(&7.0));
        assert_eq!(current(Some(&slot), &(3, "mm")), None);
        assert_eq!(current::<(), f64>(None, &()), None);
    }
}
