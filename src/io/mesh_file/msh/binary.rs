//! The sections of a binary Gmsh file of version 4.1: byte after byte, without lines.

use super::stream::Stream;
use crate::io::mesh_file::place::FilePlace;
use crate::plain::quote;

/// How a binary file writes its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    Little,
    Big,
}

/// A section: its name, and what stands between its first and its last line.
#[derive(Clone, Copy)]
pub struct BinarySection<'t> {
    pub name: &'t str,
    /// Byte of the file that it begins at.
    pub begins: usize,
    pub bytes: &'t [u8],
}

impl BinarySection<'_> {
    /// The order of bytes, by the number one that stands in `$MeshFormat`.
    ///
    /// # Errors
    /// A message where that number is missing.
    pub fn order(&self) -> Result<Order, String> {
        let line = self.bytes.iter().position(|&b| b == b'\n');
        let after = line.map_or(&[][..], |end| &self.bytes[end + 1..]);
        match after.get(..4) {
            Some([1, 0, 0, 0]) => Ok(Order::Little),
            Some([0, 0, 0, 1]) => Ok(Order::Big),
            _ => Err(format!(
                "byte {}: the number one, which tells the order of bytes, does not follow the version: the file is damaged",
                self.begins
            )),
        }
    }
}

/// The sections of a file in their order.
///
/// # Errors
/// A message naming the byte of what is no section, or is not ended.
pub fn pieces(bytes: &[u8]) -> Result<Vec<BinarySection<'_>>, String> {
    let mut pieces = Vec::new();
    let mut at = 0;
    while let Some(skipped) = bytes[at..].iter().position(|b| !b.is_ascii_whitespace()) {
        at += skipped;
        let rest = &bytes[at..];
        let line = rest.split(|&b| b == b'\n').next().unwrap_or_default();
        let name = std::str::from_utf8(line).unwrap_or_default().trim_end();
        let Some(name) = name.strip_prefix('$').filter(|name| !name.is_empty()) else {
            return Err(format!(
                "byte {at}: no section begins where the one before ends: the file is damaged there"
            ));
        };
        let begins = (at + line.len() + 1).min(bytes.len());
        let end = format!("$End{name}");
        let length = (bytes[begins..].windows(end.len()))
            .position(|window| window == end.as_bytes())
            .ok_or_else(|| {
                format!(
                    "byte {at}: {} is not ended: the file was cut",
                    quote(&format!("${name}"))
                )
            })?;
        pieces.push(BinarySection {
            name,
            begins,
            bytes: &bytes[begins..begins + length],
        });
        at = begins + length + end.len();
    }
    Ok(pieces)
}

/// The numbers of a section.
pub struct Bytes<'t> {
    piece: BinarySection<'t>,
    order: Order,
    /// Bytes of it that were read, and those before the record that is read.
    read: usize,
    record: usize,
}

impl<'t> Bytes<'t> {
    #[must_use]
    pub fn of(piece: BinarySection<'t>, order: Order) -> Self {
        Self {
            piece,
            order,
            read: 0,
            record: 0,
        }
    }

    fn left(&self) -> usize {
        self.piece.bytes.len() - self.read
    }

    /// The next bytes, the least one first.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let found = self.piece.bytes[self.read..].first_chunk::<N>();
        let mut bytes = *found.ok_or_else(|| {
            format!(
                "byte {}: ${} ends before all is there that it announces: the file was cut, or a count in it is wrong",
                self.piece.begins + self.read,
                self.piece.name
            )
        })?;
        self.read += N;
        if self.order == Order::Big {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl Stream for Bytes<'_> {
    fn head(&self) -> FilePlace {
        FilePlace::Byte(self.piece.begins)
    }

    fn place(&self) -> FilePlace {
        FilePlace::Byte(self.piece.begins + self.record)
    }

    fn name(&self) -> &str {
        self.piece.name
    }

    fn begin(&mut self) -> Result<(), String> {
        self.record = self.read;
        Ok(())
    }

    fn int(&mut self) -> Result<i64, String> {
        Ok(i32::from_le_bytes(self.take()?).into())
    }

    fn size(&mut self) -> Result<u64, String> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    fn number(&mut self) -> Result<f64, String> {
        let number = f64::from_le_bytes(self.take()?);
        if number.is_finite() {
            return Ok(number);
        }
        Err(format!(
            "byte {}: a number is not finite: the file is damaged there",
            self.piece.begins + self.read - size_of::<f64>()
        ))
    }

    fn end(&mut self) -> Result<(), String> {
        Ok(())
    }

    fn tags(&mut self, count: u64) -> Result<Vec<u64>, String> {
        self.announced(count, "nodes")?;
        (0..count).map(|_| self.size()).collect()
    }

    fn announced(&self, count: u64, what: &str) -> Result<(), String> {
        /// What is counted takes no less.
        const LEAST: u64 = 8;
        let left = self.left() as u64;
        if count <= left / LEAST {
            return Ok(());
        }
        Err(format!(
            "{}: {count} {what} are announced, but ${} has no more than {left} bytes: the file was cut, or the count is wrong",
            self.place(),
            self.piece.name
        ))
    }

    fn finish(self, count: u64, what: &str) -> Result<(), String> {
        let rest = &self.piece.bytes[self.read..];
        if rest.iter().all(u8::is_ascii_whitespace) {
            return Ok(());
        }
        Err(format!(
            "byte {}: ${} goes on after the {count} {what} that it announces: the count is wrong, or the file is damaged",
            self.piece.begins + self.read,
            self.piece.name
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_either_order() {
        let little = [7, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        let big = [0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 1];
        for (bytes, order) in [(little, Order::Little), (big, Order::Big)] {
            let piece = BinarySection {
                name: "Nodes",
                begins: 10,
                bytes: &bytes,
            };
            let mut stream = Bytes::of(piece, order);
            assert_eq!((stream.int(), stream.size()), (Ok(7), Ok(1)));
            let said = stream.number().unwrap_err();
            assert!(said.contains("byte 22") && said.contains("cut"), "{said}");
        }
    }

    #[test]
    fn sections_are_parted() {
        let text = b"$A\none\n$EndA\n\n$B\n\x00\x01$EndB";
        let all = pieces(text).unwrap();
        let named: Vec<_> = all.iter().map(|p| (p.name, p.bytes)).collect();
        assert_eq!(named, [("A", &b"one\n"[..]), ("B", &b"\x00\x01"[..])]);
        assert!(pieces(b"$A\none").err().unwrap().contains("not ended"));
        assert!(pieces(b"junk\n$A\n$EndA").err().unwrap().contains("byte 0"));
    }
}
