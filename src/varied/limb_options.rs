//! The options of the generator of limbs, and the project that they make.

use clap::{Args, ValueEnum};

use crate::limb::barrel::BarrelSpec;
use crate::limb::{BoxMm, LimbSpec, LimbSupport};
use crate::mesh::TriMesh;
use crate::mesh::unroll::Axis;
use crate::project::{
    PartAxis, PartModel, Project, RegionKeys, SiteLattice, SupportKeys, SupportKind,
};

/// What a limb's wall is made of.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// A tube of columns and hoops: the middle of a wall.
    Columns,
    /// A barrel of triangles about y, a thin-walled solid with a frame of rods inside.
    Triangles,
}

/// Lengths in millimetres. Without options it is the bundled limb, with `--pattern triangles` the other one.
#[derive(Args, Debug, Clone)]
pub struct LimbOptions {
    #[arg(long, value_enum, default_value = "columns")]
    pub pattern: Pattern,
    /// Unrolled length around, of a barrel where it is widest.
    #[arg(long)]
    pub circumference: Option<f64>,
    /// Angle covered, in degrees; 360 is a closed tube.
    #[arg(long)]
    pub arc: Option<f64>,
    #[arg(long)]
    pub height: Option<f64>,
    /// Radius at the top over radius at the bottom.
    #[arg(long)]
    pub taper: Option<f64>,
    /// A regular grid of this many columns (of triangles: so many stand around) …
    #[arg(long, requires = "hoops")]
    pub columns: Option<usize>,
    /// … and hoops, rims included.
    #[arg(long, requires = "columns")]
    pub hoops: Option<usize>,
    /// Width of columns, or of the bars between triangles.
    #[arg(long)]
    pub column_width: Option<f64>,
    /// Width of hoops in a regular grid (10 when left out), or of a barrel's rims.
    #[arg(long)]
    pub hoop_width: Option<f64>,
    /// Radius of the windows' corners.
    #[arg(long)]
    pub corner_radius: Option<f64>,
    /// Clamp both rims all round, this deep, instead of the four bosses.
    #[arg(long)]
    pub clamp_rims: Option<f64>,
    /// Largest side of an element.
    #[arg(long)]
    pub element: Option<f64>,
    /// Thickness of the wall.
    #[arg(long)]
    pub thickness: Option<f64>,
    /// Write the limb as a closed solid with its wall, not as the middle of it.
    #[arg(long)]
    pub solid: bool,
}

impl LimbOptions {
    fn spec(&self) -> LimbSpec {
        let mut spec = LimbSpec::default();
        set(&mut spec.circumference, self.circumference);
        set(&mut spec.arc_degrees, self.arc);
        set(&mut spec.height, self.height);
        set(&mut spec.taper, self.taper);
        set(&mut spec.column_width, self.column_width);
        set(&mut spec.corner_radius, self.corner_radius);
        set(&mut spec.element, self.element);
        if let (Some(columns), Some(hoops)) = (self.columns, self.hoops) {
            spec = spec.grid(columns, hoops, self.hoop_width.unwrap_or(10.0));
            // The bosses sit on two opposite columns of the new grid.
            let centres = vec![spec.columns[0], spec.columns[columns / 2]];
            spec.support = LimbSupport::Bosses {
                centres,
                half_width: spec.column_width / 2.0,
                depth: 5.0,
            };
        }
        if let Some(depth) = self.clamp_rims {
            spec.support = LimbSupport::Rims { depth };
        }
        spec
    }

    /// The barrel that is asked for.
    ///
    /// # Errors
    /// Which option a barrel does not have.
    fn barrel(&self) -> anyhow::Result<BarrelSpec> {
        let foreign = [
            ("--arc", self.arc),
            ("--taper", self.taper),
            ("--clamp-rims", self.clamp_rims),
        ];
        if let Some((name, _)) = foreign.iter().find(|(_, given)| given.is_some()) {
            anyhow::bail!("{name} is for limbs of columns: leave it out, or leave out --pattern");
        }
        let mut spec = BarrelSpec::default();
        set(
            &mut spec.radius,
            self.circumference.map(|c| c / std::f64::consts::TAU),
        );
        set(&mut spec.height, self.height);
        set(&mut spec.bar, self.column_width);
        set(&mut spec.rim, self.hoop_width);
        set(&mut spec.corner_radius, self.corner_radius);
        set(&mut spec.wall, self.thickness);
        set(&mut spec.element, self.element);
        if let (Some(columns), Some(hoops)) = (self.columns, self.hoops) {
            spec.around = columns;
            // The rims are hoops too.
            spec.rows = hoops - 1;
        }
        Ok(spec)
    }
}

fn set(value: &mut f64, given: Option<f64>) {
    if let Some(given) = given {
        *value = given;
    }
}

/// A limb before it is written.
pub struct MadeLimb {
    /// Of its files, without their endings.
    pub name: &'static str,
    pub mesh: TriMesh,
    pub project: Project,
    pub radius_mm: f64,
}

/// The limb that is asked for.
///
/// # Errors
/// What cannot be made of these options.
pub fn made(args: &LimbOptions) -> anyhow::Result<MadeLimb> {
    anyhow::ensure!(
        args.columns != Some(0) && args.hoops.is_none_or(|h| h >= 2),
        "a limb has at least one column and two hoops"
    );
    match args.pattern {
        Pattern::Columns => tube(args),
        Pattern::Triangles => barrel(args),
    }
}

fn tube(args: &LimbOptions) -> anyhow::Result<MadeLimb> {
    let spec = args.spec();
    let (mut mesh, boxes) = spec.build()?;
    let mut project = Project::around("limb.glb", None);
    project.part.axis = PartAxis::Coordinate(Axis::Z);
    project.supports = clamped(&boxes);
    project.sites.lattice = SiteLattice::Unrolled;
    let wide = (2.0 * spec.radius() * spec.taper.max(1.0)).ceil().max(80.0);
    let top = spec.height - 12.0;
    project.evaluation.regions = vec![away([-wide, -wide, 12.0], [wide, wide, top])];
    set(&mut project.part.thickness_mm, args.thickness);
    if args.solid {
        mesh = mesh.thickened(project.part.thickness());
        thicken(&mut project);
    }
    Ok(MadeLimb {
        name: "limb",
        mesh,
        project,
        radius_mm: spec.radius(),
    })
}

/// A barrel is a solid as it is.
fn barrel(args: &LimbOptions) -> anyhow::Result<MadeLimb> {
    let spec = args.barrel()?;
    let (mesh, boxes) = spec.build()?;
    let mut project = Project::around("barrel.glb", None);
    project.part.model = PartModel::Solid;
    project.part.thickness_mm = spec.wall;
    project.part.axis = PartAxis::Coordinate(Axis::Y);
    project.supports = clamped(&boxes);
    let wide = (2.0 * spec.radius).ceil();
    let top = spec.height - spec.rim;
    project.evaluation.regions = vec![away([-wide, spec.rim, -wide], [wide, top, wide])];
    Ok(MadeLimb {
        name: "barrel",
        mesh,
        project,
        radius_mm: spec.radius,
    })
}

fn clamped(boxes: &[BoxMm]) -> Vec<SupportKeys> {
    (boxes.iter())
        .map(|&box_mm| SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: Some(box_mm),
            box_axis: None,
            vertices: None,
            normal: Axis::default(),
            bedding_n_per_mm3: None,
        })
        .collect()
}

/// Where errors are quoted for beside all touches.
fn away(low: [f64; 3], high: [f64; 3]) -> RegionKeys {
    RegionKeys {
        name: "away from the boundaries".into(),
        box_mm: [low, high],
        box_axis: None,
    }
}

/// Supports that hold the wall of a solid where they held its middle: their boxes reach through it, across and not
/// along it.
fn thicken(project: &mut Project) {
    project.part.model = PartModel::Solid;
    let wall = project.part.thickness_mm;
    for held in project
        .supports
        .iter_mut()
        .filter_map(|s| s.box_mm.as_mut())
    {
        let middle = [0, 1].map(|i| f64::midpoint(held[0][i], held[1][i]));
        let all_round = middle.iter().all(|m| m.abs() < 1e-6);
        let across = usize::from(middle[1].abs() > middle[0].abs());
        for axis in (0..2).filter(|&a| all_round || a == across) {
            held[0][axis] -= wall;
            held[1][axis] += wall;
        }
    }
}
