//! Many designs beside each other: a base project, axes along which it is varied, and what is asked of each design.
//!
//! A unit is one point of the axes. What it finds depends on nothing but the study, so that any unit may be computed
//! anywhere, in any order and more than once.

mod axis;
mod figures;
mod file;
mod front;
mod points;
mod script;
mod service;
mod sobol;

pub use self::axis::{StudyAxis, Subject};
pub use self::figures::{Figure, figures};
pub use self::file::{Combine, ParameterStudy, StudyBase};
pub use self::front::{Aim, Bound, front};
pub use self::points::{MOST_UNITS, Points};
pub use self::script::{Engine, JobScript, UnitLimits};
pub use self::service::ServiceLoad;

/// Parses a study's text and checks what can be known without its base.
///
/// # Errors
/// A message in the user's terms.
pub fn parse(text: &str) -> Result<ParameterStudy, String> {
    let study = ParameterStudy::of_text(text)?;
    Points::of(&study)?;
    Ok(study)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Quality;

    fn refused(text: &str) -> String {
        parse(text).unwrap_err()
    }

    #[test]
    fn a_study_is_read_or_refused_by_what_is_wrong() {
        let base = "format = 1\n[base]\nlimb = true\nquality = \"draft\"\n";
        let axis = "[[axis]]\nkey = \"selection.sensors\"\nvalues = [5, 8]\n";
        let study = parse(&format!("{base}{axis}")).unwrap();
        assert_eq!(study.base.quality, Some(Quality::Draft));
        assert_eq!(Points::of(&study).unwrap().count(), 2);
        assert!(refused(&format!("{base}{axis}{axis}")).contains("stands twice"));
        assert!(refused("format = 2\n[base]\nlimb = true\n").contains("format 2"));
        assert!(refused("format = 1\n[base]\n").contains("one of the two"));
        assert!(refused(&format!("{base}colour = 3\n")).contains("line 5"));
        let none = "[[axis]]\nkey = \"touch.force_n\"\n";
        assert!(refused(&format!("{base}{none}")).contains("touch.force_n"));
    }
}
