//! Where the machine presses: places of the limb that its tip gets to.

use glam::DVec3;

use super::machine::{Machine, Pose};
use super::mount::TableMount;
use crate::mesh::TriMesh;
use crate::units;

/// A press that is planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planned {
    /// On the limb (m).
    pub at: DVec3,
    /// Its outward normal.
    pub normal: DVec3,
    /// The tip where it just touches.
    pub pose: Pose,
}

/// What the machine gets to.
#[derive(Clone, Debug, Default)]
pub struct MachineReach {
    /// The presses, in their order.
    pub presses: Vec<Planned>,
    /// Which of the places asked for they are of, counted from 0.
    pub asked: Vec<usize>,
    /// The others, each with why.
    pub left_out: Vec<(usize, String)>,
    /// How far from its axis the tip is out of everything's way (m).
    pub retreat: f64,
}

/// Plans presses at places with their outward normals (m), on a limb that stands as `mount` says.
///
/// # Errors
/// Where the tip gets out of the way of the limb nowhere.
pub fn plan(
    places: &[(DVec3, DVec3)],
    limb: &TriMesh,
    machine: &Machine,
    mount: &TableMount,
) -> Result<MachineReach, String> {
    let retreat = retreat(limb, machine, mount);
    let number = machine.radial.number(units::mm(retreat));
    if !machine.radial.reaches(number) {
        return Err(format!(
            "the tip must be {:.0} mm from the table's axis to be out of the limb's way, and {}{number:.1} is outside its range",
            units::mm(retreat),
            machine.radial.letter
        ));
    }
    let mut reach = MachineReach {
        retreat,
        ..MachineReach::default()
    };
    let mut near = 0.0;
    for (k, &(at, normal)) in places.iter().enumerate() {
        let found = machine.pose(mount.place(at), mount.direction(normal), near);
        let free = found.and_then(
            |pose| match in_the_way(limb, machine, mount, &pose, retreat) {
                Some(at) => Err(format!(
                    "the tip meets the limb {:.0} mm before it",
                    units::mm(at)
                )),
                None => Ok(pose),
            },
        );
        match free {
            Ok(pose) => {
                near = pose.angle;
                reach.presses.push(Planned { at, normal, pose });
                reach.asked.push(k);
            }
            Err(why) => reach.left_out.push((k, why)),
        }
    }
    Ok(reach)
}

/// How far from the table's axis the tip's middle is clear of the limb, however the table turns.
fn retreat(limb: &TriMesh, machine: &Machine, mount: &TableMount) -> f64 {
    let from_axis = |p: &DVec3| mount.place(*p).truncate().length();
    let farthest = limb.positions().iter().map(from_axis).fold(0.0, f64::max);
    farthest + machine.tip_radius + machine.clearance
}

/// How far before its place (m) the tip meets the limb on its way, if it does.
fn in_the_way(
    limb: &TriMesh,
    machine: &Machine,
    mount: &TableMount,
    pose: &Pose,
    retreat: f64,
) -> Option<f64> {
    /// What a tip may dip into the surface at most, over its radius: surfaces bend, and places are read off triangles.
    const ALLOWED: f64 = 0.1;
    /// Steps of the way that are looked at, over the tip's radius.
    const STEP: f64 = 0.5;
    let step = STEP * machine.tip_radius;
    let steps = ((retreat - pose.radial) / step).ceil().max(0.0) as usize;
    (1..=steps).map(|k| step * k as f64).find(|way| {
        let moved = Pose {
            radial: pose.radial + way,
            ..*pose
        };
        let middle = mount.limb(moved.on_table());
        limb.index().nearest(middle).1 < (1.0 - ALLOWED) * machine.tip_radius
    })
}

#[cfg(test)]
mod tests {
    use super::super::machine::tests::paper;
    use super::*;
    use crate::limb::LimbSpec;
    use crate::mesh::sample;

    #[test]
    fn a_plan_keeps_to_what_the_tip_gets_to() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let machine = paper();
        let (low, high) = mesh.bounds();
        let mount = TableMount::upright(DVec3::Z, DVec3::X, (low + high) / 2.0);
        let places: Vec<(DVec3, DVec3)> = (sample::random(&mesh, 200, 3, |_| true).into_iter())
            .map(|at| (mesh.point(at), mesh.normal(at)))
            .collect();
        let reach = plan(&places, &mesh, &machine, &mount).unwrap();
        assert_eq!(reach.presses.len() + reach.left_out.len(), 200);
        assert!(reach.presses.len() > 80, "{}", reach.presses.len());
        for press in &reach.presses {
            let middle = mount.limb(press.pose.on_table());
            let off = middle.distance(press.at) - machine.tip_radius;
            assert!(off.abs() < 1e-9, "{off}");
        }
        // Whoever cannot get out of the way plans nothing.
        let mut short = machine;
        short.radial.range = [80.0, 119.0];
        let said = plan(&places, &mesh, &short, &mount).unwrap_err();
        assert!(said.contains("out of the limb's way"), "{said}");
    }
}
