//! The data that a glTF file takes its numbers from: inside it, or in files beside it, and nowhere else.

use std::path::{Component, Path};

use base64::Engine as _;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::{Source, View};

use crate::io::source;
use crate::memory;
use crate::plain::{self, quote};

/// The bytes of each buffer.
pub struct Buffers(Vec<Vec<u8>>);

impl Buffers {
    /// Reads all buffers of a file in `folder`.
    pub fn load(
        document: &gltf::Document,
        folder: Option<&Path>,
        mut blob: Option<Vec<u8>>,
    ) -> Result<Self, String> {
        let mut loaded = Vec::new();
        let mut total = 0;
        for buffer in document.buffers() {
            let bytes = match buffer.source() {
                Source::Uri(uri) if !uri.starts_with("data:") => beside(folder, uri)?,
                inside => within(&inside, &mut blob)
                    .map_err(|e| format!("the data of the glTF file cannot be read ({e})"))?,
            };
            let (announced, held) = (buffer.length(), bytes.len());
            if held < announced {
                return Err(format!(
                    "the glTF file is truncated: its buffer {} announces {announced} bytes and has {held}",
                    buffer.index()
                ));
            }
            // The same file may be named again and again.
            total += held;
            if total as f64 > memory::allowed() / 4.0 {
                return Err(format!(
                    "the buffers of the glTF file have more than a quarter of the {} that may be taken: make them smaller, or allow more with --memory-gb",
                    plain::allowed(memory::allowed())
                ));
            }
            loaded.push(bytes);
        }
        Ok(Self(loaded))
    }

    pub fn bytes(&self, buffer: &gltf::Buffer) -> Option<&[u8]> {
        self.0.get(buffer.index()).map(Vec::as_slice)
    }

    /// Whether an accessor holds places, all of them.
    pub fn check_positions(&self, accessor: &gltf::Accessor) -> Result<(), String> {
        let kind = (accessor.data_type(), accessor.dimensions());
        if kind != (DataType::F32, Dimensions::Vec3) {
            return Err(format!(
                "takes its positions from accessor {}, which does not hold three floats each",
                accessor.index()
            ));
        }
        self.check(accessor)
    }

    /// Whether an accessor holds numbers of vertices, all of them.
    pub fn check_indices(&self, accessor: &gltf::Accessor) -> Result<(), String> {
        let whole = matches!(
            accessor.data_type(),
            DataType::U8 | DataType::U16 | DataType::U32
        );
        if !whole || accessor.dimensions() != Dimensions::Scalar {
            return Err(format!(
                "takes its indices from accessor {}, which does not hold one whole number each",
                accessor.index()
            ));
        }
        self.check(accessor)
    }

    fn check(&self, accessor: &gltf::Accessor) -> Result<(), String> {
        let (count, size) = (accessor.count(), accessor.size());
        let dense = accessor.view();
        let changed = accessor.sparse();
        let there = count > 0
            && (dense.is_some() || changed.is_some())
            && dense.is_none_or(|view| self.holds(&view, accessor.offset(), count, size))
            && changed.is_none_or(|sparse| {
                let (indices, values) = (sparse.indices(), sparse.values());
                let width = indices.index_type().size();
                sparse.count() <= count
                    && self.holds(&indices.view(), indices.offset(), sparse.count(), width)
                    && self.holds(&values.view(), values.offset(), sparse.count(), size)
            });
        if there {
            return Ok(());
        }
        Err(format!(
            "takes {count} entries from accessor {}, which its buffer view does not hold: they are more than its data, or overlap",
            accessor.index()
        ))
    }

    /// Whether so many entries of a size (bytes) lie within a view side by side, and the view within its buffer.
    fn holds(&self, view: &View, offset: usize, count: usize, size: usize) -> bool {
        let stride = view.stride().unwrap_or(size);
        let end = (count.checked_sub(1))
            .and_then(|steps| steps.checked_mul(stride))
            .and_then(|last| last.checked_add(offset)?.checked_add(size));
        let view_end = view.offset().checked_add(view.length());
        let held = self.0.get(view.buffer().index()).map_or(0, Vec::len);
        stride >= size
            && end.is_some_and(|end| end <= view.length())
            && view_end.is_some_and(|end| end <= held)
    }
}

/// The bytes that stand in the file itself: in the second part of a GLB file, or written as base64.
fn within(source: &Source, blob: &mut Option<Vec<u8>>) -> Result<Vec<u8>, String> {
    let padded =
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
    let mut bytes = match source {
        Source::Bin => (blob.take()).ok_or("it has no part with data")?,
        Source::Uri(uri) => {
            let (_, text) = uri
                .split_once(";base64,")
                .ok_or("only base64 is understood within it")?;
            GeneralPurpose::new(&STANDARD, padded)
                .decode(text)
                .map_err(|e| format!("its base64 is wrong: {e}"))?
        }
    };
    // Some count the bytes that fill the last word, and leave them out.
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    Ok(bytes)
}

/// The bytes of a file that a glTF file names, which has to lie beside it or below.
fn beside(folder: Option<&Path>, uri: &str) -> Result<Vec<u8>, String> {
    let refused = |why: &str| {
        format!(
            "it takes its data from {}, {why}. Put that file beside it, or save all in one GLB file",
            quote(uri)
        )
    };
    let outside = || refused("which is not a file beside it or below");
    let name = decoded(uri).ok_or_else(outside)?;
    let named = Path::new(&name);
    let downward = |c: Component| matches!(c, Component::Normal(_) | Component::CurDir);
    if name.contains([':', '\\', '\0']) || !named.components().all(downward) {
        return Err(outside());
    }
    let folder = folder.ok_or_else(|| refused("which is not given with it"))?;
    let here = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let missing = |_| refused("which is not there");
    let root = here.canonicalize().map_err(missing)?;
    // Links are followed before it is looked where they lead.
    let file = here.join(named).canonicalize().map_err(missing)?;
    if !file.starts_with(&root) {
        return Err(outside());
    }
    source::read(&file).map_err(|e| e.to_string())
}

/// A URI with the characters that its percent codes stand for; nothing where they are no text.
fn decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let code = after.first_chunk::<2>().filter(|_| first == b'%');
        let code = code
            .and_then(|hex| str::from_utf8(hex).ok())
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        bytes.push(code.unwrap_or(first));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(bytes).ok()
}
