//! The limbs inside the program, each with its project.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::design::Inputs;
use crate::io::mesh_file::parse_glb;
use crate::io::project_file::{self, LoadedProject};
use crate::io::{FileError, atomic, source};
use crate::project::Masks;

/// A limb inside the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Example {
    /// The limb that opens first: the middle of a wall.
    Tube,
    /// A solid with thin walls, a frame in the same body and the axis y, as the paper's limb has them.
    Barrel,
}

impl Example {
    pub const ALL: [Self; 2] = [Self::Tube, Self::Barrel];

    /// As menus name it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tube => "Example: tube of columns and hoops",
            Self::Barrel => "Example: barrel of triangles with a frame",
        }
    }

    /// The text of its project file.
    #[must_use]
    pub fn project(self) -> &'static str {
        match self {
            Self::Tube => include_str!("../../assets/limb.hapdef.toml"),
            Self::Barrel => include_str!("../../assets/barrel.hapdef.toml"),
        }
    }

    /// The bytes of its mesh file.
    #[must_use]
    pub fn mesh(self) -> &'static [u8] {
        match self {
            Self::Tube => include_bytes!("../../assets/limb.glb"),
            Self::Barrel => include_bytes!("../../assets/barrel.glb"),
        }
    }

    /// Its files without their endings: as `hapdef limb` writes them.
    fn stem(self) -> &'static str {
        match self {
            Self::Tube => "limb",
            Self::Barrel => "barrel",
        }
    }

    fn mesh_name(self) -> String {
        format!("{}.glb", self.stem())
    }

    /// The example whose mesh has the name of this file.
    #[must_use]
    pub fn of_mesh(mesh: &Path) -> Option<Self> {
        let name = mesh.file_name()?;
        Self::ALL
            .into_iter()
            .find(|e| name == e.mesh_name().as_str())
    }

    /// It as a loaded project.
    ///
    /// # Errors
    /// None for the files this program was built with.
    pub fn open(self) -> anyhow::Result<LoadedProject> {
        let broken = |m: String| anyhow::anyhow!("bundled {}: {m}", self.stem());
        let project = project_file::parse(self.project()).map_err(broken)?;
        let mesh = parse_glb(self.mesh()).map_err(broken)?;
        Ok(LoadedProject {
            inputs: Inputs {
                project,
                part: Arc::new(mesh.mesh),
                painted: None,
                masks: Masks::new(),
            },
            repairs: mesh.repairs,
            path: PathBuf::from(format!("{}.hapdef.toml", self.stem())),
            mesh_path: PathBuf::from(self.mesh_name()),
            bundled: true,
        })
    }
}

/// Writes a bundled mesh, by its name, into a folder, never over another one.
///
/// # Errors
/// When it cannot be written, or when another mesh of that name is there already.
pub fn write_bundled_mesh(folder: &Path, mesh: &Path) -> anyhow::Result<PathBuf> {
    let Some(example) = Example::of_mesh(mesh) else {
        anyhow::bail!("{}: this mesh is not inside the program", mesh.display());
    };
    let path = folder.join(example.mesh_name());
    match source::read(&path) {
        Ok(bytes) if bytes == example.mesh() => {}
        Err(FileError::Missing { .. }) => atomic::write(&path, example.mesh())?,
        // Also what cannot be read, or is no file: it is not ours to write over.
        _ => anyhow::bail!(
            "{}: something else of this name is there already. Choose another folder",
            path.display()
        ),
    }
    Ok(path)
}
