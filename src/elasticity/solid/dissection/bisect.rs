//! Two halves of some elements with few nodes between them.
//!
//! Elements are taken together in pairs, those that have most in common, and pairs in pairs, until few are left (B. Hendrickson
//! and R. Leland 1995). These are cut in the middle along several lines and on the way through them, and the best cut is carried back
//! to the elements step by step. On every step it is mended: single elements are moved across, the most useful one first
//! and each once, and the best of what came by is kept (C. M. Fiduccia and R. M. Mattheyses 1982).

use std::collections::{BTreeSet, HashMap};

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
pub struct Piece {
    /// The numbers of the elements.
    elements: Vec<u32>,
    nets: Vec<Net>,
    /// The nets of each.
    of: Vec<Vec<u32>>,
    centres: Vec<DVec3>,
    /// How many elements each one stands for.
    weights: Vec<u32>,
}

/// Which side each element is on, how many of either side a net has, and what that comes to.
#[derive(Clone)]
struct Halves {
    sides: Vec<bool>,
    counts: Vec<[u32; 2]>,
    sizes: [u32; 2],
    /// Nodes between them.
    between: i32,
}

/// Elements that may be moved, by the side they are on, with what they gain.
struct Movable {
    by_side: [BTreeSet<(i32, u32)>; 2],
    gains: Vec<Option<i32>>,
}

/// So few elements are not taken together any more.
const FEW: usize = 60;
/// An element that many are taken together in is no larger than this share of all.
const LARGEST: u32 = 16;
/// Cuts that are mended: those with the fewest nodes between.
const MENDED: usize = 3;
/// The smaller half is no less than this share.
const SMALLER: f64 = 0.4;
/// Moves in vain after which one looks no further: so many, and a share of the elements.
const PATIENCE: (usize, f64) = (25, 0.02);
const PASSES: usize = 8;

impl Halves {
    /// Nodes between for every element of the smaller half.
    fn cost(&self) -> f64 {
        f64::from(self.between) / f64::from(self.sizes[0].min(self.sizes[1]))
    }
}

impl Movable {
    fn renew(&mut self, element: u32, side: usize, gain: i32) {
        if let Some(before) = self.gains[element as usize].replace(gain)
            && before != gain
        {
            self.by_side[side].remove(&(before, element));
        }
        self.by_side[side].insert((gain, element));
    }

    fn take(&mut self, element: u32, side: usize) {
        if let Some(gain) = self.gains[element as usize].take() {
            self.by_side[side].remove(&(gain, element));
        }
    }
}

impl Piece {
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

    /// The side of each of at least two elements: none is empty.
    #[must_use]
    pub fn halves(&self) -> Vec<bool> {
        if self.of.len() > FEW
            && let Some((coarser, places)) = self.in_pairs()
        {
            let sides = coarser.halves();
            let sides = places.iter().map(|&at| sides[at as usize]).collect();
            return self.mend(self.parted(sides)).sides;
        }
        let mut cuts: Vec<Halves> = self.ways().iter().map(|way| self.cut(way)).collect();
        cuts.sort_by_key(|halves| halves.between);
        cuts.truncate(MENDED);
        let mended = cuts.into_iter().map(|halves| self.mend(halves));
        let best = mended.min_by(|a, b| a.cost().total_cmp(&b.cost()));
        best.map_or_else(Vec::new, |halves| halves.sides)
    }

    /// With pairs of elements as one, and which one each element is in then. Nothing where too few have anything in common.
    fn in_pairs(&self) -> Option<(Self, Vec<u32>)> {
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

    fn nets_with(&self, element: u32) -> impl Iterator<Item = &Net> {
        let nets = self.of[element as usize].iter();
        nets.map(|&net| &self.nets[net as usize])
    }

    /// The nets between elements that have become others: equal ones are one.
    fn nets_of(&self, places: &[u32]) -> Vec<Net> {
        let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
        let mut nets: Vec<Net> = Vec::new();
        for net in &self.nets {
            let mut elements: Vec<u32> = net.elements.iter().map(|&e| places[e as usize]).collect();
            elements.sort_unstable();
            elements.dedup();
            if elements.len() < 2 {
                continue;
            }
            let at = *known.entry(elements).or_insert_with_key(|elements| {
                nets.push(Net {
                    elements: elements.clone(),
                    nodes: 0,
                });
                nets.len() - 1
            });
            nets[at].nodes += net.nodes;
        }
        nets
    }

    /// Orders of the elements that may be cut in the middle.
    fn ways(&self) -> Vec<Vec<u32>> {
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

    fn along(&self, direction: DVec3) -> Vec<u32> {
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

    fn cut(&self, way: &[u32]) -> Halves {
        let all: u32 = self.weights.iter().sum();
        let mut sides = vec![false; way.len()];
        let mut before = 0;
        for (at, &element) in way.iter().enumerate() {
            let is_last = at + 1 == way.len();
            sides[element as usize] = at > 0 && (is_last || 2 * before >= all);
            before += self.weights[element as usize];
        }
        self.parted(sides)
    }

    fn parted(&self, sides: Vec<bool>) -> Halves {
        let count = |net: &Net| {
            let other = net.elements.iter().filter(|&&e| sides[e as usize]).count() as u32;
            [net.elements.len() as u32 - other, other]
        };
        let counts: Vec<[u32; 2]> = self.nets.iter().map(count).collect();
        let cut = counts
            .iter()
            .zip(&self.nets)
            .filter(|(c, _)| c[0] > 0 && c[1] > 0);
        let mut sizes = [0; 2];
        for (&side, &weight) in sides.iter().zip(&self.weights) {
            sizes[usize::from(side)] += weight;
        }
        Halves {
            between: cut.map(|(_, net)| net.nodes).sum(),
            sizes,
            counts,
            sides,
        }
    }

    /// How many nodes fewer are between the halves when an element goes to the other one.
    fn gain(&self, halves: &Halves, element: u32) -> i32 {
        let side = usize::from(halves.sides[element as usize]);
        let of = |&net: &u32| {
            let (counts, nodes) = (halves.counts[net as usize], self.nets[net as usize].nodes);
            match (counts[side], counts[1 - side]) {
                (1, 1..) => nodes,
                (2.., 0) => -nodes,
                _ => 0,
            }
        };
        self.of[element as usize].iter().map(of).sum()
    }

    fn move_across(&self, halves: &mut Halves, element: u32) {
        halves.between -= self.gain(halves, element);
        let side = usize::from(halves.sides[element as usize]);
        for &net in &self.of[element as usize] {
            halves.counts[net as usize][side] -= 1;
            halves.counts[net as usize][1 - side] += 1;
        }
        halves.sizes[side] -= self.weights[element as usize];
        halves.sizes[1 - side] += self.weights[element as usize];
        halves.sides[element as usize] = side == 0;
    }

    fn mend(&self, mut halves: Halves) -> Halves {
        for _ in 0..PASSES {
            let before = halves.cost();
            self.pass(&mut halves);
            if halves.cost() >= before {
                break;
            }
        }
        halves
    }

    /// Moves elements across and goes back to the best of what came by.
    fn pass(&self, halves: &mut Halves) {
        let patience = PATIENCE.0 + (PATIENCE.1 * self.of.len() as f64) as usize;
        let mut movable = self.at_the_cut(halves);
        let mut is_moved = vec![false; self.of.len()];
        let (mut moved, mut best, mut least) = (Vec::new(), 0, halves.cost());
        while moved.len() < best + patience
            && let Some(element) = self.next(halves, &movable)
        {
            is_moved[element as usize] = true;
            movable.take(element, usize::from(halves.sides[element as usize]));
            self.move_across(halves, element);
            moved.push(element);
            for &near in self.nets_with(element).flat_map(|net| &net.elements) {
                if !is_moved[near as usize] {
                    let side = usize::from(halves.sides[near as usize]);
                    movable.renew(near, side, self.gain(halves, near));
                }
            }
            if halves.cost() < least {
                (best, least) = (moved.len(), halves.cost());
            }
        }
        for &element in moved[best..].iter().rev() {
            self.move_across(halves, element);
        }
    }

    fn at_the_cut(&self, halves: &Halves) -> Movable {
        let mut movable = Movable {
            by_side: Default::default(),
            gains: vec![None; self.of.len()],
        };
        for (net, counts) in self.nets.iter().zip(&halves.counts) {
            if counts[0] > 0 && counts[1] > 0 {
                for &element in &net.elements {
                    let side = usize::from(halves.sides[element as usize]);
                    movable.renew(element, side, self.gain(halves, element));
                }
            }
        }
        movable
    }

    /// The one that gains most, of the larger half where two do: no half becomes too small.
    fn next(&self, halves: &Halves, movable: &Movable) -> Option<u32> {
        let all = halves.sizes[0] + halves.sizes[1];
        let least = ((SMALLER * f64::from(all)) as u32).max(1);
        let of = |side: usize| {
            let &(gain, element) = movable.by_side[side].last()?;
            let fits = halves.sizes[side] >= least + self.weights[element as usize];
            fits.then_some((gain, halves.sizes[side], element))
        };
        of(0).max(of(1)).map(|best| best.2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of a board of so many by so many, with the edges and corners between them.
    fn board(width: u32, height: u32) -> Piece {
        let square = |x: u32, y: u32| y * width + x;
        let mut nets = Vec::new();
        for (x, y) in (0..width * height).map(|k| (k % width, k / width)) {
            let near = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
            let is_in = |p: &&(u32, u32)| p.0 < width && p.1 < height;
            for (members, nodes) in [(&near[..2], 3), (&near[..], 1)] {
                let elements: Vec<u32> = members
                    .iter()
                    .filter(is_in)
                    .map(|p| square(p.0, p.1))
                    .collect();
                if elements.len() > 1 {
                    nets.push(Net { elements, nodes });
                }
            }
            if y + 1 < height {
                let elements = vec![square(x, y), square(x, y + 1)];
                nets.push(Net { elements, nodes: 3 });
            }
        }
        let centres = (0..width * height)
            .map(|k| DVec3::new(f64::from(k % width), f64::from(k / width), 0.0));
        Piece::new(nets, centres.collect())
    }

    #[test]
    fn a_long_board_is_cut_across() {
        for (width, height) in [(40, 5), (5, 40), (9, 3)] {
            let piece = board(width, height);
            let halves = piece.parted(piece.halves());
            let short = width.min(height) as i32;
            assert!(halves.between <= 5 * short, "{}", halves.between);
            let share = f64::from(halves.sizes[0]) / f64::from(width * height);
            assert!((0.39..=0.61).contains(&share), "{share}");
        }
    }

    #[test]
    fn moving_keeps_the_count_of_what_is_between() {
        let piece = board(12, 7);
        let mut halves = piece.cut(&piece.along(DVec3::new(1.0, 1.0, 0.0)));
        for element in [3, 40, 41, 83, 3] {
            piece.move_across(&mut halves, element);
            let anew = piece.parted(halves.sides.clone());
            assert_eq!((halves.between, halves.sizes), (anew.between, anew.sizes));
            assert_eq!(halves.counts, anew.counts);
        }
        let ragged = halves.cost();
        assert!(piece.mend(halves).cost() < 0.9 * ragged);
    }

    #[test]
    fn halves_lose_what_lies_between_and_nothing_else() {
        let piece = board(8, 8);
        let sides = piece.halves();
        let of = |side| piece.half(&sides, side);
        let nets = |piece: &Piece| piece.nets.iter().map(|net| net.nodes).sum::<i32>();
        let between = piece.parted(sides.clone()).between;
        assert_eq!(nets(&of(false)) + nets(&of(true)) + between, nets(&piece));
        assert_eq!(of(false).elements.len() + of(true).elements.len(), 64);
        assert!(of(true).elements.iter().all(|&e| sides[e as usize]));
    }

    #[test]
    fn two_elements_and_some_that_have_nothing_in_common() {
        for count in [2, 3, 100] {
            let sides = Piece::new(Vec::new(), vec![DVec3::ZERO; count]).halves();
            let ones = sides.iter().filter(|&&s| s).count();
            assert!(ones > 0 && ones < count, "{count}: {ones}");
        }
    }
}
