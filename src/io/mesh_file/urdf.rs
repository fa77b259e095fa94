//! A link of a robot's description (URDF) as a mesh: its visual mesh, or the one that collides, scaled and moved into the link's
//! frame, in metres.
//!
//! A link is named behind the file, `robot.urdf#shin`; a description with one mesh needs no name.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use glam::{DMat3, DVec3};
use roxmltree::{Document, Node};

use super::super::{FileError, source};
use super::soup::Soup;
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
    let ending = path.extension().unwrap_or_default();
    if ending.eq_ignore_ascii_case("urdf") {
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
struct LinkMesh {
    link: String,
    file: String,
    scale: DVec3,
    shift: DVec3,
    turn: DMat3,
}

/// A link's mesh: the file, and how it lies in the link's frame.
pub(super) struct Link {
    pub mesh: PathBuf,
    shape: LinkMesh,
}

/// The mesh of a link, as the description says.
pub(super) fn find(urdf: &Path, link: Option<&str>) -> Result<Link, FileError> {
    let text = source::read_text(urdf)?;
    let refuse = |m: String| FileError::broken(urdf, m);
    let shapes = shapes(&text).map_err(refuse)?;
    let shape = chosen(shapes, link).map_err(refuse)?;
    let mesh = located(urdf, &shape.file).map_err(refuse)?;
    Ok(Link { mesh, shape })
}

impl Link {
    /// Moves what was read of its mesh into the link's frame (m).
    pub fn place(&self, soup: &mut Soup) {
        let shape = &self.shape;
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
    }
}

/// All links with a mesh: what is seen where there is one, else what collides.
fn shapes(text: &str) -> Result<Vec<LinkMesh>, String> {
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

fn shape(link: &Node, of: &Node) -> Result<Option<LinkMesh>, String> {
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
    Ok(Some(LinkMesh {
        file: mesh.attribute("filename").unwrap_or_default().to_owned(),
        scale,
        shift: three(origin, "xyz", DVec3::ZERO)?,
        turn: turn_of(three(origin, "rpy", DVec3::ZERO)?.to_array()),
        link: name,
    }))
}

fn chosen(mut shapes: Vec<LinkMesh>, link: Option<&str>) -> Result<LinkMesh, String> {
    let names: Vec<&str> = shapes.iter().map(|s| s.link.as_str()).collect();
    let names = names.join(", ");
    let at = match (link, &shapes[..]) {
        (_, []) => Err("none of its links has a mesh".into()),
        (None, [_]) => Ok(0),
        (None, _) => Err(format!(
            "say which link is the limb, behind the file's name: robot.urdf#LINK, of {names}"
        )),
        (Some(link), _) => shapes
            .iter()
            .position(|s| s.link == link)
            .ok_or_else(|| format!("it has no link “{link}” with a mesh: there are {names}")),
    };
    at.map(|k| shapes.swap_remove(k))
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
