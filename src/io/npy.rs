//! One array of numbers in `NumPy`'s format (NPY), as it comes from elsewhere.
//!
//! What a header announces is checked before anything is taken for it, and what follows is taken only as far
//! as it is there: a few bytes can announce, or unpack into, more than any memory holds.

use std::io::{self, Read};

use crate::memory;
use crate::plain::{self, quote};

/// Every number becomes one of eight bytes, and a computation holds a few copies of them.
const BYTES: f64 = 4.0 * 8.0;
/// The longest header that is read (bytes); `NumPy` itself stops at 10 000.
const HEADER: u64 = 1 << 16;
/// Numbers that are read at a time.
const CHUNK: usize = 8192;

/// Numbers by rows, whatever their type and order in the file; more than two dimensions stay in the file's
/// order.
#[derive(Debug, PartialEq)]
pub struct Array {
    pub shape: Vec<usize>,
    pub values: Vec<f64>,
}

/// Why an array cannot be read; each follows “the array “X” cannot be read: ”.
#[derive(Debug, thiserror::Error)]
pub enum NpyError {
    #[error("it is no NPY array. Write it with numpy.savez")]
    NoArray,
    #[error("its header is damaged. Write it with numpy.savez")]
    Header,
    #[error("it holds {0}, and numbers are needed. Save it as float64")]
    Kind(String),
    #[error(
        "it announces {count} numbers, and at most {most:.0} are read with {} of memory. Make it smaller, or allow more with --memory-gb",
        plain::allowed(memory::allowed())
    )]
    TooLarge { count: String, most: f64 },
    #[error("it ends after {found} of its {count} numbers. Write it again")]
    Short { found: usize, count: usize },
    #[error("more follows after its {count} numbers. Write it again")]
    Long { count: usize },
    #[error("{0}. The file may be damaged: write it again")]
    Io(#[from] io::Error),
}

/// Reads an array of booleans, integers or floats of any size and byte order.
///
/// # Errors
/// [`NpyError`] for what is damaged, is no array of numbers, or is larger than memory bears.
pub fn read(mut from: impl Read) -> Result<Array, NpyError> {
    let NpyHeader {
        number,
        fortran,
        shape,
    } = NpyHeader::read(&mut from)?;
    let values = values(from, number, count(&shape)?)?;
    let values = match shape[..] {
        [rows, columns] if fortran => (0..rows)
            .flat_map(|r| (0..columns).map(move |c| c * rows + r))
            .map(|k| values[k])
            .collect(),
        _ => values,
    };
    Ok(Array { shape, values })
}

/// How many numbers a shape has, where there is memory for them.
fn count(shape: &[usize]) -> Result<usize, NpyError> {
    let most = (memory::allowed() / BYTES).floor();
    let count = shape.iter().try_fold(1, |n: usize, &k| n.checked_mul(k));
    count
        .filter(|&n| n as f64 <= most)
        .ok_or_else(|| NpyError::TooLarge {
            count: shape
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join(" × "),
            most,
        })
}

fn values(mut from: impl Read, number: Number, count: usize) -> Result<Vec<f64>, NpyError> {
    // It grows with what is there, not with what is announced.
    let mut values = Vec::new();
    let mut bytes = Vec::new();
    while values.len() < count {
        let wanted = number.size * CHUNK.min(count - values.len());
        bytes.clear();
        from.by_ref().take(wanted as u64).read_to_end(&mut bytes)?;
        values.extend(bytes.chunks_exact(number.size).map(|b| number.value(b)));
        if bytes.len() < wanted {
            return Err(NpyError::Short {
                found: values.len(),
                count,
            });
        }
    }
    // The end is asked for in any case: there an archive compares its checksum.
    match from.take(1).read_to_end(&mut bytes)? {
        0 => Ok(values),
        _ => Err(NpyError::Long { count }),
    }
}

struct NpyHeader {
    number: Number,
    fortran: bool,
    shape: Vec<usize>,
}

impl NpyHeader {
    fn read(from: &mut impl Read) -> Result<Self, NpyError> {
        let mut start = [0; 8];
        from.read_exact(&mut start).map_err(|_| NpyError::NoArray)?;
        let [b'\x93', b'N', b'U', b'M', b'P', b'Y', version, _] = start else {
            return Err(NpyError::NoArray);
        };
        let mut length = [0; 4];
        let width = if version == 1 { 2 } else { 4 };
        from.read_exact(&mut length[..width])
            .map_err(|_| NpyError::Header)?;
        let length = u64::from(u32::from_le_bytes(length));
        if length > HEADER {
            return Err(NpyError::Header);
        }
        let mut text = Vec::new();
        from.take(length).read_to_end(&mut text)?;
        let text = String::from_utf8(text).map_err(|_| NpyError::Header)?;
        Self::parse(&text).ok_or(NpyError::Header)?
    }

    /// From the dictionary that a header is, as Python writes it; none where a part of it is missing.
    fn parse(text: &str) -> Option<Result<Self, NpyError>> {
        let kind = entry(text, "descr")?;
        let number = match kind.strip_prefix(['\'', '"']) {
            Some(kind) => Number::parse(kind.split(['\'', '"']).next()?),
            None => Err(NpyError::Kind("a table of named fields".into())),
        };
        let order = entry(text, "fortran_order")?;
        let fortran = match (order.starts_with("True"), order.starts_with("False")) {
            (true, _) => true,
            (_, true) => false,
            _ => return None,
        };
        let sizes = entry(text, "shape")?.strip_prefix('(')?.split_once(')')?.0;
        let shape = sizes
            .split(',')
            .map(str::trim)
            .filter(|size| !size.is_empty())
            // Python 2 wrote long integers with a letter.
            .map(|size| size.trim_end_matches('L').parse().ok())
            .collect::<Option<Vec<usize>>>()?;
        Some(number.map(|number| Self {
            number,
            fortran,
            shape,
        }))
    }
}

/// What stands in a dictionary after a key.
fn entry<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = ['\'', '"']
        .iter()
        .find_map(|mark| text.split_once(&format!("{mark}{key}{mark}")))?;
    Some(rest.trim_start().strip_prefix(':')?.trim_start())
}

/// How one number is written.
#[derive(Clone, Copy)]
struct Number {
    kind: NumberKind,
    /// Bytes: 1, 2, 4 or 8.
    size: usize,
    big_endian: bool,
}

#[derive(Clone, Copy)]
enum NumberKind {
    Bool,
    Signed,
    Unsigned,
    Float,
}

impl Number {
    /// From a type as `NumPy` writes it: byte order, kind, bytes.
    fn parse(text: &str) -> Result<Self, NpyError> {
        let refused = |what: &str| Err(NpyError::Kind(what.to_owned()));
        let plain = text.trim_start_matches(['<', '>', '|', '=']);
        let mut letters = plain.chars();
        let letter = letters.next().unwrap_or(' ');
        let (kind, size) = match (letter, letters.as_str().parse()) {
            ('b', Ok(1)) => (NumberKind::Bool, 1),
            ('i', Ok(size @ (1 | 2 | 4 | 8))) => (NumberKind::Signed, size),
            ('u', Ok(size @ (1 | 2 | 4 | 8))) => (NumberKind::Unsigned, size),
            ('f', Ok(size @ (2 | 4 | 8))) => (NumberKind::Float, size),
            ('f', _) => return refused("numbers of extended precision (longdouble)"),
            ('c', _) => return refused("complex numbers"),
            ('U' | 'S' | 'a', _) => return refused("text"),
            ('O', _) => return refused("Python objects"),
            ('m' | 'M', _) => return refused("times"),
            ('V', _) => return refused("raw bytes"),
            _ => return refused(&format!("values of the unknown type {}", quote(text))),
        };
        Ok(Self {
            kind,
            size,
            big_endian: text.starts_with('>'),
        })
    }

    /// The number that `size` bytes are.
    fn value(self, bytes: &[u8]) -> f64 {
        let join = |bits: u64, byte: &u8| (bits << 8) | u64::from(*byte);
        let bits = if self.big_endian {
            bytes.iter().fold(0, join)
        } else {
            bytes.iter().rev().fold(0, join)
        };
        let unused = 64 - 8 * self.size;
        match (self.kind, self.size) {
            (NumberKind::Bool, _) => f64::from(u8::from(bits != 0)),
            (NumberKind::Signed, _) => ((bits << unused) as i64 >> unused) as f64,
            (NumberKind::Unsigned, _) => bits as f64,
            (NumberKind::Float, 2) => half(bits as u16),
            (NumberKind::Float, 4) => f64::from(f32::from_bits(bits as u32)),
            (NumberKind::Float, _) => f64::from_bits(bits),
        }
    }
}

/// A float of two bytes (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = ((bits >> 10) & 0x1f, bits & 0x3ff);
    let size = match (exponent, fraction) {
        (0, _) => f64::from(fraction) * 2f64.powi(-24),
        (0x1f, 0) => f64::INFINITY,
        (0x1f, _) => f64::NAN,
        _ => f64::from(fraction | 0x400) * 2f64.powi(i32::from(exponent) - 25),
    };
    if bits >> 15 == 1 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(kind: &str, shape: &str, bytes: &[u8]) -> Vec<u8> {
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let length = (header.len() as u16).to_le_bytes();
        [
            &b"\x93NUMPY\x01\x00"[..],
            &length[..],
            header.as_bytes(),
            bytes,
        ]
        .concat()
    }

    #[test]
    fn halves_are_what_the_standard_says() {
        for (bits, value) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0400, 2f64.powi(-14)),
            (0x0001, 2f64.powi(-24)),
            (0x3555, 0.333_251_953_125),
            (0xfc00, f64::NEG_INFINITY),
        ] {
            assert_eq!(half(bits), value, "{bits:#06x}");
        }
        assert!(half(0x7e00).is_nan());
    }

    #[test]
    fn an_array_is_as_long_as_it_says() {
        let whole = array("<i2", "(2,)", &[1, 0, 0xff, 0xff]);
        assert_eq!(read(&whole[..]).unwrap().values, [1.0, -1.0]);
        let said = read(&whole[..whole.len() - 1]).unwrap_err().to_string();
        assert!(said.contains("1 of its 2"), "{said}");
        let said = read(&[&whole[..], &b"+"[..]].concat()[..]).unwrap_err();
        assert!(said.to_string().contains("more follows"), "{said}");
    }

    #[test]
    fn no_header_makes_it_take_what_is_not_there() {
        for shape in [
            "(99999999999,)",
            "(4294967296, 4294967296, 16)",
            "(18446744073709551616,)",
            "(-1,)",
            "((((((",
        ] {
            assert!(read(&array("<f8", shape, &[])[..]).is_err(), "{shape}");
        }
        assert!(read(&b"\x93NUMPY\x02\x00\xff\xff\xff\xff{"[..]).is_err());
        assert_eq!(
            read(&array("<f8", "(0, 3)", &[])[..]).unwrap().shape,
            [0, 3]
        );
    }
}
