//! A link of a robot's description (URDF) as a mesh: its visual mesh, or the one that collides, scaled and moved into the link's
//! frame, in metres.
//!
//! A link is named behind the file, `robot.urdf#shin`; a description with one mesh needs no name.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use glam::{DMat3, DVec3};
use roxmltree::{Document, Node};

use super::super::source;
use super::soup::Soup;
use super::{FileError, parsed};
use crate::workshop::turn_of;

/// Folders in which packages are looked for beside those above the description: what was asked for when the program was begun.
static PACKAGES: OnceLock<Vec<PathBuf>> = OnceLock::new();

/// Says where packages are looked for, once.
pub fn look_in(folders: Vec<PathBuf>) {
    let _ = PACKAGES.set(folders);
}

/// The description and the link that a path names, if it names one.
#[must_use]
pub fn named(path: &Path) -> Option<(PathBuf, Option<String>)> {
    let text = path.to_str()?;
    let lower = text.to_ascii_lowercase();
    if lower.ends_with(".urdf") {
        return Some((path.to_owned(), None));
    }
    let at = lower.rfind(".urdf#")?;
    let (file, link) = text.split_at(at + ".urdf".len());
    Some((PathBuf::from(file), Some(link[1..].to_owned())))
}

/// The name of the link that a path is of.
#[must_use]
pub fn link_of(path: &Path) -> Option<String> {
    named(path)?.1
}

/// A link's mesh.
struct Shape {
    link: String,
    file: String,
    scale: DVec3,
    shift: DVec3,
    turn: DMat3,
}

/// Reads the mesh of a link.
pub(super) fn read(urdf: &Path, link: Option<&str>) -> Result<Soup, FileError> {
    let text = source::read_text(urdf)?;
    let refuse = |m: String| FileError::broken(urdf, m);
    let shapes = shapes(&text).map_err(refuse)?;
    let shape = chosen(&shapes, link).map_err(refuse)?;
    let mesh = located(urdf, &shape.file).map_err(refuse)?;
    let ending = super::ending(&mesh);
    if !super::ENDINGS.contains(&ending.as_str()) {
        return Err(refuse(format!(
            "the mesh of the link “{}” is {}, which is not read: convert it to STL, OBJ or GLB, and name that in the description",
            shape.link, shape.file
        )));
    }
    let bytes = source::read(&mesh)?;
    let soup = parsed(&bytes, &ending, mesh.parent()).map_err(|m| FileError::broken(&mesh, m))?;
    if soup.volume.is_some() {
        return Err(FileError::broken(
            &mesh,
            "tetrahedra are no mesh of a link: name a surface",
        ));
    }
    Ok(placed(soup, shape))
}

fn placed(mut soup: Soup, shape: &Shape) -> Soup {
    for p in &mut soup.positions {
        *p = shape.turn * (shape.scale * *p) + shape.shift;
    }
    if (shape.scale.x * shape.scale.y * shape.scale.z) < 0.0 {
        for tri in &mut soup.triangles {
            tri.swap(1, 2);
        }
    }
    soup.notes.push(format!(
        "the link “{}” of a robot, in its own frame: {}",
        shape.link, shape.file
    ));
    soup
}

/// All links with a mesh: what is seen where there is one, else what collides.
fn shapes(text: &str) -> Result<Vec<Shape>, String> {
    let document = Document::parse(text).map_err(|e| format!("this is no XML: {e}"))?;
    let root = document.root_element();
    if !root.has_tag_name("robot") {
        return Err(format!(
            "a robot's description begins with <robot>, and this with <{}>",
            root.tag_name().name()
        ));
    }
    let mut shapes = Vec::new();
    for link in root.children().filter(|n| n.has_tag_name("link")) {
        let of = |kind: &str| {
            let mut all = link.children().filter(|n| n.has_tag_name(kind));
            all.find_map(|n| shape(&link, &n).transpose())
        };
        if let Some(shape) = of("visual").or_else(|| of("collision")) {
            shapes.push(shape?);
        }
    }
    Ok(shapes)
}

fn shape(link: &Node, of: &Node) -> Result<Option<Shape>, String> {
    let child = |node: &Node, name: &str| {
        node.children()
            .find(|n| n.has_tag_name(name))
            .map(|n| n.id())
    };
    let document = link.document();
    let get = |id| document.get_node(id);
    let mesh = child(of, "geometry")
        .and_then(get)
        .and_then(|g| child(&g, "mesh"))
        .and_then(get);
    let Some(mesh) = mesh else { return Ok(None) };
    let name = link.attribute("name").unwrap_or_default().to_owned();
    let three = |node: Option<Node>, key: &str, usual: DVec3| -> Result<DVec3, String> {
        let Some(text) = node.and_then(|n| n.attribute(key)) else {
            return Ok(usual);
        };
        let numbers: Vec<f64> = text
            .split_whitespace()
            .filter_map(|w| w.parse().ok())
            .collect();
        match numbers[..] {
            [x, y, z] if numbers.iter().all(|v| v.is_finite()) => Ok(DVec3::new(x, y, z)),
            _ => Err(format!(
                "{key}=\"{text}\" of the link “{name}” is not three numbers"
            )),
        }
    };
    let origin = child(of, "origin").and_then(get);
    let scale = three(Some(mesh), "scale", DVec3::ONE)?;
    if scale.abs().min_element() <= 0.0 {
        return Err(format!(
            "the mesh of the link “{name}” is scaled to nothing"
        ));
    }
    Ok(Some(Shape {
        file: mesh.attribute("filename").unwrap_or_default().to_owned(),
        scale,
        shift: three(origin, "xyz", DVec3::ZERO)?,
        turn: turn_of(three(origin, "rpy", DVec3::ZERO)?.to_array()),
        link: name,
    }))
}

fn chosen<'a>(shapes: &'a [Shape], link: Option<&str>) -> Result<&'a Shape, String> {
    let names = || {
        let names: Vec<&str> = shapes.iter().map(|s| s.link.as_str()).collect();
        names.join(", ")
    };
    match (link, shapes) {
        (_, []) => Err("none of its links has a mesh".into()),
        (None, [only]) => Ok(only),
        (None, _) => Err(format!(
            "say which link is the limb, behind the file's name: robot.urdf#LINK, of {}",
            names()
        )),
        (Some(link), _) => {
            let found = shapes.iter().find(|s| s.link == link);
            found.ok_or_else(|| {
                format!("it has no link “{link}” with a mesh: there are {}", names())
            })
        }
    }
}

/// Where a mesh lies that a description names.
fn located(urdf: &Path, name: &str) -> Result<PathBuf, String> {
    /// Folders above the description that packages are looked for in.
    const ABOVE: usize = 6;
    let folder = urdf.parent().unwrap_or(Path::new("."));
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let mut tried: Vec<PathBuf> = Vec::new();
    let package = name
        .strip_prefix("package://")
        .or_else(|| name.strip_prefix("model://"));
    if let Some(inside) = package {
        let within = inside.split_once('/').map_or(inside, |(_, rest)| rest);
        let asked = PACKAGES.get().into_iter().flatten().cloned();
        let known = std::env::var_os("ROS_PACKAGE_PATH");
        let known = known
            .iter()
            .flat_map(std::env::split_paths)
            .collect::<Vec<_>>();
        let above = folder.ancestors().take(ABOVE).map(Path::to_owned);
        for root in asked.chain(known).chain(above) {
            tried.push(root.join(inside));
            tried.push(root.join(within));
        }
    } else {
        let plain = name.strip_prefix("file://").unwrap_or(name);
        tried.push(folder.join(plain));
    }
    tried
        .iter()
        .find(|path| path.is_file())
        .cloned()
        .ok_or_else(|| {
            format!(
                "its mesh {name} is not there{}",
                if package.is_some() {
                    ": name the folder of the package with --package-path"
                } else {
                    ""
                }
            )
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT: &str = r#"<?xml version="1.0"?><robot name="r">
        <link name="base"/>
        <link name="thigh"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
        <link name="shin"><visual><origin xyz="0 0 0.1" rpy="0 0 1.5707963267948966"/>
          <geometry><mesh filename="package://r_description/meshes/shin.stl" scale="0.001 0.001 -0.001"/></geometry></visual></link>
        <link name="foot"><collision><geometry><mesh filename="foot.dae"/></geometry></collision></link></robot>"#;

    fn tetrahedron() -> String {
        let corners = [[0, 0, 0], [30, 0, 0], [0, 20, 0], [0, 0, 10]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let mut text = String::from("solid t\n");
        for face in faces {
            text.push_str("facet normal 0 0 0\nouter loop\n");
            for k in face {
                let [x, y, z]: [i32; 3] = corners[k];
                text.push_str(&format!("vertex {x} {y} {z}\n"));
            }
            text.push_str("endloop\nendfacet\n");
        }
        text + "endsolid t\n"
    }

    #[test]
    fn a_link_is_read_in_its_own_frame() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("r_description/meshes")).unwrap();
        std::fs::create_dir_all(at("r_description/urdf")).unwrap();
        std::fs::write(at("r_description/meshes/shin.stl"), tetrahedron()).unwrap();
        let urdf = at("r_description/urdf/r.urdf");
        std::fs::write(&urdf, ROBOT).unwrap();
        let named = |link: &str| PathBuf::from(format!("{}#{link}", urdf.display()));
        let read = |path: &Path| {
            super::super::read_mesh(path, None, 0, crate::mesh::repair::Repair::default())
        };
        let loaded = read(&named("shin")).unwrap();
        let (low, high) = loaded.mesh.bounds();
        // Mirrored in z, turned by a right angle, and lifted.
        assert!(
            (low - DVec3::new(-0.02, 0.0, 0.09)).length() < 1e-9,
            "{low}"
        );
        assert!(
            (high - DVec3::new(0.0, 0.03, 0.1)).length() < 1e-9,
            "{high}"
        );
        assert!(loaded.mesh.volume_enclosed() > 0.0);
        let refused = |path: &Path| read(path).err().unwrap().to_string();
        assert!(
            refused(&urdf).contains("robot.urdf#LINK, of shin, foot"),
            "{}",
            refused(&urdf)
        );
        assert!(refused(&named("arm")).contains("no link “arm”"));
        assert!(refused(&named("foot")).contains("foot.dae is not there"));
        std::fs::write(at("r_description/urdf/foot.dae"), "<COLLADA/>").unwrap();
        assert!(
            refused(&named("foot")).contains("convert it"),
            "{}",
            refused(&named("foot"))
        );
        std::fs::write(&urdf, ROBOT.replace("0 0 0.1", "0 0")).unwrap();
        assert!(refused(&named("shin")).contains("three numbers"));
        std::fs::write(&urdf, "<sdf/>").unwrap();
        assert!(refused(&named("shin")).contains("begins with <robot>"));
    }
}
