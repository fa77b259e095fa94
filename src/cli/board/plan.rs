//! What is asked of a simulated board, as far as it can be known to make sense without the model.

use std::path::Path;

use super::args::BoardArgs;
use crate::board::{ChannelFault, Fault, Faults, GivenPress, PressScript, ScriptedPress, aside};
use crate::cli::simulate::in_file;
use crate::design::{self, Inputs, Sensing};
use crate::elasticity::Touch;
use crate::io::points;
use crate::mesh::TriMesh;
use crate::uncertainty::Making;
use crate::wire::MOST_CHANNELS;

/// What was asked for, as far as it can be known to make sense without the model.
pub(super) struct BoardPlan {
    pub channels: usize,
    pub faults: Faults,
    /// Instead of random touches.
    pub presses: Option<Vec<GivenPress>>,
}

impl BoardPlan {
    /// Of the options and the files that they name.
    ///
    /// # Errors
    /// What does not go together, or cannot be read.
    pub fn new(args: &BoardArgs, inputs: &Inputs) -> anyhow::Result<Self> {
        inputs.project.check()?;
        let gauges = inputs.project.selection.sites.len();
        let channels = args.channels.unwrap_or(gauges);
        anyhow::ensure!(
            (gauges..=MOST_CHANNELS).contains(&channels),
            "--channels {channels}: the project has {gauges} gauges, and a board at most {MOST_CHANNELS} channels"
        );
        anyhow::ensure!(
            args.force[0] <= args.force[1],
            "--force {} {}: the smaller one first",
            args.force[0],
            args.force[1]
        );
        anyhow::ensure!(
            args.ramp[0] <= args.ramp[1],
            "--ramp {} {}: the shorter one first",
            args.ramp[0],
            args.ramp[1]
        );
        let script = args.script.as_deref();
        Ok(Self {
            channels,
            faults: faults(args, channels)?,
            presses: script
                .map(|path| read_script(path, &inputs.part))
                .transpose()?,
        })
    }

    /// Whether touches overlap or push aside.
    pub fn says_more(&self, args: &BoardArgs, usual: &Making) -> bool {
        let presses = self.presses.as_deref().unwrap_or_default();
        let mut spans: Vec<[f64; 2]> = (presses.iter())
            .map(|p| [p.start_s, p.start_s + p.duration_s])
            .collect();
        spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let overlap = spans.windows(2).any(|pair| pair[1][0] < pair[0][1]);
        let aside = self.presses.is_none() && args.making(usual).friction > 0.0;
        overlap || aside || args.tilt > 0.0 || presses.iter().any(|p| p.tilt_deg > 0.0)
    }
}

fn faults(args: &BoardArgs, channels: usize) -> anyhow::Result<Faults> {
    let mut faults = Faults {
        flip: args.flip,
        drop: args.drop,
        duplicate: args.duplicate,
        lose: args.lose,
        ..Faults::default()
    };
    for &fault in &args.fault {
        if let Fault::Channel(ChannelFault { channel, .. }) = fault {
            anyhow::ensure!(
                channel < channels,
                "--fault on channel {channel}: the board has {channels} channels, from 0"
            );
        }
        faults.add(fault);
    }
    Ok(faults)
}

/// Presses from a file, all of them near the part.
fn read_script(path: &Path, part: &TriMesh) -> anyhow::Result<Vec<GivenPress>> {
    let presses = points::read_presses(path)?;
    design::check_reach(part, "touch", presses.iter().map(|p| p.position))
        .map_err(|error| in_file(error, path, path))?;
    Ok(presses)
}

/// Presses put onto the part's surface.
pub(super) fn on_surface(
    presses: &[GivenPress],
    inputs: &Inputs,
    sensing: &Sensing,
) -> PressScript {
    let map = &sensing.drawn.map;
    let up = inputs.project.part.axis.stance(&inputs.part).up();
    let press = |asked: &GivenPress| {
        let (at, _) = map.mesh.index().nearest(asked.position);
        let normal = map.mesh.normal(at);
        ScriptedPress {
            start_s: asked.start_s,
            duration_s: asked.duration_s,
            touch: Touch {
                position: map.mesh.point(at),
                normal,
                force: asked.force,
                tip_radius: asked.radius.unwrap_or(inputs.project.tip().1),
            },
            ramp_s: asked.ramp_s,
            aside: aside(normal, up, asked.tilt_deg, asked.towards_deg),
        }
    };
    PressScript::Given(presses.iter().map(press).collect())
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::cli::{Cli, Command};

    #[test]
    fn a_board_is_touched_and_drifts_as_the_project_says_or_as_it_is_told() {
        let mut inputs = crate::io::opening::bundled().unwrap().inputs;
        let project = &mut inputs.project;
        (
            project.touch.friction_percent,
            project.touch.tip_tolerance_mm,
        ) = (20.0, 0.5);
        project.gauge.drift_microstrain = 4.0;
        let asked = |more: &[&str]| {
            let words = [&["hapdef", "board", "--simulate"][..], more].concat();
            match Cli::parse_from(words).command {
                Some(Command::Board(args)) => args,
                other => panic!("{other:?}"),
            }
        };
        let (plain, disturbed) = (
            asked(&[]),
            asked(&[
                "--friction",
                "30",
                "--wander",
                "1@5",
                "--tip-tolerance",
                "0",
            ]),
        );
        let usual = inputs.project.making();
        assert_eq!(plain.making(&usual), usual);
        assert_eq!((usual.tip, usual.friction), (0.5e-3, 0.2));
        let making = disturbed.making(&usual);
        assert_eq!((making.tip, making.friction), (0.0, 0.3));
        let usual = design::simulated_board::options(&inputs, 10).disturbances;
        let wander = |args: &BoardArgs| args.disturbed.disturbances(&usual).wander.unwrap();
        assert!((wander(&plain).0 - 4e-6).abs() < 1e-15 && wander(&plain).1 > 0.0);
        assert!((wander(&disturbed).0 - 1e-6).abs() < 1e-15 && wander(&disturbed).1 == 5.0);
        // Touches that push aside have more columns in the truth.
        let plan = BoardPlan::new(&plain, &inputs).unwrap();
        assert!(plan.says_more(&plain, &inputs.project.making()));
    }

    #[test]
    fn presses_far_from_the_part_are_refused_with_their_line() {
        let part = crate::io::opening::bundled().unwrap().inputs.part;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("touches.csv");
        let head = "start_s,duration_s,x_mm,y_mm,z_mm,force_n\n1,1,22.5,22.5,60,8\n";
        std::fs::write(&path, format!("{head}2,1,0,0,0,1\n")).unwrap();
        assert_eq!(read_script(&path, &part).unwrap().len(), 2);
        std::fs::write(&path, format!("{head}1,1,1e160,0,0,8\n")).unwrap();
        let said = format!("{:#}", read_script(&path, &part).unwrap_err());
        assert!(
            said.contains("touches.csv, line 3") && said.contains("from the part"),
            "{said}"
        );
        assert!(said.len() < 500, "{said}");
    }
}
