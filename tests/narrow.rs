//! Little memory: what would not fit is made smaller before it is refused. A program of its own, for what may be
//! taken holds for all of it.

use hapdef::budget::{Budget, ElementBudget, Quality, unwatched};
use hapdef::design::DesignError;
use hapdef::given::{self, GivenSite};
use hapdef::{elasticity::Touch, memory};

#[test]
fn few_touches_get_no_more_elements_than_memory_holds() {
    let mut inputs = hapdef::cli::bundled().unwrap().inputs;
    inputs.project.selection.sites.clear();
    let position = inputs.part.positions()[inputs.part.positions().len() / 2];
    let touch = Touch {
        position,
        normal: inputs.part.vertex_normals()[inputs.part.positions().len() / 2],
        force: 1.0,
        tip_radius: 3e-3,
    };
    let site = GivenSite {
        position,
        direction: glam::DVec3::Z,
    };
    // Finer and finer: nothing meets these.
    let budget = |most_vertices: usize| Budget {
        elements: ElementBudget {
            vertices: 400,
            most_vertices,
            effort: usize::MAX,
            displacement_percent: 1e-6,
            strain_percent: 1e-6,
            passes: 1,
        },
        ..Quality::Draft.budget()
    };
    memory::allow(80_000_000);
    let ask = |most: usize| given::answer(&inputs, &[touch], &[site], &budget(most), &unwatched);
    let answer = ask(50_000).unwrap_or_else(|e: DesignError| panic!("{e}"));
    assert!(answer.pairs().all(|p| p.displacement.is_finite()));
    let said = answer.notes.join("\n");
    assert!(
        said.contains("Memory did not hold as many elements"),
        "{said}"
    );
    // Where not even what any number of touches has fits, that is said.
    memory::allow(100_000);
    assert!(ask(50_000).is_err());
}
