//! The shell against a solid model of the same limb (see `bench/slotted.rs`).

use crate::bench;

use bench::slotted::agreement;
use hapdef::budget::Quality;

#[test]
fn a_slotted_limb_agrees_with_a_solid_model() {
    for (quality, most) in [
        (Quality::Draft, [4.0, 7.0, 3.5]),
        (Quality::Standard, [2.0, 6.0, 2.0]),
        (Quality::Reference, [1.0, 4.0, 1.0]),
    ] {
        let a = agreement(quality);
        let estimate = a.answer.discretization;
        println!(
            "{}: under the load {:.2} % rms, {:.2} % at worst; strain {:.2} % rms; estimated {:.2} % and {:.2} %",
            quality.name(),
            a.under_rms,
            a.under_worst,
            a.strain_rms,
            estimate.displacement_percent,
            estimate.strain_percent
        );
        for (found, most) in [a.under_rms, a.under_worst, a.strain_rms]
            .into_iter()
            .zip(most)
        {
            assert!(found < most, "{}: {found:.2} of {most}", quality.name());
        }
        if quality == Quality::Draft {
            // Finer ones are as near to the solid as a shell can be, whatever their elements leave.
            let effectivity = estimate.displacement_percent / a.under_rms;
            assert!((0.5..2.0).contains(&effectivity), "{effectivity:.2}");
        }
        // The wall is a tenth of its radius thick: that is said.
        assert!(
            a.answer
                .notes
                .iter()
                .any(|n| n.contains("radius of curvature"))
        );
    }
}
