//! Two halves of some elements with few nodes between them.
//!
//! Elements are taken together in pairs, those that have most in common, and pairs in pairs, until few are left (B. Hendrickson
//! and R. Leland 1995). These are cut in the middle along several lines and on the way through them, and the best cut is carried back
//! to the elements step by step. On every step it is mended: single elements are moved across, the most useful one first
//! and each once, and the best of what came by is kept (C. M. Fiduccia and R. M. Mattheyses 1982).

use std::collections::BTreeSet;

use super::hypergraph::{Hypergraph, Net};

/// Which side each element is on, how many of either side a net has, and what that comes to.
struct Halves<'a> {
    graph: &'a Hypergraph,
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
/// Cuts that are mended: those with the fewest nodes between.
const MENDED: usize = 3;
/// The smaller half is no less than this share, rounded down.
const SMALLER: f64 = 0.4;
/// Moves in vain after which one looks no further: so many, and a share of the elements.
const PATIENCE: (usize, f64) = (25, 0.02);
const PASSES: usize = 8;

/// The side of each of at least two elements: none is empty.
#[must_use]
pub fn halves(graph: &Hypergraph) -> Vec<bool> {
    if graph.count() > FEW
        && let Some((coarser, places)) = graph.in_pairs()
    {
        let sides = halves(&coarser);
        let sides = places.iter().map(|&at| sides[at as usize]).collect();
        return Halves::new(graph, sides).mended().sides;
    }
    let mut cuts: Vec<Halves> = graph
        .ways()
        .iter()
        .map(|way| Halves::cut(graph, way))
        .collect();
    cuts.sort_by_key(|halves| halves.between);
    cuts.truncate(MENDED);
    let mended = cuts.into_iter().map(Halves::mended);
    let best = mended.min_by(|a, b| a.cost().total_cmp(&b.cost()));
    best.map_or_else(Vec::new, |halves| halves.sides)
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

impl<'a> Halves<'a> {
    fn cut(graph: &'a Hypergraph, way: &[u32]) -> Self {
        let all: u32 = graph.weights.iter().sum();
        let mut sides = vec![false; way.len()];
        let mut before = 0;
        for (at, &element) in way.iter().enumerate() {
            let is_last = at + 1 == way.len();
            sides[element as usize] = at > 0 && (is_last || 2 * before >= all);
            before += graph.weights[element as usize];
        }
        Self::new(graph, sides)
    }

    fn new(graph: &'a Hypergraph, sides: Vec<bool>) -> Self {
        let count = |net: &Net| {
            let other = net.elements.iter().filter(|&&e| sides[e as usize]).count() as u32;
            [net.elements.len() as u32 - other, other]
        };
        let counts: Vec<[u32; 2]> = graph.nets.iter().map(count).collect();
        let cut = counts
            .iter()
            .zip(&graph.nets)
            .filter(|(c, _)| c[0] > 0 && c[1] > 0);
        let mut sizes = [0; 2];
        for (&side, &weight) in sides.iter().zip(&graph.weights) {
            sizes[usize::from(side)] += weight;
        }
        Self {
            graph,
            between: cut.map(|(_, net)| net.nodes).sum(),
            sizes,
            counts,
            sides,
        }
    }

    /// Nodes between for every element of the smaller half.
    fn cost(&self) -> f64 {
        f64::from(self.between) / f64::from(self.sizes[0].min(self.sizes[1]))
    }

    /// How many nodes fewer are between the halves when an element goes to the other one.
    fn gain(&self, element: u32) -> i32 {
        let side = usize::from(self.sides[element as usize]);
        let of = |&net: &u32| {
            let (counts, nodes) = (
                self.counts[net as usize],
                self.graph.nets[net as usize].nodes,
            );
            match (counts[side], counts[1 - side]) {
                (1, 1..) => nodes,
                (2.., 0) => -nodes,
                _ => 0,
            }
        };
        self.graph.of[element as usize].iter().map(of).sum()
    }

    fn move_across(&mut self, element: u32) {
        self.between -= self.gain(element);
        let side = usize::from(self.sides[element as usize]);
        for &net in &self.graph.of[element as usize] {
            self.counts[net as usize][side] -= 1;
            self.counts[net as usize][1 - side] += 1;
        }
        self.sizes[side] -= self.graph.weights[element as usize];
        self.sizes[1 - side] += self.graph.weights[element as usize];
        self.sides[element as usize] = side == 0;
    }

    fn mended(mut self) -> Self {
        for _ in 0..PASSES {
            let before = self.cost();
            self.mend();
            if self.cost() >= before {
                break;
            }
        }
        self
    }

    /// Moves elements across and goes back to the best of what came by.
    fn mend(&mut self) {
        let patience = PATIENCE.0 + (PATIENCE.1 * self.graph.count() as f64) as usize;
        let mut movable = self.at_the_cut();
        let mut is_moved = vec![false; self.graph.count()];
        let (mut moved, mut best, mut least) = (Vec::new(), 0, self.cost());
        while moved.len() < best + patience
            && let Some(element) = self.next(&movable)
        {
            is_moved[element as usize] = true;
            movable.take(element, usize::from(self.sides[element as usize]));
            self.move_across(element);
            moved.push(element);
            for &near in self.graph.nets_with(element).flat_map(|net| &net.elements) {
                if !is_moved[near as usize] {
                    let side = usize::from(self.sides[near as usize]);
                    movable.renew(near, side, self.gain(near));
                }
            }
            if self.cost() < least {
                (best, least) = (moved.len(), self.cost());
            }
        }
        for &element in moved[best..].iter().rev() {
            self.move_across(element);
        }
    }

    fn at_the_cut(&self) -> Movable {
        let mut movable = Movable {
            by_side: Default::default(),
            gains: vec![None; self.graph.count()],
        };
        for (net, counts) in self.graph.nets.iter().zip(&self.counts) {
            if counts[0] > 0 && counts[1] > 0 {
                for &element in &net.elements {
                    let side = usize::from(self.sides[element as usize]);
                    movable.renew(element, side, self.gain(element));
                }
            }
        }
        movable
    }

    /// The one that gains most, of the larger half where two do: no half becomes too small.
    fn next(&self, movable: &Movable) -> Option<u32> {
        let all = self.sizes[0] + self.sizes[1];
        let least = (SMALLER * f64::from(all)).floor().max(1.0) as u32;
        let of = |side: usize| {
            let &(gain, element) = movable.by_side[side].last()?;
            let fits = self.sizes[side] >= least + self.graph.weights[element as usize];
            fits.then_some((gain, self.sizes[side], element))
        };
        of(0).max(of(1)).map(|best| best.2)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Squares of a board of so many by so many, with the edges and corners between them.
    fn board(width: u32, height: u32) -> Hypergraph {
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
        Hypergraph::new(nets, centres.collect())
    }

    #[test]
    fn a_long_board_is_cut_across() {
        for (width, height) in [(40, 5), (5, 40), (9, 3)] {
            let squares = board(width, height);
            let found = Halves::new(&squares, halves(&squares));
            let short = width.min(height) as i32;
            assert!(found.between <= 5 * short, "{}", found.between);
            let share = f64::from(found.sizes[0]) / f64::from(width * height);
            assert!((0.39..=0.61).contains(&share), "{share}");
        }
    }

    #[test]
    fn moving_keeps_the_count_of_what_is_between() {
        let squares = board(12, 7);
        let mut halves = Halves::cut(&squares, &squares.along(DVec3::new(1.0, 1.0, 0.0)));
        for element in [3, 40, 41, 83, 3] {
            halves.move_across(element);
            let anew = Halves::new(&squares, halves.sides.clone());
            assert_eq!((halves.between, halves.sizes), (anew.between, anew.sizes));
            assert_eq!(halves.counts, anew.counts);
        }
        let ragged = halves.cost();
        assert!(halves.mended().cost() < 0.9 * ragged);
    }

    #[test]
    fn halves_lose_what_lies_between_and_nothing_else() {
        let squares = board(8, 8);
        let sides = halves(&squares);
        let of = |side| squares.half(&sides, side);
        let nets = |squares: &Hypergraph| squares.nets.iter().map(|net| net.nodes).sum::<i32>();
        let between = Halves::new(&squares, sides.clone()).between;
        assert_eq!(nets(&of(false)) + nets(&of(true)) + between, nets(&squares));
        assert_eq!(of(false).count() + of(true).count(), 64);
        assert!(of(true).elements().iter().all(|&e| sides[e as usize]));
    }

    #[test]
    fn two_elements_and_some_that_have_nothing_in_common() {
        for count in [2, 3, 100] {
            let sides = halves(&Hypergraph::new(Vec::new(), vec![DVec3::ZERO; count]));
            let ones = sides.iter().filter(|&&s| s).count();
            assert!(ones > 0 && ones < count, "{count}: {ones}");
        }
    }
}
