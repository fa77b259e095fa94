//! Which touches of a dataset more is known of.

/// Some touches of a dataset, rising, and where each of them stands among them: asked for every site and touch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    touches: Vec<usize>,
    /// Of each touch up to the last one, one more than its column; 0 where it is not among them.
    numbers: Vec<u32>,
}

impl Columns {
    /// Of touches that rise.
    #[must_use]
    pub fn new(touches: Vec<usize>) -> Self {
        let mut numbers = vec![0; touches.last().map_or(0, |last| last + 1)];
        for (number, &touch) in (1..).zip(&touches) {
            numbers[touch] = number;
        }
        Self { touches, numbers }
    }

    /// The touches, column by column.
    #[must_use]
    pub fn touches(&self) -> &[usize] {
        &self.touches
    }

    /// How many there are.
    #[must_use]
    #[allow(clippy::len_without_is_empty, reason = "nobody asks")]
    pub fn len(&self) -> usize {
        self.touches.len()
    }

    /// The column of a touch.
    #[must_use]
    pub fn of(&self, touch: usize) -> Option<usize> {
        let number = *self.numbers.get(touch)?;
        (number as usize).checked_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_touch_has_its_column() {
        let columns = Columns::new(vec![1, 4, 5]);
        let of: Vec<_> = (0..8).map(|touch| columns.of(touch)).collect();
        assert_eq!(
            of,
            [None, Some(0), None, None, Some(1), Some(2), None, None]
        );
        assert_eq!((columns.touches(), columns.len()), (&[1, 4, 5][..], 3));
        assert_eq!(Columns::default().of(0), None);
    }
}
