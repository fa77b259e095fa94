//! Input of solvers: the same part from every kind, what it says beside the mesh, and what is wrong with it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::DVec3;
use hapdef::cli;
use hapdef::io::mesh_file::{LoadedMesh, parse_mesh, read_mesh};
use hapdef::io::project_file;
use hapdef::mesh::repair::Repair;
use hapdef::mesh::volume::VolumeMesh;
use hapdef::project::{PartModel, SupportKind, Unit};

/// Bricks of the bar along it.
const BRICKS: u32 = 3;

/// A bar 6 × 2 × 2 of quadratic tetrahedra, one of whose nodes is bowed out by an eighth.
fn bar() -> VolumeMesh {
    let corner = |n: u32| DVec3::new(f64::from(n / 4), f64::from(n & 1), f64::from(n >> 1 & 1));
    let nodes: Vec<DVec3> = (0..4 * (BRICKS + 1)).map(|n| corner(n) * 2.0).collect();
    // Three steps from the first corner of a brick to the last, in every order.
    let ways = [[4, 1], [4, 2], [1, 4], [1, 2], [2, 4], [2, 1]];
    let of_brick = |brick: u32| ways.map(|[a, b]| [0, a, a + b, 7].map(|n| 4 * brick + n));
    let corners: Vec<[u32; 4]> = (0..BRICKS).flat_map(of_brick).collect();
    let mut bar = VolumeMesh::of_linear(nodes, &corners).checked().unwrap();
    let bowed = bar.tetrahedra[0][4] as usize;
    bar.nodes[bowed] += DVec3::new(0.0, 0.125, 0.0);
    bar
}

/// Nodes at the foot of the bar, numbered from one.
fn foot(bar: &VolumeMesh) -> Vec<usize> {
    let at_foot = |(_, p): &(usize, &DVec3)| p.x == 0.0;
    let found = (1..).zip(&bar.nodes).filter(at_foot);
    found.map(|(number, _)| number).collect()
}

/// Numbers in fields of a width, so many a line.
fn fields(numbers: &[usize], width: usize, a_line: usize) -> String {
    let mut text = String::new();
    for line in numbers.chunks(a_line) {
        for n in line {
            let _ = write!(text, "{n:width$}");
        }
        text.push('\n');
    }
    text
}

/// The nodes and elements of a deck.
fn blocks(bar: &VolumeMesh, end_of_nodes: &str) -> [String; 2] {
    let mut nodes = String::from("(1i9,3e20.9e3)\n");
    for (k, p) in (1..).zip(&bar.nodes) {
        let _ = writeln!(nodes, "{k:9}{:20.9E}{:20.9E}{:20.9E}", p.x, p.y, p.z);
    }
    nodes += end_of_nodes;
    let mut elements = String::from("(19i9)\n");
    for (k, t) in (1..).zip(&bar.tetrahedra) {
        let mut all = vec![1, 1, 1, 1, 0, 0, 0, 0, 10, 0, k];
        all.extend(t.map(|n| n as usize + 1));
        elements += &fields(&all, 9, 19);
    }
    elements += "-1\n";
    [nodes, elements]
}

/// As Mechanical writes it.
fn dat() -> String {
    let bar = bar();
    let [nodes, elements] = blocks(&bar, "-1\n");
    let foot = foot(&bar);
    let (count, list) = (foot.len(), fields(&foot, 10, 8));
    format!(
        "/batch\n/com,--- Data in consistent NMM units. See Solving Units.\n/units,MPA\n/prep7\nnblock,3,,{}\n{nodes}et,1,187\neblock,19,solid,,{}\n{elements}MP,DENS,1,9.3e-10,\t! tonne mm^-3\nMP,EX,1,1700,\t! MPa\nMP,NUXY,1,0.394,\nCMBLOCK,FOOT,NODE,{count:9}\n(8i10)\n{list}cmsel,s,FOOT\nd,all,all\nnsel,all\nsf,_load,pres,3\nfini\n/solu\nsolve\n",
        bar.nodes.len(),
        bar.tetrahedra.len()
    )
}

/// As CDWRITE writes it: each node held by itself, the component as a range.
fn cdb() -> String {
    let bar = bar();
    let [nodes, elements] = blocks(&bar, "N,R5.3,LOC,       -1,\n");
    let mut held = String::new();
    for node in foot(&bar) {
        for axis in ["UX", "UY", "UZ"] {
            let _ = writeln!(held, "D,{node:8},{axis}  ,  0.00000000    ,  0.00000000");
        }
    }
    let list = fields(&foot(&bar), 10, 8);
    format!(
        "/COM,ANSYS RELEASE\n*IF,_CDRDOFF,EQ,1,THEN\n_CDRDOFF=\nNUMOFF,NODE,{0}\n*ENDIF\nETBLOCK,        1,        1\n(2i9,19a9)\n        1      187        0\n       -1\nNBLOCK,6,SOLID,{0:9},{0:9}\n{nodes}EBLOCK,19,SOLID,{1:9},{1:9}\n{elements}CMBLOCK,FOOT    ,NODE,{2:9}  ! foot\n(8i10)\n{list}MPTEMP,R5.0, 1, 1,  0.00000000    ,\nMPDATA,R5.0, 1,EX  ,       1, 1,  1700.00000    ,\nMPDATA,R5.0, 1,PRXY,       1, 1, 0.394000000    ,\n{held}/GO\nFINISH\n",
        bar.nodes.len(),
        bar.tetrahedra.len(),
        foot(&bar).len(),
    )
}

fn inp() -> String {
    let bar = bar();
    let mut text = String::from("*NODE\n");
    for (k, p) in (1..).zip(&bar.nodes) {
        let _ = writeln!(text, "{k}, {}, {}, {}", p.x, p.y, p.z);
    }
    text += "*ELEMENT, TYPE=C3D10, ELSET=bar\n";
    for (k, t) in (1..).zip(&bar.tetrahedra) {
        let list = t.map(|n| (n + 1).to_string()).join(", ");
        let _ = writeln!(text, "{k}, {list}");
    }
    text += "*NSET, NSET=FOOT\n";
    for node in foot(&bar) {
        let _ = writeln!(text, "{node},");
    }
    text + "*MATERIAL, NAME=PA\n*ELASTIC\n1700., 0.394\n*BOUNDARY\nFOOT, 1, 3\n"
}

/// Gmsh's order of the ten nodes.
const GMSH: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];

/// Curved triangles at the foot of the bar.
fn foot_triangles(bar: &VolumeMesh) -> Vec<[u64; 6]> {
    const FACES: [[usize; 6]; 4] = [
        [0, 2, 1, 6, 5, 4],
        [0, 1, 3, 4, 8, 7],
        [1, 2, 3, 5, 9, 8],
        [0, 3, 2, 7, 9, 6],
    ];
    let faces = (bar.tetrahedra.iter()).flat_map(|t| FACES.map(|face| face.map(|k| t[k])));
    let at_foot = |face: &[u32; 6]| face.iter().all(|&n| bar.nodes[n as usize].x == 0.0);
    let found = faces.filter(at_foot);
    found.map(|face| face.map(|n| u64::from(n) + 1)).collect()
}

/// A binary file of Gmsh, its numbers in the order of bytes that is asked for.
struct Binary {
    bytes: Vec<u8>,
    big: bool,
}

impl Binary {
    fn put<const N: usize>(&mut self, mut bytes: [u8; N]) {
        if self.big {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
    }

    fn ints(&mut self, all: &[i32]) {
        for n in all {
            self.put(n.to_le_bytes());
        }
    }

    fn sizes(&mut self, all: &[u64]) {
        for n in all {
            self.put(n.to_le_bytes());
        }
    }

    fn numbers(&mut self, all: &[f64]) {
        for x in all {
            self.put(x.to_le_bytes());
        }
    }

    fn text(&mut self, text: &str) {
        self.bytes.extend(text.bytes());
    }
}

fn msh_binary(big: bool) -> Vec<u8> {
    let bar = bar();
    let mut file = Binary {
        bytes: Vec::new(),
        big,
    };
    file.text("$MeshFormat\n4.1 1 8\n");
    file.ints(&[1]);
    file.text(
        "\n$EndMeshFormat\n$PhysicalNames\n2\n2 7 \"FOOT\"\n3 9 \"bar\"\n$EndPhysicalNames\n",
    );
    file.text("$Entities\n");
    file.sizes(&[0, 0, 1, 1]);
    for (entity, group) in [(3, 7), (1, 9)] {
        file.ints(&[entity]);
        file.numbers(&[0.0; 6]);
        file.sizes(&[1]);
        file.ints(&[group]);
        file.sizes(&[0]);
    }
    file.text("\n$EndEntities\n$Nodes\n");
    let count = bar.nodes.len() as u64;
    file.sizes(&[1, count, 1, count]);
    file.ints(&[3, 1, 0]);
    file.sizes(&[count]);
    for k in 1..=count {
        file.sizes(&[k]);
    }
    for p in &bar.nodes {
        file.numbers(&p.to_array());
    }
    file.text("\n$EndNodes\n$Elements\n");
    let triangles = foot_triangles(&bar);
    let (few, many) = (triangles.len() as u64, bar.tetrahedra.len() as u64);
    file.sizes(&[2, few + many, 1, few + many]);
    file.ints(&[2, 3, 9]);
    file.sizes(&[few]);
    for (k, triangle) in (1..).zip(&triangles) {
        file.sizes(&[k]);
        file.sizes(triangle);
    }
    file.ints(&[3, 1, 11]);
    file.sizes(&[many]);
    for (k, t) in (few + 1..).zip(&bar.tetrahedra) {
        file.sizes(&[k]);
        file.sizes(&GMSH.map(|n| u64::from(t[n]) + 1));
    }
    file.text("\n$EndElements\n");
    file.bytes
}

/// The bar as text of Gmsh, version 2.2.
fn msh_second() -> String {
    let bar = bar();
    let mut text = String::from(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 7 \"FOOT\"\n$EndPhysicalNames\n$Nodes\n",
    );
    let _ = writeln!(text, "{}", bar.nodes.len());
    for (k, p) in (1..).zip(&bar.nodes) {
        let _ = writeln!(text, "{k} {} {} {}", p.x, p.y, p.z);
    }
    let triangles = foot_triangles(&bar);
    let count = triangles.len() + bar.tetrahedra.len();
    let _ = writeln!(text, "$EndNodes\n$Elements\n{count}");
    for (k, triangle) in (1..).zip(&triangles) {
        let list = triangle.map(|n| n.to_string()).join(" ");
        let _ = writeln!(text, "{k} 9 2 7 3 {list}");
    }
    for (k, t) in (triangles.len() + 1..).zip(&bar.tetrahedra) {
        let list = GMSH.map(|n| (t[n] + 1).to_string()).join(" ");
        let _ = writeln!(text, "{k} 11 2 0 1 {list}");
    }
    text + "$EndElements\n"
}

fn parsed(ending: &str, bytes: &[u8]) -> Result<LoadedMesh, String> {
    parse_mesh(bytes, ending, None, 1e-3, 0, &Repair::default())
}

fn notes(loaded: &LoadedMesh) -> String {
    loaded.repairs.notes.join("; ")
}

#[test]
fn the_same_part_is_read_from_every_deck() {
    let files: [(&str, Vec<u8>); 6] = [
        ("dat", dat().into()),
        ("cdb", cdb().into()),
        ("inp", inp().into()),
        ("msh", msh_second().into()),
        ("msh", msh_binary(false)),
        ("msh", msh_binary(true)),
    ];
    let first = parsed("dat", &files[0].1).unwrap();
    let volume = first.mesh.volume().unwrap();
    assert_eq!(volume.tetrahedra.len(), 6 * BRICKS as usize);
    // Nine nodes on a face of two triangles.
    let held = first.groups["FOOT"].iter().filter(|&&m| m).count();
    assert_eq!(held, 9);
    for (k, (ending, bytes)) in files.iter().enumerate() {
        let loaded = parsed(ending, bytes).unwrap_or_else(|e| panic!("{k}: {e}"));
        assert_eq!(loaded.mesh.volume(), Some(volume), "{k}");
        assert_eq!(loaded.groups["FOOT"], first.groups["FOOT"], "{k}");
        assert_eq!(loaded.found.model, Some(PartModel::Solid));
        if *ending == "msh" {
            assert_eq!(notes(&loaded), "");
            continue;
        }
        let material = loaded.found.material.as_ref().unwrap();
        assert!((material.youngs_modulus_gpa - 1.7).abs() < 1e-12);
        assert_eq!(material.poissons_ratio, 0.394);
        let [support] = &loaded.found.supports[..] else {
            panic!("{k}: {:?}", loaded.found.supports);
        };
        assert_eq!(support.kind, SupportKind::Clamped);
        assert_eq!(support.vertices.as_deref(), Some("FOOT"));
    }
    let all = parsed("msh", &files[4].1).unwrap();
    assert!(all.groups["bar"].iter().all(|&m| m));
}

#[test]
fn what_a_support_would_hold_within_the_part_is_noted() {
    // The middle of a brick's diagonal.
    let within = |p: &DVec3| *p == DVec3::ONE;
    let number = 1 + bar().nodes.iter().position(within).unwrap();
    let text = inp().replace("*MATERIAL", &format!("{number},\n*MATERIAL"));
    let loaded = parsed("inp", text.as_bytes()).unwrap();
    assert_eq!(
        notes(&loaded),
        "“FOOT”: 1 of its 10 nodes lie inside the part, where nothing is held: only its surface is"
    );
    assert_eq!(notes(&parsed("inp", inp().as_bytes()).unwrap()), "");
}

#[test]
fn commands_may_stand_by_themselves() {
    let bar = bar();
    let mut text = String::from("/units,mpa $ *set,tid,4\net,tid,187 $ type,tid\nmat,2\n");
    for (k, p) in (1..).zip(&bar.nodes) {
        let _ = writeln!(text, "n,{k},{},{},{}", p.x, p.y, p.z);
    }
    for t in &bar.tetrahedra {
        let list = t.map(|n| (n + 1).to_string());
        let (eight, two) = list.split_at(8);
        let _ = writeln!(text, "e,{}\nemore,{}", eight.join(","), two.join(","));
    }
    text += "mp,ex,2,2100 $ mp,prxy,2,0.4\nnsel,s,loc,x,0\ncm,foot,node\nd,all,ux\nd,all,uy\nd,all,uz\nallsel\nnsel,s,loc,x,6\nd,all,uy,0\n";
    let loaded = parsed("dat", text.as_bytes()).unwrap();
    let same = parsed("dat", dat().as_bytes()).unwrap();
    assert_eq!(loaded.mesh.volume(), same.mesh.volume());
    assert_eq!(loaded.groups["foot"], same.groups["FOOT"]);
    let kinds: Vec<SupportKind> = loaded.found.supports.iter().map(|s| s.kind).collect();
    assert_eq!(kinds, [SupportKind::Clamped, SupportKind::Symmetry]);
    assert_eq!(loaded.found.unit, Some(Unit::Millimetre));
    assert_eq!(notes(&loaded), "");
}

/// A file in a folder of its own.
fn file(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

#[test]
fn a_project_takes_from_the_deck_what_it_leaves_out() {
    let (folder, deck) = file("ds.dat", &dat());
    let load = |text: &str| {
        let path = folder.path().join("p.hapdef.toml");
        std::fs::write(&path, text).unwrap();
        project_file::load(&path).unwrap_or_else(|e| panic!("{e}"))
    };
    let short = "format = 1\npart = { mesh = \"ds.dat\" }\n";
    let loaded = load(short);
    let project = &loaded.inputs.project;
    assert_eq!(project.part.unit, Some(Unit::Millimetre));
    assert_eq!(project.part.model, PartModel::Solid);
    assert_eq!(project.material.youngs_modulus_gpa, 1.7);
    assert_eq!(project.supports.len(), 1);
    assert!(project.supports(&loaded.inputs.masks).is_ok());
    let said = loaded.repairs.notes.join("; ");
    assert!(
        said.contains("taken from the mesh file") && said.contains("“FOOT”"),
        "{said}"
    );
    // The same without a project.
    let alone = cli::open(&deck, None).unwrap();
    assert_eq!(alone.inputs.project, loaded.inputs.project);
    // What is saved says it all, and reads back the same.
    let text = project_file::to_text(project);
    assert_eq!(load(&text).inputs.project, *project);
    let own = format!(
        "{short}material = {{ youngs_modulus_gpa = 3.0 }}\n[[support]]\nbox_mm = [[0, 0, 0], [1, 2, 2]]\n"
    );
    let loaded = load(&own);
    let project = &loaded.inputs.project;
    assert_eq!(project.material.youngs_modulus_gpa, 3.0);
    assert_eq!(project.material.poissons_ratio, 0.394);
    assert!(project.supports.len() == 1 && project.supports[0].vertices.is_none());
}

#[test]
fn the_unit_is_said_by_the_file_or_the_user() {
    let read = |text: &str, unit: Option<Unit>| {
        let (_keep, path) = file("ds.dat", text);
        read_mesh(&path, unit, 0, Repair::default()).map_err(|e| e.to_string())
    };
    let length = |loaded: &LoadedMesh| {
        let (low, high) = loaded.mesh.bounds();
        high.x - low.x
    };
    assert!((length(&read(&dat(), None).unwrap()) - 0.006).abs() < 1e-12);
    let given = read(&dat(), Some(Unit::Metre)).unwrap();
    assert!((length(&given) - 6.0).abs() < 1e-12);
    assert!(
        notes(&given).contains("in mm (line 2)"),
        "{}",
        notes(&given)
    );
    let none = dat().replace("/units,MPA\n", "").replace("NMM", "some");
    let said = read(&none, None).err().unwrap();
    assert!(said.contains("--unit"), "{said}");
    assert!(read(&none, Some(Unit::Millimetre)).is_ok());
    let two = dat().replace("/units,MPA", "/units,MKS");
    let said = read(&two, None).err().unwrap();
    assert!(said.contains("line 3") && said.contains("line 2"), "{said}");
    // Millimetres in a file that says metres.
    let far = dat()
        .replace("NMM", "MKS")
        .replace("/units,MPA", "/units,MKS")
        .replace("E0", "E2");
    let said = read(&far, None).err().unwrap();
    assert!(
        said.contains("600000 mm") && said.contains("--unit"),
        "{said}"
    );
    assert!(read(&far, Some(Unit::Millimetre)).is_ok());
}

/// The number of the first line that begins so.
fn line_of(text: &str, start: &str) -> usize {
    1 + text.lines().position(|l| l.starts_with(start)).unwrap()
}

/// The text without some lines from one on.
fn without(text: &str, from: usize, count: usize) -> String {
    let gone = from..from + count;
    let lines = (1..).zip(text.lines());
    let kept: Vec<&str> = lines
        .filter(|(k, _)| !gone.contains(k))
        .map(|(_, line)| line)
        .collect();
    kept.join("\n") + "\n"
}

#[test]
fn what_cannot_be_right_is_refused_in_words() {
    let good = dat();
    let refused = |text: &str, words: &[&str]| {
        let said = parsed("dat", text.as_bytes()).err().expect("it is refused");
        for word in words {
            assert!(said.contains(word), "{word} is not in: {said}");
        }
        assert!(said.chars().count() < 600, "{said}");
    };
    let elements = line_of(&good, "eblock");
    let contact = good.replace("et,1,187", "et,1,174");
    refused(
        &contact,
        &["no tetrahedra", "“CONTA174” (18, first in line"],
    );
    let hexahedra = good.replace("et,1,187", "et,1,186");
    refused(
        &hexahedra,
        &[
            "SOLID186",
            "tetrahedra",
            &format!("line {}, element 1", elements + 2),
        ],
    );
    refused(&good.replace("et,1,187\n", ""), &["type 1", "ET"]);
    refused(&good.replace("et,1,187", "et,1,steel"), &["“steel”"]);
    let format = good.replace("(1i9,3e20.9e3)", "(9I,3E20)");
    refused(
        &format,
        &["“(9I,3E20)”", &format!("line {}", line_of(&good, "(1i9"))],
    );
    refused(&good.replace("(19i9)", "eblock"), &["“eblock”", "format"]);
    // Cut in an element, between elements, and among nodes.
    let cut = |line: usize| -> String { without(&good, line, usize::MAX / 2) };
    refused(&cut(elements + 3), &["cut off: 8 of its 10 nodes"]);
    refused(
        &cut(elements + 4),
        &["announces 18 elements, and 1 are there"],
    );
    refused(&cut(line_of(&good, "nblock") + 9), &["NBLOCK", "cut"]);
    refused(&cut(line_of(&good, "nblock") + 1), &["cut after NBLOCK"]);
    let list = line_of(&good, "CMBLOCK") + 2;
    refused(
        &without(&good, list, 1),
        &["CMBLOCK announces 9", "1 are there"],
    );
    let gone = without(&good, line_of(&good, "nblock") + 5, 1);
    refused(&gone, &["names node 4, which is not there"]);
    let twice = good.replace("        4 ", "        5 ");
    refused(&twice, &["node 5 is there a second time"]);
    refused("*NODE\n1, 0, 0, 0\n", &["no nodes"]);
    refused(
        &good.replace("et,1,187", "ngen,2,5\net,1,187"),
        &["NGEN", "CDWRITE"],
    );
    let looped = good.replace("et,1,187", "*do,i,1,3\nn,i,0,0,0\n*enddo\net,1,187");
    refused(&looped, &["loop"]);
}

#[test]
fn more_nodes_than_memory_bears_are_refused_before_they_are_taken() {
    let many = cdb().replace("NBLOCK,6,SOLID,", "NBLOCK,6,SOLID,10000000,10000000,");
    let said = parsed("cdb", many.as_bytes()).err().unwrap();
    assert!(
        said.contains("10000000 nodes") && said.contains("--memory-gb"),
        "{said}"
    );
    let some = cdb().replace("NBLOCK,6,SOLID,", "NBLOCK,6,SOLID,1000,1000,");
    let said = parsed("cdb", some.as_bytes()).err().unwrap();
    assert!(said.contains("announces 1000 nodes"), "{said}");
    // The largest number is no count; what is far below it is said.
    let high = dat().replace("nblock,3,,", "nblock,3,,10000000,,");
    let loaded = parsed("dat", high.as_bytes()).unwrap();
    assert!(
        notes(&loaded).contains("up to 10000000"),
        "{}",
        notes(&loaded)
    );
}

#[test]
fn what_is_not_read_is_listed_once() {
    let contact = "et,2,174\ntype,2\neblock,10,,,2\n(15i9)\n       91        2        2        2        0        1        2        4\n       92        2        2        2        0        1        2        4\n-1\n";
    let more = "f,FOOT,fx,3\nf,FOOT,fy,3\nrlblock,1,1,1\n(2i8,6g16.9)\n       1       1 2.0\nd,1,temp,20\n";
    let text = dat().replace("et,1,187", &format!("{contact}{more}et,1,187"));
    let loaded = parsed("dat", text.as_bytes()).unwrap();
    let said = notes(&loaded);
    for word in [
        "2 elements are left out",
        "“CONTA174” (2, first in line",
        "“F” (2, first in line",
        "“RLBLOCK” (line",
        "“D” (line",
        "“SF” (line",
        "“MP,DENS” (line",
    ] {
        assert!(said.contains(word), "{word} is not in: {said}");
    }
    assert!(
        !said.contains("“FINI”") && !said.contains("belong to no command"),
        "{said}"
    );
    let none = dat().replace("MP,EX,1,1700,", "");
    let loaded = parsed("dat", none.as_bytes()).unwrap();
    assert_eq!(loaded.found.material, None);
    assert!(notes(&loaded).contains("no material"), "{}", notes(&loaded));
}

#[test]
fn shells_have_a_thickness() {
    let mut text = String::from(
        "/units,MPA\net,1,181\net,2,SHELL281\nsectype,3,shell\nsecdata,1.25,1\nsecdata,0.75,1\nsecnum,3\n",
    );
    for k in 0..9 {
        let _ = writeln!(text, "n,{},{},{}", k + 1, 10 * (k % 3), 10 * (k / 3));
    }
    text += "e,1,2,5,4\ne,2,3,6,5\ntype,1\ne,4,5,8,8\nnsel,s,node,,1,7,3\ncm,rim,node\nd,all,all\nnsel,all\n";
    let loaded = parsed("dat", text.as_bytes()).unwrap();
    assert_eq!(loaded.mesh.triangles().len(), 5);
    assert_eq!(loaded.found.thickness_mm, Some(2.0));
    assert_eq!(loaded.found.model, None);
    assert_eq!(loaded.found.supports[0].vertices.as_deref(), Some("rim"));
    // Node 7 belongs to no shell.
    assert_eq!(loaded.groups["rim"].iter().filter(|&&m| m).count(), 2);
}

#[test]
fn bent_edges_are_straightened_and_said() {
    let mut bar = bar();
    // So near to its end that the edge turns back there.
    let [a, b] = [0, 1].map(|k| bar.nodes[bar.tetrahedra[0][k] as usize]);
    let bent = bar.tetrahedra[0][4] as usize;
    bar.nodes[bent] = a.lerp(b, 0.125);
    let [nodes, elements] = blocks(&bar, "-1\n");
    let text = format!("nblock,3\n{nodes}et,1,187\neblock,19,solid,,18\n{elements}");
    let loaded = parsed("dat", text.as_bytes()).unwrap();
    let said = notes(&loaded);
    let shift = a.distance(b) * (0.5 - 0.125);
    assert!(said.contains("1 edge was straightened"), "{said}");
    assert!(
        said.contains(&format!("by {shift:.2} mm at most")),
        "{said}"
    );
    let volume = loaded.mesh.volume().unwrap();
    let middle = a.midpoint(b) * 1e-3;
    assert!(volume.nodes.iter().any(|p| p.distance(middle) < 1e-12));
    let tight = Repair {
        straighten: 1e-4,
        ..Repair::default()
    };
    let said = parse_mesh(text.as_bytes(), "dat", None, 1e-3, 0, &tight);
    let said = said.err().unwrap();
    let line = line_of(&text, "eblock") + 2;
    assert!(
        said.starts_with(&format!("line {line}, element 1: ")),
        "{said}"
    );
    assert!(said.contains("part.straighten_mm"), "{said}");
}

#[test]
fn damaged_binary_files_are_refused_with_the_byte() {
    let good = msh_binary(false);
    for cut in (30..good.len() - 12).step_by(7) {
        let said = parsed("msh", &good[..cut]).err().expect("it is cut");
        assert!(said.chars().all(|c| !c.is_control()), "{said:?}");
    }
    let mut count = good.clone();
    let nodes = good.windows(7).position(|w| w == b"$Nodes\n").unwrap() + 7;
    count[nodes + 8..nodes + 16].copy_from_slice(&u64::MAX.to_le_bytes());
    let said = parsed("msh", &count).err().unwrap();
    let place = format!("byte {nodes}");
    assert!(
        said.contains("announced") && said.contains(&place),
        "{said}"
    );
    let mut order = good;
    order[20..24].copy_from_slice(&[9; 4]);
    let said = parsed("msh", &order).err().unwrap();
    assert!(said.contains("order of bytes"), "{said}");
}

#[test]
fn the_deck_of_the_paper_is_read_as_it_is() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/paper-limb");
    let path = folder.join("ds.dat");
    if crate::is_missing(&path) {
        return;
    }
    let loaded = read_mesh(&path, None, 0, Repair::default()).unwrap();
    let said = notes(&loaded);
    println!("{said}");
    let volume = loaded.mesh.volume().unwrap();
    assert_eq!(
        (volume.nodes.len(), volume.tetrahedra.len()),
        (22_284, 10_729)
    );
    // What an independent program finds: 254, and one whose determinant there is zero but for rounding.
    assert!(said.contains("255 tetrahedra"), "{said}");
    assert!(said.contains("189 edges"), "{said}");
    assert!(said.contains("1.12 mm"), "{said}");
    let found = &loaded.found;
    assert_eq!(found.unit, Some(Unit::Metre));
    let material = found.material.as_ref().unwrap();
    assert_eq!(
        (material.youngs_modulus_gpa, material.poissons_ratio),
        (1.7, 0.394)
    );
    assert_eq!(found.supports.len(), 1);
    assert_eq!(found.supports[0].vertices.as_deref(), Some("_FIXEDSU"));
    let fixed = &loaded.groups["_FIXEDSU"];
    assert_eq!(fixed.iter().filter(|&&m| m).count(), 208);
    let other = read_mesh(
        &folder.join("limb.inp"),
        Some(Unit::Metre),
        0,
        Repair::default(),
    );
    let other = other.unwrap();
    assert_eq!(other.mesh.volume(), Some(volume));
    assert_eq!(other.groups["FIXED"], *fixed);
    assert_eq!(other.found.material, found.material);
}

#[test]
fn a_deck_that_speaks_of_a_material_and_has_none_says_so() {
    let said = |text: &str| {
        let loaded = parsed("inp", text.as_bytes()).unwrap();
        notes(&loaded).contains("no elastic constants")
    };
    let whole = inp();
    let start = line_of(&whole, "*ELASTIC");
    let bare = without(&whole, start, 2);
    assert!(!said(&whole));
    assert!(said(&format!("{bare}\n*MATERIAL, NAME=A\n")));
    assert!(said(&format!(
        "{bare}\n*SOLID SECTION, ELSET=ALL, MATERIAL=A\n"
    )));
}
