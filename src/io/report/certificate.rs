//! The report's line on how far the chosen gauges can be from the best ones.

use std::fmt::Write as _;

use super::escape;
use crate::design::Design;
use crate::placement::expected_error::ASSUMES;

/// Within what of the best possible the chosen set is, what the bound is of, and, folded away, what it assumes.
pub(super) fn line(page: &mut String, design: &Design) {
    let Some(set) = design.chosen_set() else {
        return;
    };
    let (Some(certificate), Some(expected)) = (set.certificate, set.promised_mm()) else {
        return;
    };
    let _ = write!(
        page,
        "<details><summary>{}, for gauges as built</summary><p>Expected error of these gauges, with all that the project says to be off, over presses that they were not chosen by, {expected:.2} mm, which compares with the errors “as built” and not with those as drawn; of it {:.2} mm where one place is meant, which the bound is of. {}</p></details>",
        escape(&certificate.words(expected)),
        certificate.local_mm,
        escape(ASSUMES)
    );
}
