//! Every reader of the program as one function of bytes.

use std::fmt::Display;
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use hapdef::dataset::SignalMatrix;
use hapdef::inference::ResponseMap;
use hapdef::io::mesh_file::parse_mesh;
use hapdef::io::{dataset_file, npz, points, project_file, touch_file, trade_file};
use hapdef::limb::LimbSpec;
use hapdef::link::{Address, Listener, Pace, SessionEvent};
use hapdef::live::{Pipeline, PipelineSettings, Receiver};
use hapdef::mesh::TriMesh;
use hapdef::mesh::repair::Repair;
use hapdef::plain;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::property;

/// What takes bytes in from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    Stl,
    Obj,
    Ply,
    Gltf,
    Glb,
    Msh,
    Inp,
    Dat,
    /// A project's text.
    Project,
    /// A dataset as the archive that it is.
    Npz,
    /// The arrays of a dataset, one after the other; the archive around them is sound.
    Arrays,
    /// A painted mask, in a sound archive.
    Mask,
    /// A dataset as a table, its touches beside it.
    Csv,
    /// The touches beside a dataset.
    Places,
    /// What Ansys Mechanical exports.
    Export,
    /// Touches and gauges to answer for.
    Touches,
    Sites,
    /// Who presses a simulated board, and when.
    Presses,
    /// A trade that was measured.
    Trade,
    /// A trained estimator.
    Trained,
    /// What a board sends.
    Wire,
    /// What frames hold: a length and so many bytes, again and again; check sums and frames are sound.
    Frames,
    /// A recording, replayed.
    Recording,
}

/// How a reader ends that does as it should.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    Taken,
    /// With the words that the user reads.
    Refused(String),
}

/// What begins an array.
pub const NUMPY: &[u8] = b"\x93NUMPY";
/// Longest replay: what does not end waits for ever.
const REPLAY: Duration = Duration::from_secs(10);
/// A row of this dataset and of its touches.
pub const TABLE: &str =
    "x_mm,y_mm,z_mm,cost,a,b,c\n1,2,3,1,0.1,0.2,0.3\n4,5,6,2,0.4,0.5,0.6\n7,8,9,3,0.7,0.8,1e-3\n";
pub const PLACES: &str = "x_mm,y_mm,z_mm\n0,0,1\n10,0,1\n20.5,-3,1e1\n";

impl Reader {
    pub const ALL: [Self; 23] = [
        Self::Stl,
        Self::Obj,
        Self::Ply,
        Self::Gltf,
        Self::Glb,
        Self::Msh,
        Self::Inp,
        Self::Dat,
        Self::Project,
        Self::Npz,
        Self::Arrays,
        Self::Mask,
        Self::Csv,
        Self::Places,
        Self::Export,
        Self::Touches,
        Self::Sites,
        Self::Presses,
        Self::Trade,
        Self::Trained,
        Self::Wire,
        Self::Frames,
        Self::Recording,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::Msh => "msh",
            Self::Inp => "inp",
            Self::Dat => "dat",
            Self::Project => "project",
            Self::Npz => "npz",
            Self::Arrays => "arrays",
            Self::Mask => "mask",
            Self::Csv => "csv",
            Self::Places => "places",
            Self::Export => "export",
            Self::Touches => "touches",
            Self::Sites => "sites",
            Self::Presses => "presses",
            Self::Trade => "trade",
            Self::Trained => "trained",
            Self::Wire => "wire",
            Self::Frames => "frames",
            Self::Recording => "recording",
        }
    }

    /// Of the files that it reads.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Project => "toml",
            Self::Arrays | Self::Mask => "npy",
            Self::Places | Self::Touches | Self::Sites | Self::Presses => "csv",
            Self::Export => "txt",
            Self::Trade => "json",
            Self::Wire | Self::Frames => "bin",
            Self::Recording => "hapdrec",
            Self::Trained => "hapdtouch",
            mesh_or_data => mesh_or_data.name(),
        }
    }

    pub fn is_mesh(self) -> bool {
        hapdef::io::mesh_file::ENDINGS.contains(&self.name())
    }

    /// Reads bytes, in a folder of the caller's own where they have to lie in a file.
    ///
    /// # Errors
    /// What does not hold of what came out. A panic is let through.
    pub fn hold(self, bytes: &[u8], folder: &Path) -> Result<Outcome, String> {
        let Outcome::Refused(said) = self.read(bytes, folder)? else {
            return Ok(Outcome::Taken);
        };
        // The folder is nobody's business, and its name may be long.
        let place = format!("{}{}", folder.display(), std::path::MAIN_SEPARATOR);
        let said = said.replace(&place, "");
        property::message(&said)?;
        Ok(Outcome::Refused(said))
    }

    fn read(self, bytes: &[u8], folder: &Path) -> Result<Outcome, String> {
        match self {
            Self::Project => project(bytes),
            Self::Npz => dataset(&put(folder, "d.npz", bytes)?, None),
            Self::Arrays => dataset(&put(folder, "d.npz", &archive(bytes)?)?, None),
            Self::Mask => Ok(mask(&put(
                folder,
                "m.npz",
                &packed(&[("painted", bytes)])?,
            )?)),
            Self::Csv => {
                let places = put(folder, "t.csv", PLACES.as_bytes())?;
                dataset(&put(folder, "d.csv", bytes)?, Some(&places))
            }
            Self::Places => {
                let places = put(folder, "t.csv", bytes)?;
                dataset(&put(folder, "d.csv", TABLE.as_bytes())?, Some(&places))
            }
            Self::Export => export(bytes, folder),
            Self::Touches => touches(&put(folder, "touches.csv", bytes)?),
            Self::Sites => sites(&put(folder, "sites.csv", bytes)?),
            Self::Presses => presses(&put(folder, "presses.csv", bytes)?),
            Self::Trade => trade(bytes),
            Self::Trained => Ok(trained(&put(folder, "m.hapdtouch", bytes)?)),
            Self::Wire => wire(bytes),
            Self::Frames => wire(&framed(bytes)),
            Self::Recording => recording(&put(folder, "r.hapdrec", bytes)?),
            mesh => mesh.mesh(bytes, folder),
        }
    }

    /// What is done to a mesh on its way in hangs on its bytes, so that the same bytes do the same.
    fn mesh(self, bytes: &[u8], folder: &Path) -> Result<Outcome, String> {
        let draw = bytes.iter().fold(bytes.len(), |sum, &b| {
            sum.wrapping_mul(31).wrapping_add(usize::from(b))
        });
        let repair = Repair {
            weld: if draw.is_multiple_of(3) { 1e-5 } else { 0.0 },
            fill_holes: if draw.is_multiple_of(5) { 5e-2 } else { 0.0 },
            straighten: if draw.is_multiple_of(2) { 1e-2 } else { 0.0 },
            halve: if draw.is_multiple_of(3) {
                0.0
            } else {
                f64::INFINITY
            },
        };
        let body = usize::from(draw.is_multiple_of(7));
        match parse_mesh(bytes, self.ending(), Some(folder), 1e-3, body, &repair) {
            Ok(loaded) => property::surface(&loaded).map(|()| Outcome::Taken),
            Err(said) => Ok(refused_of(&format!("part.{}", self.ending()), &said)),
        }
    }
}

impl FromStr for Reader {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let all = Self::ALL.iter().find(|r| r.name() == name);
        all.copied().ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|r| r.name()).collect();
            format!("choose among {}", names.join(", "))
        })
    }
}

fn refused(error: impl Display) -> Outcome {
    Outcome::Refused(error.to_string())
}

/// The message of a function that knows no file, as [`hapdef::io::FileError`] shows it.
fn refused_of(name: &str, said: &str) -> Outcome {
    Outcome::Refused(format!("{name}: {}", plain::message(said)))
}

/// Writes a file in the folder, over the one before.
fn put(folder: &Path, name: &str, bytes: &[u8]) -> Result<PathBuf, String> {
    let path = folder.join(name);
    std::fs::write(&path, bytes).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(path)
}

fn project(bytes: &[u8]) -> Result<Outcome, String> {
    let text = String::from_utf8_lossy(bytes);
    let project = match project_file::parse(&text) {
        Ok(project) => project,
        Err(said) => return Ok(refused_of("p.hapdef.toml", &said)),
    };
    // A number that is none would not be equal to itself.
    let again = project_file::parse(&project_file::to_text(&project));
    match again {
        Ok(again) if again == project => Ok(Outcome::Taken),
        Ok(_) => Err("what is written reads back as something else".into()),
        Err(said) => Err(format!("what is written is not read: {said}")),
    }
}

fn dataset(path: &Path, touches: Option<&Path>) -> Result<Outcome, String> {
    match dataset_file::read(path, touches) {
        Ok(given) => property::dataset(&given.data).map(|()| Outcome::Taken),
        Err(error) => Ok(refused(error)),
    }
}

fn mask(path: &Path) -> Outcome {
    npz::read_mask(path, "painted").map_or_else(refused, |_| Outcome::Taken)
}

fn export(bytes: &[u8], folder: &Path) -> Result<Outcome, String> {
    let exports = folder.join("exports");
    std::fs::create_dir_all(&exports).map_err(|e| e.to_string())?;
    // Two touches: one alone has nothing to be told from.
    put(&exports, "1.txt", bytes)?;
    put(&exports, "2.txt", bytes)?;
    let places = put(folder, "two.csv", b"x_mm,y_mm,z_mm\n0,0,1\n5,0,1\n")?;
    dataset(&exports, Some(&places))
}

fn touches(path: &Path) -> Result<Outcome, String> {
    let touches = match points::read_touches(path) {
        Ok(touches) => touches,
        Err(error) => return Ok(refused(error)),
    };
    for t in &touches {
        let place = t.position.to_array().into_iter().chain(t.normal.to_array());
        property::finite(place.chain([t.force, t.tip_radius]))?;
        if t.force <= 0.0 || t.tip_radius <= 0.0 || !t.normal.is_normalized() {
            return Err(format!("the touch {t:?}"));
        }
    }
    Ok(Outcome::Taken)
}

fn sites(path: &Path) -> Result<Outcome, String> {
    let sites = match points::read_sites(path) {
        Ok(sites) => sites,
        Err(error) => return Ok(refused(error)),
    };
    for site in &sites {
        property::finite(site.position.to_array())?;
        if !site.direction.is_normalized() {
            return Err(format!("a gauge along {}", site.direction));
        }
    }
    Ok(Outcome::Taken)
}

fn presses(path: &Path) -> Result<Outcome, String> {
    let presses = match points::read_presses(path) {
        Ok(presses) => presses,
        Err(error) => return Ok(refused(error)),
    };
    for p in &presses {
        let end = p.start_s + p.duration_s;
        let place = p.position.to_array().into_iter();
        property::finite(place.chain([p.start_s, end, p.force]))?;
        if p.start_s < 0.0 || end <= p.start_s || p.force <= 0.0 {
            return Err(format!("the press {p:?}"));
        }
    }
    Ok(Outcome::Taken)
}

/// What is read has an answer, whatever it learned.
fn trained(path: &Path) -> Outcome {
    let estimator = match touch_file::read(path) {
        Ok(file) => file.estimator,
        Err(error) => return refused(error),
    };
    let _ = estimator.find(&SignalMatrix::new(2, vec![0.5; 2 * estimator.channels()]));
    Outcome::Taken
}

fn trade(bytes: &[u8]) -> Result<Outcome, String> {
    let text = String::from_utf8_lossy(bytes);
    let record = match trade_file::TradeRecord::parse(&text) {
        Ok(record) => record,
        Err(said) => return Ok(refused_of("trade.json", &said)),
    };
    match trade_file::TradeRecord::parse(&record.to_json()) {
        Ok(again) if again == record => Ok(Outcome::Taken),
        Ok(_) => Err("what is written reads back as something else".into()),
        Err(said) => Err(format!("what is written is not read: {said}")),
    }
}

/// Bytes as they may come from a port: in pieces.
fn wire(bytes: &[u8]) -> Result<Outcome, String> {
    /// No piece ends where a frame does.
    const PIECE: usize = 61;
    let mut receiver = Receiver::default();
    let (mut held, mut samples) = (Ok(()), 0);
    for (now, piece) in (0..).zip(bytes.chunks(PIECE)) {
        receiver.push(piece, now * 1000, |input| {
            samples += u64::from(matches!(input, hapdef::live::Input::Sample(_)));
            if held.is_ok() {
                held = property::input(&input);
            }
        });
    }
    held?;
    let traffic = receiver.traffic;
    if traffic.bytes != bytes.len() as u64 || traffic.samples != samples {
        return Err(format!(
            "{traffic:?} of {} bytes and {samples} samples",
            bytes.len()
        ));
    }
    // Nothing is refused in words: what is not understood is counted.
    Ok(Outcome::Taken)
}

/// Frames that are sound outside, with these bytes in them.
pub fn framed(mut bytes: &[u8]) -> Vec<u8> {
    let sum = crc::Crc::<u16>::new(&crc::CRC_16_IBM_3740);
    let mut all = vec![0];
    while let Some((&length, rest)) = bytes.split_first() {
        let (inside, after) = rest.split_at(usize::from(length).min(rest.len()));
        let mut frame = inside.to_vec();
        frame.extend(sum.checksum(inside).to_le_bytes());
        let start = all.len();
        all.resize(start + cobs::max_encoding_length(frame.len()), 0);
        let length = cobs::encode(&frame, &mut all[start..]);
        all.truncate(start + length);
        all.push(0);
        bytes = after;
    }
    all
}

/// Arrays that stand one after the other, as a dataset's archive.
fn archive(bytes: &[u8]) -> Result<Vec<u8>, String> {
    const NAMES: [&str; 4] = ["X", "p_m", "site_m", "cost"];
    let begins = |at: &usize| *at == 0 || bytes[*at..].starts_with(NUMPY);
    let starts: Vec<usize> = (0..bytes.len()).filter(begins).collect();
    let ends = starts.iter().skip(1).copied().chain([bytes.len()]);
    let arrays = starts.iter().zip(ends).map(|(&from, to)| &bytes[from..to]);
    let named: Vec<(&str, &[u8])> = NAMES.into_iter().zip(arrays).collect();
    packed(&named)
}

/// An archive of arrays.
///
/// # Errors
/// What the writer reports.
pub fn packed(arrays: &[(&str, &[u8])]) -> Result<Vec<u8>, String> {
    let write = || -> zip::result::ZipResult<Vec<u8>> {
        let mut file = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in arrays {
            let options =
                SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
            file.start_file(format!("{name}.npy"), options)?;
            file.write_all(bytes)?;
        }
        Ok(file.finish()?.into_inner())
    };
    write().map_err(|e| e.to_string())
}

/// A coarse limb.
pub fn small() -> TriMesh {
    let spec = LimbSpec {
        element: 40.0,
        ..LimbSpec::default()
    };
    spec.build().expect("the bundled limb, coarse").0
}

/// Gauges of the part that recordings are replayed on.
const GAUGES: usize = 6;

/// What a small part's gauges read: any smooth field will do.
static MAP: LazyLock<Arc<ResponseMap>> = LazyLock::new(|| {
    let mesh = small();
    let nodes = mesh.positions().len() + mesh.edges().len();
    let value = |k: usize| 1e-5 * (0.37 * k as f64).sin();
    let values = (0..nodes * GAUGES).map(value).collect();
    Arc::new(ResponseMap::of(Arc::new(mesh), GAUGES, values))
});

fn recording(path: &Path) -> Result<Outcome, String> {
    let address = Address::Recording {
        path: path.to_owned(),
        pace: Pace::Fast,
    };
    let pipeline = Pipeline::new(Arc::clone(&MAP), PipelineSettings::of(GAUGES));
    let (_commands, inbox) = channel();
    let (stop, begun) = (AtomicBool::new(false), Instant::now());
    let mut held = Ok(());
    let ended = Listener::new(address, pipeline).run(&stop, &inbox, |heard| {
        if held.is_err() {
            return;
        }
        held = match heard {
            SessionEvent::Sample { sample, update, .. } => {
                property::finite(sample.counts.iter().copied())
                    .and_then(|()| property::update(update))
            }
            SessionEvent::Truth(Some((place, force))) => {
                property::finite(place.to_array().into_iter().chain([force]))
            }
            SessionEvent::Turn { .. } if begun.elapsed() > REPLAY => {
                Err("the replay does not end".into())
            }
            _ => Ok(()),
        };
        if held.is_err() {
            stop.store(true, Ordering::Relaxed);
        }
    });
    held?;
    Ok(ended.map_or_else(refused, |()| Outcome::Taken))
}
