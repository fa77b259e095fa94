//! Gmsh meshes, versions 2.2 and 4.1, as text.

use std::collections::HashMap;

use glam::DVec3;

use super::{Soup, Tets};

/// Elements by Gmsh's numbers of their kinds: nodes, and what they are.
fn kind(number: usize) -> Option<(usize, &'static str)> {
    Some(match number {
        1 => (2, "line"),
        2 => (3, "triangle"),
        3 => (4, "quadrangle"),
        4 => (4, "tetrahedron"),
        5 => (8, "hexahedron"),
        6 => (6, "prism"),
        7 => (5, "pyramid"),
        8 => (3, "line"),
        9 => (6, "triangle"),
        10 => (9, "quadrangle"),
        11 => (10, "tetrahedron"),
        15 => (1, "point"),
        16 => (8, "quadrangle"),
        _ => return None,
    })
}

/// The lines of one section.
struct Section<'t> {
    words: std::iter::Peekable<std::str::SplitWhitespace<'t>>,
    name: &'t str,
}

impl<'t> Section<'t> {
    fn of(text: &'t str, name: &'t str) -> Result<Self, String> {
        let missing = || format!("the section ${name} is missing or not ended");
        let from = text
            .find(&format!("${name}\n"))
            .or_else(|| text.find(&format!("${name}\r")));
        let body = &text[from.ok_or_else(missing)? + name.len() + 1..];
        let to = body.find(&format!("$End{name}")).ok_or_else(missing)?;
        Ok(Self {
            words: body[..to].split_whitespace().peekable(),
            name,
        })
    }

    fn next<T: std::str::FromStr>(&mut self) -> Result<T, String> {
        let word = self.words.next();
        let word = word.ok_or_else(|| format!("the section ${} ends too early", self.name))?;
        word.parse()
            .map_err(|_| format!("“{word}” in ${} is no number", self.name))
    }

    fn skip(&mut self, count: usize) -> Result<(), String> {
        (0..count).try_for_each(|_| self.next::<f64>().map(|_| ()))
    }
}

/// Reads a mesh.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut format = Section::of(&text, "MeshFormat")?;
    let version: f64 = format.next()?;
    let binary: u32 = format.next()?;
    if binary != 0 {
        return Err("the file is binary: in Gmsh choose “Save as… ASCII”, or write it with -format msh41 without -bin".into());
    }
    let mut nodes = HashMap::new();
    let mut soup = Soup::default();
    let mut reader = Reader {
        soup: &mut soup,
        numbers: &mut nodes,
        tets: Tets::default(),
    };
    match version {
        v if (2.0..3.0).contains(&v) => reader.second(&text)?,
        v if (4.1..5.0).contains(&v) => reader.fourth(&text)?,
        v => {
            return Err(format!(
                "Gmsh format {v} is not read: save it as version 2.2 or 4.1"
            ));
        }
    }
    let tets = reader.tets;
    soup.take_tets(tets);
    Ok(soup)
}

struct Reader<'s> {
    soup: &'s mut Soup,
    /// The file's numbers of the nodes.
    numbers: &'s mut HashMap<u64, u32>,
    tets: Tets,
}

impl Reader<'_> {
    fn node(&mut self, tag: u64, p: [f64; 3]) -> Result<(), String> {
        let number = self.soup.positions.len() as u32;
        if self.numbers.insert(tag, number).is_some() {
            return Err(format!("node {tag} is there twice"));
        }
        self.soup.positions.push(DVec3::from_array(p));
        Ok(())
    }

    fn element(&mut self, tag: u64, kind_number: usize, nodes: &[u64]) -> Result<(), String> {
        let find = |n: &u64| {
            let number = self.numbers.get(n).copied();
            number.ok_or_else(|| format!("element {tag} names node {n}, which is not there"))
        };
        let found: Vec<u32> = nodes.iter().map(find).collect::<Result<_, _>>()?;
        match kind_number {
            2 | 9 => self.soup.triangles.push([found[0], found[1], found[2]]),
            3 | 10 | 16 => {
                self.soup.triangles.push([found[0], found[1], found[2]]);
                self.soup.triangles.push([found[0], found[2], found[3]]);
            }
            4 => self
                .tets
                .linear
                .push([found[0], found[1], found[2], found[3]]),
            11 => {
                let mut all: [u32; 10] = std::array::from_fn(|k| found[k]);
                // Gmsh has the nodes on the edges 23 and 13 the other way round.
                all.swap(8, 9);
                self.tets.quadratic.push(all);
            }
            5..=7 => {
                let what = kind(kind_number).map_or("?", |k| k.1);
                return Err(format!(
                    "element {tag} is a {what}: only tetrahedra are computed on. Mesh the part with tetrahedra"
                ));
            }
            _ => {}
        }
        Ok(())
    }

    fn nodes_of(section: &mut Section, kind_number: usize) -> Result<Vec<u64>, String> {
        let (count, _) = kind(kind_number)
            .ok_or_else(|| format!("elements of Gmsh's kind {kind_number} are not known"))?;
        (0..count).map(|_| section.next()).collect()
    }

    fn second(&mut self, text: &str) -> Result<(), String> {
        let mut section = Section::of(text, "Nodes")?;
        let count: usize = section.next()?;
        for _ in 0..count {
            let tag = section.next()?;
            let p = [section.next()?, section.next()?, section.next()?];
            self.node(tag, p)?;
        }
        let mut section = Section::of(text, "Elements")?;
        let count: usize = section.next()?;
        for _ in 0..count {
            let (tag, kind_number): (u64, usize) = (section.next()?, section.next()?);
            let tags: usize = section.next()?;
            section.skip(tags)?;
            let nodes = Self::nodes_of(&mut section, kind_number)?;
            self.element(tag, kind_number, &nodes)?;
        }
        Ok(())
    }

    fn fourth(&mut self, text: &str) -> Result<(), String> {
        let mut section = Section::of(text, "Nodes")?;
        let blocks: usize = section.next()?;
        section.skip(3)?;
        for _ in 0..blocks {
            let dimension: usize = section.next()?;
            section.skip(1)?;
            let parametric: usize = section.next()?;
            let count: usize = section.next()?;
            let mut tags = Vec::new();
            for _ in 0..count {
                tags.push(section.next()?);
            }
            for tag in tags {
                let p = [section.next()?, section.next()?, section.next()?];
                section.skip(if parametric == 0 { 0 } else { dimension.min(3) })?;
                self.node(tag, p)?;
            }
        }
        let mut section = Section::of(text, "Elements")?;
        let blocks: usize = section.next()?;
        section.skip(3)?;
        for _ in 0..blocks {
            section.skip(2)?;
            let (kind_number, count): (usize, usize) = (section.next()?, section.next()?);
            for _ in 0..count {
                let tag = section.next()?;
                let nodes = Self::nodes_of(&mut section, kind_number)?;
                self.element(tag, kind_number, &nodes)?;
            }
        }
        Ok(())
    }
}
