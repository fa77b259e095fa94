//! Meshes of tetrahedra that the user has, from the file to an answer.

use crate::bench;

use std::fmt::Write as _;

use bench::hexes::TETRAHEDRA;
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

/// A block of so many bricks along three axes, as large as `sides` (mm), of six linear tetrahedra a brick.
fn bricks(counts: [u32; 3], sides: DVec3) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let [nx, ny, nz] = counts;
    let whole = DVec3::from_array(counts.map(f64::from));
    let (mut nodes, mut tetrahedra) = (Vec::new(), Vec::new());
    for [i, j, k] in places([nx + 1, ny + 1, nz + 1]) {
        nodes.push(DVec3::from_array([i, j, k].map(f64::from)) / whole * sides);
    }
    for [i, j, k] in places(counts) {
        let brick: [u32; 8] = std::array::from_fn(|b| {
            let b = b as u32;
            let (i, j, k) = (i + (b & 1), j + (b >> 1 & 1), k + (b >> 2));
            i + (nx + 1) * (j + (ny + 1) * k)
        });
        tetrahedra.extend(TETRAHEDRA.map(|t| t.map(|n| brick[n])));
    }
    (nodes, tetrahedra)
}

/// All places of a lattice, the first coordinate changing first.
fn places([nx, ny, nz]: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..nx * ny * nz).map(move |n| [n % nx, n / nx % ny, n / (nx * ny)])
}

/// A strip 100 × 20 × 2 mm.
fn strip() -> (Vec<DVec3>, Vec<[u32; 4]>) {
    bricks([40, 8, 1], DVec3::new(100.0, 20.0, 2.0))
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
    any_kind(strip())
}

/// Linear tetrahedra as elements of any number of nodes.
fn any_kind((nodes, corners): (Vec<DVec3>, Vec<[u32; 4]>)) -> (Vec<DVec3>, Vec<Vec<u32>>) {
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
        box_axis: None,
        vertices: set.map(str::to_owned),
        normal: Axis::Z,
        bedding_n_per_mm3: None,
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
    // Every way to write them brings the same ones, so that one of each order is solved.
    let linears = [
        ("msh", msh2(linear())),
        ("msh", msh4(linear())),
        ("inp", inp(linear())),
    ];
    let quadratics = [
        ("msh", msh2(quadratic(GMSH))),
        ("msh", msh4(quadratic(GMSH))),
        ("inp", inp(quadratic(ABAQUS))),
    ];
    for (files, is_linear) in [(linears, true), (quadratics, false)] {
        let [first, others @ ..] = files.map(|(ending, text)| read(ending, &text).unwrap());
        let of_first = first.mesh.volume().unwrap();
        for other in &others {
            let volume = other.mesh.volume().unwrap();
            assert_eq!(volume.tetrahedra, of_first.tetrahedra);
            assert_eq!(volume.nodes, of_first.nodes);
            assert_eq!(volume.from_linear, is_linear);
            assert_eq!(other.mesh.boundary_edges().count(), 0);
        }
        assert_eq!(first.mesh.boundary_edges().count(), 0);
        let (displacement, strain, notes) = answer(first, None);
        println!("{displacement:.4} {strain:.4} {notes:?}");
        assert!((displacement - 1.0).abs() < 0.01, "{displacement}");
        assert!((strain - 1.0).abs() < 0.02, "{strain}");
        let said = notes.iter().any(|n| n.contains("linear tetrahedra"));
        assert_eq!(said, is_linear);
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

/// A block 20 × 20 × 10 mm of linear tetrahedra as a small file.
fn block() -> (Vec<DVec3>, Vec<Vec<u32>>) {
    any_kind(bricks([2, 2, 1], DVec3::new(20.0, 20.0, 10.0)))
}

/// What was said of a file that is read.
fn notes(ending: &str, text: &str) -> String {
    read(ending, text).unwrap().repairs.notes.join("; ")
}

/// A file is refused with the line of what is wrong, and these words.
fn refused(ending: &str, text: &str, line: usize, words: &[&str]) {
    let said = read(ending, text).err().expect("the file is refused");
    let place = format!("line {line}");
    for word in words.iter().chain([&place.as_str()]) {
        assert!(said.contains(word), "{word} is not in: {said}");
    }
    assert!(said.chars().count() < 600, "{said}");
    assert!(said.chars().all(|c| !c.is_control()), "{said:?}");
}

/// The number of the first line that begins so.
fn line_of(text: &str, start: &str) -> usize {
    1 + text.lines().position(|l| l.starts_with(start)).unwrap()
}

/// The text with one line replaced, or with more than one in its place.
fn with_line(text: &str, line: usize, new: &str) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    lines[line - 1] = new;
    lines.join("\n") + "\n"
}

#[test]
fn counts_of_gmsh_that_do_not_fit_are_refused() {
    let good = msh2(block());
    assert_eq!(notes("msh", &good), "");
    let count = line_of(&good, "$Elements") + 1;
    refused(
        "msh",
        &with_line(&good, count, "20"),
        count + 21,
        &["20 elements", "goes on"],
    );
    refused(
        "msh",
        &with_line(&good, count, "30"),
        count,
        &["30 elements", "25"],
    );
    // Announced without end: nothing is taken before the lines are there.
    let endless = with_line(&good, count, &u64::MAX.to_string());
    refused("msh", &endless, count, &["announced"]);
    let nodes = line_of(&good, "$Nodes") + 1;
    refused(
        "msh",
        &with_line(&good, nodes, "17"),
        nodes + 18,
        &["17 nodes"],
    );
    let fourth = msh4(block());
    assert_eq!(notes("msh", &fourth), "");
    let head = line_of(&fourth, "$Elements") + 1;
    refused(
        "msh",
        &with_line(&fourth, head, "1 25 1 25"),
        head,
        &["25", "24"],
    );
    let block = with_line(&fourth, head + 1, "3 1 4 18446744073709551615");
    refused("msh", &block, head + 1, &["announced"]);
    let fewer = with_line(&fourth, head + 1, "3 1 4 23");
    refused("msh", &fewer, head, &["24", "23"]);
}

#[test]
fn what_gmsh_cannot_mean_is_refused_with_its_line() {
    let good = msh2(block());
    let first = line_of(&good, "$Elements") + 3;
    let bad = |line: &str, words: &[&str]| {
        refused("msh", &with_line(&good, first, line), first, words);
    };
    bad(
        "2 5 2 1 1 1001 1002 1005 1004 1010 1011 1014 1013",
        &["hexahedron", "tetrahedra"],
    );
    bad("2 93 2 1 1 1001", &["kind 93"]);
    bad("2 4 2 1 1 1001 1002", &["missing"]);
    bad("2 4 2 1 1 1001 1002 1005 1014 1015", &["“1015”"]);
    bad("2 4 2 1 1 1001 1002 1005 9014", &["9014", "not there"]);
    bad("2 4 2 1 1 1001 1002 1003 1004", &["no volume"]);
    bad("2 4 2 1 1 10\u{1b}[31m01 1002 1005 1014", &["damaged"]);
    let twice = with_line(&good, first, "3 4 2 1 1 1001 1002 1005 1014");
    refused("msh", &twice, first + 1, &["element 3", "second time"]);
    // On the same side of the face 1001, 1002, 1014 as its neighbour in the next line.
    let over = with_line(&good, first, "2 4 2 1 1 1001 1002 1014 1012");
    refused("msh", &over, first + 1, &["overlaps"]);
    refused(
        "msh",
        &with_line(&good, first - 5, "$Nodes"),
        first - 5,
        &["$Nodes"],
    );
    let twice = format!("{good}{}", &good[good.find("$Nodes").unwrap()..]);
    refused(
        "msh",
        &twice,
        good.lines().count() + 1,
        &["$Nodes", "second time"],
    );
}

#[test]
fn what_gmsh_files_hold_besides_is_noted() {
    let (nodes, mut elements) = block();
    elements.push(elements[3].clone());
    let said = notes("msh", &msh2((nodes, elements)));
    assert!(
        said.contains("1 tetrahedron is there a second time"),
        "{said}"
    );
    let good = msh2(block());
    let more = format!("{good}$NodeData\n1\n$EndNodeData\n");
    let said = notes("msh", &more);
    assert!(said.contains("“NodeData”"), "{said}");
}

#[test]
fn elements_of_abaqus_are_whole_and_known() {
    let good = inp(block());
    assert_eq!(notes("inp", &good), "");
    let set = line_of(&good, "*NSET");
    // The last element lies in two lines.
    let last = with_line(&good, set - 1, "");
    refused("inp", &last, set - 2, &["cut off", "2 of its 4 nodes"]);
    let first = line_of(&good, "*ELEMENT") + 1;
    let again = with_line(&good, first + 2, "1, 1001, 1002,");
    refused(
        "inp",
        &again,
        first + 2,
        &["element 1", "second time", &format!("line {first}")],
    );
    let long = with_line(&good, first + 1, "1005, 1014, 1015");
    refused("inp", &long, first + 1, &["6 values"]);
    let missing = with_line(&good, first + 1, "1005, 9999");
    refused("inp", &missing, first, &["9999", "not there"]);
    let shells = format!("{good}*ELEMENT, TYPE=S3, ELSET=skin\n900, 1001, 1002, 1005\n");
    let said = notes("inp", &shells);
    assert!(said.contains("“S3”") && said.contains("left out"), "{said}");
    let bricks = with_line(&good, first - 1, "*ELEMENT, TYPE=C3D8R");
    refused("inp", &bricks, first - 1, &["C3D8R", "tetrahedra"]);
    let none = with_line(&good, first - 1, "*ELEMENT, TYPE=S4");
    let said = read("inp", &none).err().unwrap();
    assert!(
        said.contains("no tetrahedra") && said.contains("“S4”"),
        "{said}"
    );
}

#[test]
fn what_abaqus_places_elsewhere_is_refused() {
    let good = inp(block());
    let node = line_of(&good, "*Node");
    let cases = [
        ("*NODE, SYSTEM=C", "Cartesian"),
        ("*NODE, INPUT=nodes.txt", "nodes.txt"),
        ("*INCLUDE, INPUT=mesh.inp", "another file"),
        ("*NGEN", "do not stand"),
        ("*SYSTEM", "*SYSTEM"),
    ];
    for (keyword, word) in cases {
        let said = read("inp", &with_line(&good, node, keyword)).err().unwrap();
        assert!(said.contains(word) && said.contains("line "), "{said}");
    }
    refused(
        "inp",
        &with_line(&good, node + 1, "1.7, 0, 0, 0"),
        node + 1,
        &["“1.7”"],
    );
    refused(
        "inp",
        &with_line(&good, node + 1, "1001, 0, nan, 0"),
        node + 1,
        &["“nan”"],
    );
    let element = line_of(&good, "*ELEMENT");
    let elsewhere = with_line(&good, element, "*ELEMENT, TYPE=C3D4, INPUT=e.txt");
    refused("inp", &elsewhere, element, &["e.txt"]);
    let damaged = with_line(&good, node + 3, "10\u{7}03, 20.0, 0, 0");
    refused("inp", &damaged, node + 3, &["damaged"]);
    refused(
        "inp",
        "1, 0, 0, 0\n*NODE\n",
        1,
        &["before the first keyword"],
    );
    let fortran = with_line(&good, node + 2, "1002, 1.0D+01, 0.D0, 0");
    let (_, upper) = read("inp", &fortran).unwrap().mesh.bounds();
    assert!((upper.x - 0.02).abs() < 1e-12, "{upper}");
}

#[test]
fn sets_of_abaqus_are_read_in_all_their_ways() {
    let good = inp(block());
    let count = |text: &str, set: &str| -> usize {
        let loaded = read("inp", text).unwrap();
        loaded.groups[set].iter().filter(|&&m| m).count()
    };
    // Nine nodes of a face and the sixteen between them.
    let range = format!("{good}*NSET, NSET=low, GENERATE\n1001, 1009\n");
    assert_eq!(count(&range, "low"), 25);
    // The face x = 0 has ten more, and the far corner comes with the middles of three edges.
    let named = format!("{range}*NSET, NSET=both\nlow, ROOT, 1018\n");
    assert_eq!(count(&named, "both"), 25 + 10 + 4);
    let elements = format!("{good}*NSET, NSET=whole, ELSET=body\n");
    assert_eq!(count(&elements, "whole"), count(&good, "all"));
    let again = format!("{range}*NSET, NSET=LOW\n1018\n");
    assert_eq!(count(&again, "low"), 25 + 4);
    let line = good.lines().count() + 2;
    refused(
        "inp",
        &format!("{good}*NSET, NSET=a\nnowhere\n"),
        line,
        &["“nowhere”"],
    );
    refused(
        "inp",
        &format!("{good}*NSET, NSET=a, GENERATE\n9, 1\n"),
        line,
        &["empty"],
    );
    let far = notes("inp", &format!("{good}*NSET, NSET=a\n1001, 77\n"));
    assert!(far.contains("“a” names 1 "), "{far}");
}

#[test]
fn ranges_without_end_cost_nothing() {
    let mut bomb = inp(block()) + "*NSET, NSET=bomb, GENERATE\n";
    for step in 0..5000 {
        let _ = writeln!(bomb, "1, 18446744073709551614, {}", 1 + step % 7);
    }
    let loaded = read("inp", &bomb).unwrap();
    assert!(loaded.groups["bomb"].iter().all(|&m| m));
    let said = loaded.repairs.notes.join("; ");
    assert!(said.contains("not there"), "{said}");
}

#[test]
fn tetrahedra_that_overlap_are_said() {
    let said = |elements: (Vec<DVec3>, Vec<[u32; 4]>)| {
        let loaded = read("msh", &msh2(any_kind(elements))).unwrap();
        let (_, _, notes) = answer(loaded, None);
        (
            notes.iter().any(|n| n.contains("within other elements")),
            notes,
        )
    };
    let (nodes, mut tetrahedra) = strip();
    let (overlaps, notes) = said((nodes.clone(), tetrahedra.clone()));
    assert!(!overlaps, "{notes:?}");
    // From two corners of the strip's middle to two others, through the elements between.
    let at = |i: u32, j: u32, k: u32| i + 41 * (j + 9 * k);
    let mut through = [at(20, 2, 0), at(24, 2, 0), at(20, 6, 0), at(20, 2, 1)];
    let [a, b, c, d] = through.map(|n| nodes[n as usize]);
    if (b - a).cross(c - a).dot(d - a) < 0.0 {
        through.swap(0, 1);
    }
    tetrahedra.push(through);
    let (overlaps, notes) = said((nodes, tetrahedra));
    assert!(overlaps, "{notes:?}");
}
