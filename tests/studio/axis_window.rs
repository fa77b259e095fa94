//! The window stands as the part does.
#![cfg(feature = "studio")]

use crate::window;

use egui_kittest::kittest::Queryable as _;
use glam::DVec3;
use hapdef::mesh::stance::Direction;
use hapdef::mesh::unroll::Axis;
use hapdef::project::PartAxis;
use hapdef::studio::UiCommand;
use window::Window;

#[test]
fn views_follow_the_axis_of_the_part() {
    let mut w = Window::open();
    w.stage("Part");
    for (axis, up, front) in [
        (PartAxis::Auto, DVec3::Z, DVec3::X),
        (PartAxis::Coordinate(Axis::Y), DVec3::Y, DVec3::Z),
        (PartAxis::Along([0.0, 0.0, -1.0]), DVec3::NEG_Z, DVec3::X),
    ] {
        w.session_mut().document.state.project.part.axis = axis;
        w.harness.run_ok();
        w.press("Front");
        let camera = w.harness.state().view.camera;
        assert!(camera.stance.up().distance(up) < 1e-12, "{axis:?}");
        assert!(camera.toward_eye().distance(front) < 1e-12, "{axis:?}");
        w.assert_named("the axis");
    }
    // Where lengths are off the unrolled view is hatched: about a wrong axis everywhere.
    w.session_mut().document.state.project.part.axis = PartAxis::Auto;
    let ctx = w.harness.ctx.clone();
    w.harness.state_mut().execute(&ctx, UiCommand::Unrolled);
    w.harness.run_ok();
    let kept = w.picture();
    w.session_mut().document.state.project.part.axis = PartAxis::Coordinate(Axis::X);
    w.harness.run_ok();
    let hatched = w.picture();
    let both = kept.pixels().zip(hatched.pixels());
    assert!(both.filter(|(a, b)| a != b).count() > 10_000);
}

#[test]
fn sections_mirrors_and_new_boxes_follow_the_axis_of_the_part() {
    let mut w = Window::open();
    let ctx = w.harness.ctx.clone();
    w.harness.state_mut().execute(&ctx, UiCommand::Section);
    w.harness.state_mut().view.mirror = Some(Direction::Right);
    w.stage("Supports");
    let oblique = DVec3::new(0.5, 0.8, 0.6);
    for (axis, turned) in [
        (PartAxis::Auto, false),
        (PartAxis::Coordinate(Axis::Y), false),
        (PartAxis::Along(oblique.to_array()), true),
    ] {
        w.session_mut().document.state.project.part.axis = axis;
        w.harness.run_ok();
        let stance = w.harness.state().view.camera.stance;
        for (name, side) in [
            ("front", Direction::Front),
            ("right", Direction::Right),
            ("top", Direction::Up),
        ] {
            w.press(&format!("Cut away: {name}"));
            let section = w.harness.state().view.section.unwrap();
            assert_eq!(section.normal, stance.direction(side), "{axis:?}");
            assert!(section.cuts(stance.direction(side) * 10.0));
        }
        let image = w.harness.state().image(DVec3::ZERO).unwrap();
        assert!(image.cross(stance.right()).length() < 1e-12, "{axis:?}");
        let document = &mut w.session_mut().document;
        document.state.project.supports.clear();
        w.harness.run_ok();
        w.press("Add support");
        let added = &w.session().document.state.project.supports;
        assert_eq!(added.len(), 1);
        assert_eq!(added[0].box_axis.is_some(), turned, "{axis:?}");
        w.harness
            .get_by_label("Support 1 gives way")
            .click_accesskit();
        w.harness.run_ok();
        let bedding = w.session().document.state.project.supports[0].bedding_n_per_mm3;
        assert!(bedding.is_some_and(|b| b > 0.0));
        w.assert_named("the supports");
    }
}

#[test]
fn an_example_goes_by_its_own_name() {
    use hapdef::cli::examples::Example;

    let mut w = Window::open();
    let ctx = w.harness.ctx.clone();
    for example in Example::ALL {
        // The first of them is open.
        if example != Example::Tube {
            let open = UiCommand::Example(example);
            w.harness.state_mut().execute(&ctx, open);
        }
        w.wait("the example", 60, |s| {
            Example::of_mesh(&s.session.document.mesh_path) == Some(example)
        });
        w.stage("Part");
        let shown = w.harness.query_all_by_label(example.name()).count();
        assert!(shown > 0, "{}", example.name());
    }
}
