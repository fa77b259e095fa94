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

/// Puts what has come in the place of what was known. What comes too late, of other inputs than those of now, takes the
/// place of nothing that holds.
pub fn take_in<I: PartialEq, T>(known: &mut Option<Slot<I, T>>, come: Slot<I, T>, now: Option<&I>) {
    let holds = |slot: &Slot<I, T>| now.is_some_and(|now| slot.holds_for(now));
    if holds(&come) || !known.as_ref().is_some_and(holds) {
        *known = Some(come);
    }
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

    #[test]
    fn what_comes_too_late_takes_the_place_of_nothing_that_holds() {
        let of = |inputs: u8| Slot {
            inputs,
            value: f64::from(inputs),
        };
        let mut known = None;
        take_in(&mut known, of(1), Some(&2));
        assert_eq!(known, Some(of(1)), "better than nothing");
        take_in(&mut known, of(2), Some(&2));
        take_in(&mut known, of(1), Some(&2));
        assert_eq!(known, Some(of(2)), "the first is of what was before");
        take_in(&mut known, of(1), Some(&1));
        assert_eq!(known, Some(of(1)));
        take_in(&mut known, of(3), None);
        assert_eq!(known, Some(of(3)), "nothing is asked for now");
    }
}
