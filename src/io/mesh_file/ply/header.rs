//! The header of a PLY file: what follows it, how much of it, and in which form.

use super::super::words::at;
use crate::plain::quote;

/// The form of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    Text,
    LittleEndian,
    BigEndian,
}

pub struct Property {
    pub name: String,
    pub scalar: Scalar,
    /// The form of the number of entries, where it is a list.
    pub count: Option<Scalar>,
}

pub struct PlyElement {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

pub struct PlyHeader {
    pub form: Form,
    pub elements: Vec<PlyElement>,
    /// Lines and bytes, the last line's end included.
    pub lines: usize,
    pub length: usize,
}

impl PlyHeader {
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut form = None;
        let mut elements: Vec<PlyElement> = Vec::new();
        let mut length = 0;
        for (line, row) in (1..).zip(bytes.split_inclusive(|&b| b == b'\n')) {
            length += row.len();
            let row = String::from_utf8_lossy(row);
            let words: Vec<&str> = row.split_ascii_whitespace().collect();
            let wrong = |what: &str| at(line, what);
            match words[..] {
                ["ply"] if line == 1 => {}
                _ if line == 1 => return Err(wrong("a PLY file begins with the word ply")),
                [] | ["comment" | "obj_info", ..] => {}
                ["format", named, "1.0"] => {
                    let known = form_named(named);
                    form =
                        Some(known.ok_or_else(|| wrong("this form of a PLY file is not known"))?);
                }
                ["format", _, version] => {
                    let said = format!("PLY of version {} is not known: 1.0 is", quote(version));
                    return Err(wrong(&said));
                }
                ["element", name, count] => {
                    if elements.iter().any(|e| e.name == name) {
                        return Err(wrong(&format!("{} is announced twice", quote(name))));
                    }
                    elements.push(PlyElement {
                        name: name.to_owned(),
                        count: count.parse().map_err(|_| {
                            wrong(&format!("{} is no number of elements", quote(count)))
                        })?,
                        properties: Vec::new(),
                    });
                }
                ["property", ..] => {
                    let element = elements.last_mut();
                    let element = element
                        .ok_or_else(|| wrong("a property stands before the first element"))?;
                    let known = property(&words[1..]);
                    let property = known.ok_or_else(|| {
                        let said = quote(&words[1..].join(" "));
                        wrong(&format!("the property {said} is not known"))
                    })?;
                    element.properties.push(property);
                }
                ["end_header"] => {
                    return Ok(Self {
                        form: form.ok_or_else(|| wrong("the header does not say its format"))?,
                        elements,
                        lines: line,
                        length,
                    });
                }
                [first, ..] => {
                    let said = format!("{} is not known in the header", quote(first));
                    return Err(wrong(&said));
                }
            }
        }
        Err("the PLY file is truncated: its header has no end_header".into())
    }

    pub fn element(&self, name: &str) -> Option<&PlyElement> {
        self.elements.iter().find(|e| e.name == name)
    }

    /// Whether there can be as much as is announced, which is not believed before.
    pub fn check_room(&self, body: &[u8]) -> Result<(), String> {
        // The last line of a text may lack its end.
        let mut left = body.len() + 1;
        for element in &self.elements {
            let PlyElement { name, count, .. } = element;
            if *count > 0 && element.properties.is_empty() {
                let name = quote(name);
                return Err(format!(
                    "the elements {name} of the PLY file have no properties"
                ));
            }
            let needed = count.checked_mul(element.least(self.form));
            left = needed.and_then(|n| left.checked_sub(n)).ok_or_else(|| {
                format!(
                    "the PLY file is truncated or damaged: it announces {count} of {}, more than its {} bytes can hold",
                    quote(name),
                    body.len()
                )
            })?;
        }
        Ok(())
    }
}

impl PlyElement {
    /// Fewest bytes that one takes.
    fn least(&self, form: Form) -> usize {
        if form == Form::Text {
            // A digit, and what parts it from the next.
            return 2 * self.properties.len();
        }
        let size = |p: &Property| p.count.unwrap_or(p.scalar).size();
        self.properties.iter().map(size).sum()
    }
}

fn form_named(word: &str) -> Option<Form> {
    Some(match word {
        "ascii" => Form::Text,
        "binary_little_endian" => Form::LittleEndian,
        "binary_big_endian" => Form::BigEndian,
        _ => return None,
    })
}

fn property(words: &[&str]) -> Option<Property> {
    let (count, scalar, name) = match *words {
        ["list", count, scalar, name] => (Some(Scalar::named(count)?), scalar, name),
        [scalar, name] => (None, scalar, name),
        _ => return None,
    };
    Some(Property {
        name: name.to_owned(),
        scalar: Scalar::named(scalar)?,
        count,
    })
}
