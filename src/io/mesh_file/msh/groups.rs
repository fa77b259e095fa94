//! Physical groups of a Gmsh file: their names, and the nodes of their elements.

use std::collections::{BTreeMap, HashMap};

use super::section::RecordWords;
use super::stream::Stream;
use crate::io::mesh_file::held::NodeSet;

/// Dimension and number of a group: those of points, curves, surfaces and volumes are numbered apart.
type Group = (u64, u64);

/// What groups without a name are called, by their dimension.
const KINDS: [&str; 4] = ["point", "curve", "surface", "volume"];

#[derive(Default)]
pub struct PhysicalGroups {
    names: BTreeMap<Group, String>,
    /// Groups of each entity, by its dimension and number.
    of_entities: HashMap<(u64, i64), Vec<u64>>,
    nodes: BTreeMap<Group, Vec<u32>>,
}

impl PhysicalGroups {
    /// Takes in `$PhysicalNames`, which are text in every file.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn read_names<'t>(
        &mut self,
        mut records: impl Iterator<Item = RecordWords<'t>>,
    ) -> Result<(), String> {
        let Some(mut head) = records.next() else {
            return Ok(());
        };
        let (count, line) = (head.whole()?, head.line);
        head.ends()?;
        let mut read = 0;
        for mut record in records {
            let group = (record.whole()?, record.signed()?.unsigned_abs());
            let name = record.rest();
            self.names.insert(group, name.trim_matches('"').to_owned());
            read += 1;
        }
        if read == count {
            return Ok(());
        }
        Err(format!(
            "line {line}: {count} names of physical groups are announced, and {read} are there: the file was cut, or the count is wrong"
        ))
    }

    /// Takes in $Entities: which groups each belongs to.
    ///
    /// # Errors
    /// A message naming the place.
    pub fn read_entities(&mut self, mut stream: impl Stream) -> Result<(), String> {
        stream.begin()?;
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = stream.size()?;
            stream.announced(*count, "entities")?;
        }
        stream.end()?;
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                self.read_entity(dimension, &mut stream)?;
            }
        }
        stream.finish(counts.iter().sum(), "entities")
    }

    fn read_entity(&mut self, dimension: u64, stream: &mut impl Stream) -> Result<(), String> {
        stream.begin()?;
        let tag = stream.int()?;
        // Where a point is, or the box around anything else.
        let coordinates = if dimension == 0 { 3 } else { 6 };
        for _ in 0..coordinates {
            stream.number()?;
        }
        for _ in 0..stream.size()? {
            let group = stream.int()?.unsigned_abs();
            let groups = self.of_entities.entry((dimension, tag)).or_default();
            groups.push(group);
        }
        if dimension > 0 {
            for _ in 0..stream.size()? {
                stream.int()?;
            }
        }
        stream.end()
    }

    /// The groups that an entity belongs to.
    #[must_use]
    pub fn of_entity(&self, dimension: u64, tag: i64) -> Vec<u64> {
        let groups = self.of_entities.get(&(dimension, tag));
        groups.cloned().unwrap_or_default()
    }

    /// Adds the nodes of an element to groups of a dimension.
    pub fn add(&mut self, dimension: u64, groups: &[u64], nodes: &[u32]) {
        for &group in groups {
            let all = self.nodes.entry((dimension, group)).or_default();
            all.extend_from_slice(nodes);
        }
    }

    /// The nodes of each group by its name; those of one name are one.
    #[must_use]
    pub fn sets(self) -> Vec<NodeSet> {
        let mut sets: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        for (group, nodes) in self.nodes {
            let name = (self.names.get(&group)).filter(|name| !name.is_empty());
            let name = name.cloned().unwrap_or_else(|| {
                let (dimension, tag) = group;
                let kind = KINDS.get(dimension as usize).unwrap_or(&"group");
                format!("{kind} {tag}")
            });
            sets.entry(name).or_default().extend(nodes);
        }
        for nodes in sets.values_mut() {
            nodes.sort_unstable();
            nodes.dedup();
        }
        sets.into_iter().collect()
    }
}
