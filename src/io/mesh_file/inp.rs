//! Tetrahedra from Abaqus and `CalculiX` input files.

use std::collections::HashMap;

use glam::DVec3;

use super::{Soup, Tets};

/// What the lines after a keyword are.
enum Reading {
    Nothing,
    Nodes,
    /// Tetrahedra of so many nodes.
    Elements(usize),
    /// Nodes of a set, by its name; whether they are ranges.
    Set(String, bool),
}

/// Reads nodes, tetrahedra and sets of nodes.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut soup = Soup::default();
    let mut numbers: HashMap<u64, u32> = HashMap::new();
    let mut elements: Vec<Vec<u64>> = Vec::new();
    let mut sets: Vec<(String, Vec<u64>)> = Vec::new();
    let mut reading = Reading::Nothing;
    let mut waiting: Vec<u64> = Vec::new();
    for (row, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with("**") {
            continue;
        }
        if let Some(keyword) = line.strip_prefix('*') {
            reading = keyword_of(keyword)?;
            if let Reading::Set(name, _) = &reading {
                sets.push((name.clone(), Vec::new()));
            }
            continue;
        }
        let place = |what: &str| format!("line {}: {what}", row + 1);
        let words = || line.split(',').map(str::trim).filter(|w| !w.is_empty());
        let integers = || -> Result<Vec<u64>, String> {
            let number = |w: &str| w.parse().map_err(|_| place(&format!("“{w}” is no number")));
            words().map(number).collect()
        };
        match &reading {
            Reading::Nothing => {}
            Reading::Nodes => {
                let values: Vec<f64> = words()
                    .map(|w| w.parse().map_err(|_| place(&format!("“{w}” is no number"))))
                    .collect::<Result<_, _>>()?;
                let [tag, x, y, z] = values[..] else {
                    return Err(place("a node has a number and three coordinates"));
                };
                let number = soup.positions.len() as u32;
                if numbers.insert(tag as u64, number).is_some() {
                    return Err(place(&format!(
                        "node {tag} is there twice: a file of several parts is not read, write one part into a file"
                    )));
                }
                soup.positions.push(DVec3::new(x, y, z));
            }
            Reading::Elements(count) => {
                waiting.extend(integers()?);
                if waiting.len() > *count {
                    elements.push(std::mem::take(&mut waiting));
                }
            }
            Reading::Set(_, ranges) => {
                let numbers = integers()?;
                let Some((_, set)) = sets.last_mut() else {
                    continue;
                };
                if *ranges {
                    let [first, last, ..] = numbers[..] else {
                        return Err(place("a range has a first and a last node"));
                    };
                    let step = numbers.get(2).copied().unwrap_or(1).max(1);
                    set.extend((first..=last.min(first + 100_000_000)).step_by(step as usize));
                } else {
                    set.extend(numbers);
                }
            }
        }
    }
    let mut tets = Tets::default();
    for element in &elements {
        let nodes: Vec<u32> = (element[1..].iter())
            .map(|n| {
                let number = numbers.get(n).copied();
                let missing =
                    || format!("element {} names node {n}, which is not there", element[0]);
                number.ok_or_else(missing)
            })
            .collect::<Result<_, _>>()?;
        match nodes.len() {
            4 => tets.linear.push([nodes[0], nodes[1], nodes[2], nodes[3]]),
            10 => tets.quadratic.push(std::array::from_fn(|k| nodes[k])),
            n => return Err(format!("element {} has {n} nodes", element[0])),
        }
    }
    if elements.is_empty() {
        return Err("it has no tetrahedra (C3D4 or C3D10): mesh the part with them".into());
    }
    soup.node_sets = sets
        .into_iter()
        .map(|(name, nodes)| {
            let known = nodes.iter().filter_map(|n| numbers.get(n).copied());
            (name, known.collect())
        })
        .collect();
    soup.take_tets(tets);
    Ok(soup)
}

fn keyword_of(keyword: &str) -> Result<Reading, String> {
    let mut words = keyword.split(',').map(str::trim);
    let name = words.next().unwrap_or_default().to_uppercase();
    let options: Vec<(String, String)> = words
        .map(|w| match w.split_once('=') {
            Some((k, v)) => (k.trim().to_uppercase(), v.trim().to_owned()),
            None => (w.to_uppercase(), String::new()),
        })
        .collect();
    let option = |key: &str| {
        options
            .iter()
            .find(|(k, _)| k == key)
            .map(|(_, v)| v.clone())
    };
    Ok(match name.as_str() {
        "NODE" => Reading::Nodes,
        "ELEMENT" => {
            let kind = option("TYPE").unwrap_or_default().to_uppercase();
            match kind.as_str() {
                "C3D4" | "C3D4H" => Reading::Elements(4),
                "C3D10" | "C3D10M" | "C3D10H" | "C3D10T" | "C3D10HS" => Reading::Elements(10),
                k if k.starts_with("C3D") => {
                    return Err(format!(
                        "elements of type {kind} are not computed on: mesh the part with tetrahedra (C3D4 or C3D10)"
                    ));
                }
                _ => Reading::Nothing,
            }
        }
        "NSET" => match option("NSET") {
            Some(set) => Reading::Set(set, option("GENERATE").is_some()),
            None => Reading::Nothing,
        },
        "INCLUDE" => return Err("it includes other files: put everything into one".into()),
        _ => Reading::Nothing,
    })
}
