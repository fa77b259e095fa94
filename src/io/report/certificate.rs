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
    let (Some(certificate), Some(expected)) = (set.certificate, set.criterion_mm) else {
        return;
    };
    let _ = write!(
        page,
        "<details><summary>{}</summary><p>Expected error of these gauges {expected:.2} mm, of which {:.2} mm where one place is meant, which the bound is of. {}</p></details>",
        escape(&certificate.words(expected)),
        certificate.local_mm,
        escape(ASSUMES)
    );
}
