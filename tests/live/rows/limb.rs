//! What the rows are tried on: a limb of `assets`, or another, with its gauges.

use std::path::{Path, PathBuf};

const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets");
/// Other gauges of the same limb, ten in each file.
const TENS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/live/tens");

/// The ten gauges that all rows are tried on in place of those of the bundled project: a name in `tests/live/tens`.
fn other_ten() -> Option<String> {
    std::env::var("HAPDEF_TEN").ok()
}

/// A project with chosen gauges whose limb all rows are tried on in place of the bundled one, in a folder of its own: what
/// `hapdef design` writes.
pub fn other_limb() -> Option<PathBuf> {
    std::env::var_os("HAPDEF_LIMB").map(PathBuf::from)
}

/// A limb with its gauges.
pub enum Limb {
    /// One of `assets`, by its name.
    Bundled(&'static str),
    /// That of the quick start with other gauges, by their name in `tests/live/tens`.
    WithTen(String),
    /// A project of somebody's own.
    Other(PathBuf),
}

impl Limb {
    /// That on which all rows are tried.
    pub fn tried() -> Self {
        match (other_ten(), other_limb()) {
            (Some(ten), _) => Self::WithTen(ten),
            (None, Some(project)) => Self::Other(project),
            (None, None) => Self::Bundled("limb"),
        }
    }

    /// Whether it is what the rows are held to.
    pub fn is_the_bundled(&self) -> bool {
        matches!(self, Self::Bundled(_))
    }

    fn name(&self) -> &str {
        match self {
            Self::Bundled(name) => name,
            Self::WithTen(_) | Self::Other(_) => "limb",
        }
    }

    /// Its project; of other gauges that of the limb.
    pub fn project(&self) -> PathBuf {
        match self {
            Self::Other(project) => project.clone(),
            _ => Path::new(ASSETS).join(format!("{}.hapdef.toml", self.name())),
        }
    }

    /// What its project says, with its own gauges.
    pub fn told(&self) -> String {
        let told = std::fs::read_to_string(self.project()).unwrap();
        let Self::WithTen(ten) = self else {
            return told;
        };
        let gauges = Path::new(TENS).join(format!("{ten}.toml"));
        let gauges = std::fs::read_to_string(gauges).unwrap();
        let [from, to] = ["[[selection.site]]", "[evaluation]"].map(|at| told.find(at).unwrap());
        format!("{}{gauges}\n{}", &told[..from], &told[to..])
    }

    /// The arrays that its project may name.
    pub fn arrays(&self) -> Option<PathBuf> {
        let Self::Other(project) = self else {
            return None;
        };
        Some(project.with_extension("npz")).filter(|arrays| arrays.exists())
    }

    /// A folder of its own, from which its project finds its mesh.
    pub fn folder(&self) -> tempfile::TempDir {
        if let Self::Other(project) = self {
            return tempfile::tempdir_in(project.ancestors().nth(2).unwrap()).unwrap();
        }
        let folder = tempfile::tempdir().unwrap();
        let mesh = format!("{}.glb", self.name());
        std::fs::copy(Path::new(ASSETS).join(&mesh), folder.path().join(mesh)).unwrap();
        folder
    }
}
