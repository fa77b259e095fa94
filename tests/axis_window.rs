//! The window stands as the part does.
#![cfg(feature = "studio")]

mod window;

use glam::DVec3;
use hapdef::mesh::unroll::Axis;
use hapdef::project::PartAxis;
use hapdef::studio::Command;
use window::Window;

#[test]
fn views_follow_the_axis_of_the_part() {
    let Some(mut w) = Window::open() else { return };
    w.stage("Part");
    for (axis, up, front) in [
        (PartAxis::Auto, DVec3::Z, DVec3::X),
        (PartAxis::Coordinate(Axis::Y), DVec3::Y, DVec3::Z),
        (PartAxis::Along([0.0, 0.0, -1.0]), DVec3::NEG_Z, DVec3::X),
    ] {
        w.harness.state_mut().document.state.project.part.axis = axis;
        w.harness.run_ok();
        w.press("Front");
        let camera = w.harness.state().view.camera;
        assert!(camera.stance.up().distance(up) < 1e-12, "{axis:?}");
        assert!(camera.toward_eye().distance(front) < 1e-12, "{axis:?}");
        w.assert_named("the axis");
    }
    // Where lengths are off the unrolled view is hatched: about a wrong axis everywhere.
    w.harness.state_mut().document.state.project.part.axis = PartAxis::Auto;
    let ctx = w.harness.ctx.clone();
    w.harness.state_mut().execute(&ctx, Command::Unrolled);
    w.harness.run_ok();
    let kept = w.picture();
    w.harness.state_mut().document.state.project.part.axis = PartAxis::Coordinate(Axis::X);
    w.harness.run_ok();
    let hatched = w.picture();
    let both = kept.pixels().zip(hatched.pixels());
    assert!(both.filter(|(a, b)| a != b).count() > 10_000);
}
