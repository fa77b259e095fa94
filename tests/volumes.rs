//! Meshes of tetrahedra that the user has, from the file to an answer.

use std::fmt::Write as _;

use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::design::Inputs;
use hapdef::elasticity::Touch;
use hapdef::given::{self, GivenSite};
use hapdef::io::mesh_file::{LoadedMesh, read_mesh};
use hapdef::mesh::repair::Repair;
use hapdef::mesh::unroll::Axis;
use hapdef::mesh::volume::VolumeMesh;
use hapdef::project::{PartModel, Project, SupportKeys, SupportKind, Unit};

/// A strip 100 × 20 × 2 mm in blocks of six linear tetrahedra (mm).
fn strip() -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let counts = [40u32, 8, 1];
    let sides = DVec3::new(100.0, 20.0, 2.0);
    let number = |i: u32, j: u32, k: u32| i + 41 * (j + 9 * k);
    let mut nodes = Vec::new();
    for k in 0..=counts[2] {
        for j in 0..=counts[1] {
            for i in 0..=counts[0] {
                let at = [i, j, k].map(f64::from);
                let whole = counts.map(f64::from);
                nodes.push(DVec3::from_array(at) / DVec3::from_array(whole) * sides);
            }
        }
    }
    let mut tetrahedra = Vec::new();
    for k in 0..counts[2] {
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let c: [u32; 8] = std::array::from_fn(|b| {
                    let b = b as u32;
                    number(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2))
                });
                for t in [
                    [0, 1, 3, 7],
                    [0, 5, 1, 7],
                    [0, 3, 2, 7],
                    [0, 2, 6, 7],
                    [0, 4, 5, 7],
                    [0, 6, 4, 7],
                ] {
                    tetrahedra.push(t.map(|n| c[n]));
                }
            }
        }
    }
    (nodes, tetrahedra)
}

/// Gmsh's and Abaqus' order of the ten nodes.
const GMSH: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
const ABAQUS: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9];

fn quadratic(order: [usize; 10]) -> (Vec<DVec3>, Vec<Vec<u32>>) {
    let (nodes, corners) = strip();
    let volume = VolumeMesh::of_linear(nodes, &corners);
    let all = volume
        .tetrahedra
        .iter()
        .map(|t| order.map(|k| t[k]).to_vec());
    (volume.nodes.clone(), all.collect())
}

fn linear() -> (Vec<DVec3>, Vec<Vec<u32>>) {
    let (nodes, corners) = strip();
    (nodes, corners.iter().map(|t| t.to_vec()).collect())
}

/// Node numbers begin far from one, as they may.
const FIRST: u32 = 1001;

fn msh2((nodes, elements): (Vec<DVec3>, Vec<Vec<u32>>)) -> String {
    let mut text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n",
        nodes.len()
    );
    for (k, p) in (FIRST..).zip(&nodes) {
        let _ = writeln!(text, "{k} {} {} {}", p.x, p.y, p.z);
    }
    let _ = write!(
        text,
        "$EndNodes\n$Elements\n{}\n1 2 2 7 7 {FIRST} {} {}\n",
        elements.len() + 1,
        FIRST + 1,
        FIRST + 2
    );
    for (k, e) in (2..).zip(&elements) {
        let kind = if e.len() == 4 { 4 } else { 11 };
        let list: Vec<String> = e.iter().map(|n| (n + FIRST).to_string()).collect();
        let _ = writeln!(text, "{k} {kind} 2 1 1 {}", list.join(" "));
    }
    text + "$EndElements\n"
}

fn msh4((nodes, elements): (Vec<DVec3>, Vec<Vec<u32>>)) -> String {
    let count = nodes.len();
    let mut text = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 0 0\n$EndEntities\n$Nodes\n2 {count} {FIRST} {}\n2 5 1 3\n{} {} {}\n",
        FIRST as usize + count - 1,
        FIRST,
        FIRST + 1,
        FIRST + 2
    );
    for p in &nodes[..3] {
        let _ = writeln!(text, "{} {} {} 0.5 0.25", p.x, p.y, p.z);
    }
    let _ = writeln!(text, "3 1 0 {}", count - 3);
    for k in 3..count as u32 {
        let _ = writeln!(text, "{}", k + FIRST);
    }
    for p in &nodes[3..] {
        let _ = writeln!(text, "{} {} {}", p.x, p.y, p.z);
    }
    let kind = if elements[0].len() == 4 { 4 } else { 11 };
    let _ = write!(
        text,
        "$EndNodes\n$Elements\n1 {0} 1 {0}\n3 1 {kind} {0}\n",
        elements.len()
    );
    for (k, e) in (1..).zip(&elements) {
        let list: Vec<String> = e.iter().map(|n| (n + FIRST).to_string()).collect();
        let _ = writeln!(text, "{k} {}", list.join(" "));
    }
    text + "$EndElements\n"
}

fn inp((nodes, elements): (Vec<DVec3>, Vec<Vec<u32>>)) -> String {
    let mut text = String::from("*HEADING\n a strip\n** comment\n*Node, NSET=all\n");
    for (k, p) in (FIRST..).zip(&nodes) {
        let _ = writeln!(text, "{k}, {}, {}, {}", p.x, p.y, p.z);
    }
    let kind = if elements[0].len() == 4 {
        "C3D4"
    } else {
        "c3d10"
    };
    let _ = writeln!(text, "*ELEMENT, type={kind}, ELSET=body");
    for (k, e) in (1..).zip(&elements) {
        let list: Vec<String> = e.iter().map(|n| (n + FIRST).to_string()).collect();
        // Long lines are broken, as Abaqus does.
        let (first, rest) = list.split_at(list.len() / 2);
        let _ = writeln!(text, "{k}, {},\n {}", first.join(", "), rest.join(", "));
    }
    let ends: Vec<String> = (FIRST..)
        .zip(&nodes)
        .filter(|(_, p)| p.x == 0.0)
        .map(|(k, _)| k.to_string())
        .collect();
    let _ = writeln!(text, "*NSET, NSET=Root\n{}", ends.join(",\n"));
    text
}

fn read(ending: &str, text: &str) -> Result<LoadedMesh, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("strip.{ending}"));
    std::fs::write(&path, text).unwrap();
    read_mesh(&path, Some(Unit::Millimetre), 0, Repair::default()).map_err(|e| e.to_string())
}

/// Displacement under a touch and strain inside over those of a beam, and the notes.
fn answer(loaded: LoadedMesh, set: Option<&str>) -> (f64, f64, Vec<String>) {
    let mut project = Project::around("strip", Some(Unit::Millimetre));
    project.part.model = PartModel::Solid;
    project.material.poissons_ratio = 0.0;
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: set
            .is_none()
            .then_some([[-1.0, -1.0, -1.0], [0.001, 30.0, 3.0]]),
        vertices: set.map(str::to_owned),
        normal: Axis::Z,
    });
    let touch = Touch {
        position: DVec3::new(0.09, 0.01, 0.002),
        normal: DVec3::Z,
        force: 1.0,
        tip_radius: 0.004,
    };
    let sites = [
        GivenSite {
            position: DVec3::new(0.09, 0.01, 0.0),
            direction: DVec3::X,
        },
        GivenSite {
            position: DVec3::new(0.045, 0.01, 0.0),
            direction: DVec3::X,
        },
    ];
    let inputs = Inputs {
        project,
        part: std::sync::Arc::new(loaded.mesh),
        painted: None,
        masks: loaded.groups,
    };
    let answer = given::answer(
        &inputs,
        &[touch],
        &sites,
        &Quality::Draft.budget(),
        &unwatched,
    )
    .unwrap();
    let pairs: Vec<_> = answer.pairs().collect();
    let (e, inertia) = (1.7e9, 0.02 * 0.002_f64.powi(3) / 12.0);
    let moved = 0.09_f64.powi(3) / (3.0 * e * inertia);
    let strain = -(0.09 - 0.045) * 0.001 / (e * inertia);
    (
        -pairs[0].displacement.z / moved,
        pairs[1].strain / strain,
        answer.notes,
    )
}

#[test]
fn tetrahedra_of_every_kind_bend_as_a_beam() {
    let files = [
        ("msh", msh2(linear()), true),
        ("msh", msh2(quadratic(GMSH)), false),
        ("msh", msh4(linear()), true),
        ("msh", msh4(quadratic(GMSH)), false),
        ("inp", inp(linear()), true),
        ("inp", inp(quadratic(ABAQUS)), false),
    ];
    for (k, (ending, text, linear)) in files.iter().enumerate() {
        let loaded = read(ending, text).unwrap();
        assert_eq!(loaded.mesh.boundary_edges().count(), 0);
        let (displacement, strain, notes) = answer(loaded, None);
        println!("{k} {ending}: {displacement:.4} {strain:.4} {notes:?}");
        assert!((displacement - 1.0).abs() < 0.01, "{k}: {displacement}");
        assert!((strain - 1.0).abs() < 0.02, "{k}: {strain}");
        let said = notes.iter().any(|n| n.contains("linear tetrahedra"));
        assert_eq!(said, *linear);
    }
    // A set of nodes of the file is a support.
    let (displacement, _, _) = answer(read("inp", &inp(linear())).unwrap(), Some("Root"));
    assert!((displacement - 1.0).abs() < 0.01, "{displacement}");
}

#[test]
fn what_cannot_be_read_is_named() {
    let (nodes, elements) = linear();
    let refused = |ending: &str, text: &str, words: &[&str]| {
        let error = read(ending, text).err().unwrap();
        for word in words {
            assert!(error.contains(word), "{error}");
        }
    };
    let good = msh2((nodes.clone(), elements.clone()));
    refused("msh", &good.replace("2.2 0 8", "2.2 1 8"), &["binary"]);
    refused("msh", &good.replace("2.2 0 8", "3.0 0 8"), &["3"]);
    refused("msh", &good[..good.len() / 2], &["Elements"]);
    refused("msh", &good.replace("1002 2.5 0 0", "1002 x 0 0"), &["“x”"]);
    let missing = msh2((nodes.clone(), vec![vec![0, 1, 2, 90_000]]));
    refused("msh", &missing, &["91001", "not there"]);
    let flat = msh2((nodes.clone(), vec![vec![0, 1, 2, 3]]));
    refused("msh", &flat, &["no volume"]);
    let brick = inp((nodes, elements)).replace("C3D4", "C3D8");
    refused("inp", &brick, &["C3D8", "tetrahedra"]);
}
