//! Elements and what they have in common, as a hypergraph: parts of it, and coarser ones.

use std::collections::HashMap;

use glam::DVec3;

/// What some elements have in common: a corner, an edge or a face, with so many nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Net {
    /// Rising.
    pub elements: Vec<u32>,
    /// How many nodes it has of its own.
    pub nodes: i32,
}

/// Some elements, by their places among them, and the nets between them.
pub struct Hypergraph {
    /// The numbers of the elements.
    elements: Vec<u32>,
    /// What several of them have in common.
    pub nets: Vec<Net>,
    /// The nets of each.
    pub of: Vec<Vec<u32>>,
    centres: Vec<DVec3>,
    /// How many elements each one stands for.
    pub weights: Vec<u32>,
}

/// An element that several are taken together in is no larger than this share of all.
const LARGEST: u32 = 16;

impl Hypergraph {
    /// All elements around these points (m), with what they have in common.
    #[must_use]
    pub fn new(nets: Vec<Net>, centres: Vec<DVec3>) -> Self {
        let count = centres.len();
        Self::of((0..count as u32).collect(), nets, vec![1; count], centres)
    }

    fn of(elements: Vec<u32>, nets: Vec<Net>, weights: Vec<u32>, centres: Vec<DVec3>) -> Self {
        let mut of = vec![Vec::new(); weights.len()];
        for (number, net) in (0u32..).zip(&nets) {
            for &element in &net.elements {
                of[element as usize].push(number);
            }
        }
        Self {
            elements,
            nets,
            of,
            centres,
            weights,
        }
    }

    /// The numbers of the elements.
    #[must_use]
    pub fn elements(&self) -> &[u32] {
        &self.elements
    }

    /// How many elements there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.elements.len()
    }

    /// The elements on one side, with the nets that only they have.
    #[must_use]
    pub fn half(&self, sides: &[bool], side: bool) -> Self {
        let on: Vec<u32> = (0u32..)
            .zip(sides)
            .filter(|s| *s.1 == side)
            .map(|s| s.0)
            .collect();
        let mut places = vec![None; sides.len()];
        for (place, &element) in (0u32..).zip(&on) {
            places[element as usize] = Some(place);
        }
        let nets = self.nets.iter().filter_map(|net| {
            let elements = net.elements.iter().map(|&e| places[e as usize]);
            Some(Net {
                elements: elements.collect::<Option<_>>()?,
                nodes: net.nodes,
            })
        });
        Self::of(
            on.iter().map(|&e| self.elements[e as usize]).collect(),
            nets.collect(),
            on.iter().map(|&e| self.weights[e as usize]).collect(),
            on.iter().map(|&e| self.centres[e as usize]).collect(),
        )
    }

    /// With pairs of elements as one, and which one each element is in then. Nothing where too few have anything in common.
    #[must_use]
    pub fn in_pairs(&self) -> Option<(Self, Vec<u32>)> {
        let pairs = self.pairs();
        if 10 * pairs.len() > 9 * self.of.len() {
            return None;
        }
        let mut places = vec![0; self.of.len()];
        let (mut weights, mut centres) = (Vec::new(), Vec::new());
        for (place, &(one, other)) in (0u32..).zip(&pairs) {
            let both = [Some(one), other];
            let both = both.into_iter().flatten().map(|e| e as usize);
            let (mut weight, mut moment) = (0, DVec3::ZERO);
            for element in both {
                places[element] = place;
                weight += self.weights[element];
                moment += self.centres[element] * f64::from(self.weights[element]);
            }
            weights.push(weight);
            centres.push(moment / f64::from(weight));
        }
        let numbers = (0..pairs.len() as u32).collect();
        Some((
            Self::of(numbers, self.nets_of(&places), weights, centres),
            places,
        ))
    }

    /// Each element once, with the one that it has most in common with for the size of that.
    fn pairs(&self) -> Vec<(u32, Option<u32>)> {
        let largest = (self.weights.iter().sum::<u32>() / LARGEST).max(2);
        let mut is_taken = vec![false; self.of.len()];
        let mut common = vec![0.0; self.of.len()];
        let mut pairs = Vec::new();
        for element in 0..self.of.len() as u32 {
            if std::mem::replace(&mut is_taken[element as usize], true) {
                continue;
            }
            let mut near: Vec<u32> = Vec::new();
            for net in self.nets_with(element) {
                let each = f64::from(net.nodes) / (net.elements.len() - 1) as f64;
                for &other in net.elements.iter().filter(|&&o| !is_taken[o as usize]) {
                    if common[other as usize] == 0.0 {
                        near.push(other);
                    }
                    common[other as usize] += each;
                }
            }
            let weight = |e: u32| self.weights[e as usize];
            let worth = |e: u32| common[e as usize] / f64::from(weight(e));
            let fitting = near
                .iter()
                .copied()
                .filter(|&o| weight(element) + weight(o) <= largest);
            let best = fitting.max_by(|&a, &b| worth(a).total_cmp(&worth(b)).then(b.cmp(&a)));
            if let Some(other) = best {
                is_taken[other as usize] = true;
            }
            pairs.push((element, best));
            for other in near {
                common[other as usize] = 0.0;
            }
        }
        pairs
    }

    /// The nets of an element.
    pub fn nets_with(&self, element: u32) -> impl Iterator<Item = &Net> {
        let nets = self.of[element as usize].iter();
        nets.map(|&net| &self.nets[net as usize])
    }

    /// The nets between elements that have become others.
    fn nets_of(&self, places: &[u32]) -> Vec<Net> {
        merged(self.nets.iter().map(|net| {
            let mut elements: Vec<u32> = net.elements.iter().map(|&e| places[e as usize]).collect();
            elements.sort_unstable();
            elements.dedup();
            Net {
                elements,
                nodes: net.nodes,
            }
        }))
    }

    /// Orders of the elements that may be cut in the middle.
    #[must_use]
    pub fn ways(&self) -> Vec<Vec<u32>> {
        let steps = [-1.0, 0.0, 1.0];
        let directions = (0..27).map(|k| DVec3::new(steps[k % 3], steps[k / 3 % 3], steps[k / 9]));
        // One of each two that are opposite.
        let mut ways: Vec<Vec<u32>> = directions.skip(14).map(|d| self.along(d)).collect();
        let mut last = 0;
        for _ in 0..3 {
            let way = self.outward(last);
            last = way.last().copied().unwrap_or(0);
            ways.push(way);
        }
        ways
    }

    /// As they lie in a direction.
    #[must_use]
    pub fn along(&self, direction: DVec3) -> Vec<u32> {
        let value = |e: u32| self.centres[e as usize].dot(direction);
        let mut order: Vec<u32> = (0..self.of.len() as u32).collect();
        order.sort_by(|&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
        order
    }

    /// As they are met from one of them, and then those that cannot be.
    fn outward(&self, from: u32) -> Vec<u32> {
        let count = self.of.len();
        let mut is_met = vec![false; count];
        let mut order = Vec::with_capacity(count);
        for start in std::iter::once(from).chain(0..count as u32) {
            let mut at = order.len();
            if !std::mem::replace(&mut is_met[start as usize], true) {
                order.push(start);
            }
            while let Some(&element) = order.get(at) {
                at += 1;
                for &next in self.nets_with(element).flat_map(|net| &net.elements) {
                    if !std::mem::replace(&mut is_met[next as usize], true) {
                        order.push(next);
                    }
                }
            }
        }
        order
    }
}

/// Those between at least two elements, equal ones as one.
#[must_use]
pub fn merged(nets: impl Iterator<Item = Net>) -> Vec<Net> {
    let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
    let mut merged: Vec<Net> = Vec::new();
    for Net { elements, nodes } in nets.filter(|net| net.elements.len() > 1) {
        let at = *known.entry(elements).or_insert_with_key(|elements| {
            merged.push(Net {
                elements: elements.clone(),
                nodes: 0,
            });
            merged.len() - 1
        });
        merged[at].nodes += nodes;
    }
    merged
}
