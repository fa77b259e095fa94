//! Sound files made unsound: every one from its number alone.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Numbers that counts, indices, sizes and coordinates must not be.
const NUMBERS: [&str; 28] = [
    "nan",
    "inf",
    "-inf",
    "-1",
    "0",
    "-0",
    "1",
    "0.5",
    "1.7",
    "999",
    "100000000",
    "2147483648",
    "-2147483649",
    "4294967295",
    "4294967296",
    "18446744073709551616",
    "99999999999999999999",
    "1e9",
    "1e20",
    "1e160",
    "1e300",
    "-1e300",
    "1e308",
    "1e400",
    "1e-20",
    "1e-300",
    "1e-320",
    "",
];

/// What ends or begins something somewhere, or is no text at all.
const WORDS: [&str; 24] = [
    "\n",
    "\r\n",
    " ",
    ",",
    "/",
    "{",
    "]",
    "\"",
    "*",
    "$",
    "#",
    "=",
    "-",
    "..",
    "../../x",
    "/dev/zero",
    "file:///etc/hostname",
    "\u{1b}[31m",
    "\u{7}",
    "\0",
    "\u{feff}",
    "“é”",
    "\u{202e}",
    "true",
];

/// Of four and eight bytes: counts, and floating-point numbers that are none.
const BITS: [u64; 10] = [
    0,
    1,
    0x7f80_0000,
    0x7fc0_0000,
    0x7fff_ffff,
    0xffff_ffff,
    0x7ff0_0000_0000_0000,
    0x7ff8_0000_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0xffff_ffff_ffff_ffff,
];

/// Input `number` of a run: first the files as they are, then spoiled ones without end.
pub fn input(files: &[Vec<u8>], seed: u64, number: u64) -> Vec<u8> {
    if let Some(whole) = files.get(number as usize) {
        return whole.clone();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    let other = &files[rng.random_range(0..files.len())];
    let mut bytes = files[rng.random_range(0..files.len())].clone();
    for _ in 0..rng.random_range(1..=4) {
        spoil(&mut bytes, other, &mut rng);
    }
    bytes
}

/// One change.
fn spoil(bytes: &mut Vec<u8>, other: &[u8], rng: &mut ChaCha8Rng) {
    if bytes.is_empty() {
        bytes.extend(other);
        return;
    }
    let at = rng.random_range(0..bytes.len());
    match rng.random_range(0..16) {
        0 => bytes[at] ^= 1 << rng.random_range(0..8),
        1 => bytes[at] = rng.random(),
        2 | 3 => put_bits(bytes, at, rng),
        4..=6 => replace_number(bytes, at, rng),
        7 => {
            let word = WORDS[rng.random_range(0..WORDS.len())];
            let end = at + rng.random_range(0..=word.len()).min(bytes.len() - at);
            bytes.splice(at..end, word.bytes());
        }
        8 => drop(bytes.drain(block(bytes.len(), at, rng))),
        9 => {
            let copy = bytes[block(bytes.len(), at, rng)].to_vec();
            let to = rng.random_range(0..=bytes.len());
            bytes.splice(to..to, copy);
        }
        10 => bytes.truncate(at),
        11 => {
            let to = rng.random_range(0..bytes.len());
            bytes.swap(at, to);
        }
        12 => splice(bytes, at, other, rng),
        _ => change_lines(bytes, at, rng),
    }
}

/// A stretch from a place on: mostly short, now and then up to half of the file.
fn block(length: usize, at: usize, rng: &mut ChaCha8Rng) -> std::ops::Range<usize> {
    let longest = if rng.random_range(0..4) == 0 {
        length / 2 + 1
    } else {
        16
    };
    at..at + rng.random_range(1..=longest).min(length - at)
}

/// Overwrites four or eight bytes, in either order.
fn put_bits(bytes: &mut [u8], at: usize, rng: &mut ChaCha8Rng) {
    let bits = BITS[rng.random_range(0..BITS.len())];
    let wide = bits > u64::from(u32::MAX) || rng.random_range(0..3) == 0;
    let all = bits.to_le_bytes();
    let mut word = if wide {
        all.to_vec()
    } else {
        all[..4].to_vec()
    };
    if rng.random_range(0..2) == 0 {
        word.reverse();
    }
    for (b, w) in bytes[at..].iter_mut().zip(word) {
        *b = w;
    }
}

/// Another number in the place of the next one, or its last digit changed.
fn replace_number(bytes: &mut Vec<u8>, at: usize, rng: &mut ChaCha8Rng) {
    let of_number = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
    let Some(digit) = bytes[at..].iter().position(u8::is_ascii_digit) else {
        return;
    };
    let inside = at + digit;
    let before = bytes[..inside]
        .iter()
        .rev()
        .take_while(|&b| of_number(b))
        .count();
    let after = bytes[inside..].iter().take_while(|&b| of_number(b)).count();
    let (start, end) = (inside - before, inside + after);
    if rng.random_range(0..3) == 0 {
        bytes[inside] = b'0' + rng.random_range(0..10_u8);
    } else {
        let number = NUMBERS[rng.random_range(0..NUMBERS.len())];
        bytes.splice(start..end, number.bytes());
    }
}

/// The rest from somewhere in another file.
fn splice(bytes: &mut Vec<u8>, at: usize, other: &[u8], rng: &mut ChaCha8Rng) {
    let from = rng.random_range(0..=other.len());
    if rng.random_range(0..2) == 0 {
        bytes.truncate(at);
        bytes.extend(&other[from..]);
    } else {
        let piece = &other[from..(from + 64).min(other.len())];
        bytes.splice(at..at, piece.iter().copied());
    }
}

/// A line taken out, doubled, put elsewhere or cut short.
fn change_lines(bytes: &mut Vec<u8>, at: usize, rng: &mut ChaCha8Rng) {
    let start = bytes[..at]
        .iter()
        .rposition(|&b| b == b'\n')
        .map_or(0, |k| k + 1);
    let length = bytes[start..].iter().position(|&b| b == b'\n');
    let end = length.map_or(bytes.len(), |k| start + k + 1);
    let line = bytes[start..end].to_vec();
    match rng.random_range(0..4) {
        0 => drop(bytes.drain(start..end)),
        1 => drop(bytes.splice(start..start, line)),
        2 => {
            bytes.drain(start..end);
            let near = rng.random_range(0..=bytes.len());
            let to = bytes[..near]
                .iter()
                .rposition(|&b| b == b'\n')
                .map_or(0, |k| k + 1);
            bytes.splice(to..to, line);
        }
        _ => drop(bytes.drain(at..end)),
    }
}
