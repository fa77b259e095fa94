//! An order of elimination for nodes of a grid: nested dissection by its planes.
//!
//! Nodes on a plane between cells part those on its two sides from each other, so they are eliminated after
//! both (A. George 1973).

/// Nodes of a piece that is not parted further.
const LEAF: usize = 40;

/// Nodes in the order of elimination. `places` are lattice numbers of the nodes, `order` of them a cell.
#[must_use]
pub fn dissect(places: &[[u32; 3]], order: u32) -> Vec<u32> {
    let mut nodes: Vec<u32> = (0..places.len() as u32).collect();
    let mut eliminated = Vec::with_capacity(nodes.len());
    part(places, order, &mut nodes, &mut eliminated);
    eliminated
}

fn part(places: &[[u32; 3]], order: u32, nodes: &mut [u32], into: &mut Vec<u32>) {
    let Some((axis, plane)) = separator(places, order, nodes) else {
        into.extend_from_slice(nodes);
        return;
    };
    let side = |node: u32| places[node as usize][axis].cmp(&plane);
    let mut below: Vec<u32> = nodes.iter().copied().filter(|&n| side(n).is_lt()).collect();
    let mut above: Vec<u32> = nodes.iter().copied().filter(|&n| side(n).is_gt()).collect();
    let between: Vec<u32> = nodes.iter().copied().filter(|&n| side(n).is_eq()).collect();
    part(places, order, &mut below, into);
    part(places, order, &mut above, into);
    into.extend(between);
}

/// The plane between cells that costs least: few nodes on it, many on both sides.
fn separator(places: &[[u32; 3]], order: u32, nodes: &[u32]) -> Option<(usize, u32)> {
    if nodes.len() <= LEAF {
        return None;
    }
    let mut best: Option<(f64, usize, u32)> = None;
    for axis in 0..3 {
        let at = |&n: &u32| places[n as usize][axis];
        let (low, high) = (nodes.iter().map(at).min()?, nodes.iter().map(at).max()?);
        let mut counts = vec![0usize; (high - low + 1) as usize];
        for node in nodes {
            counts[(at(node) - low) as usize] += 1;
        }
        let mut below = 0;
        for (k, &on) in counts.iter().enumerate() {
            let plane = low + k as u32;
            let above = nodes.len() - below - on;
            if plane.is_multiple_of(order) && below > 0 && above > 0 {
                let balance = below.min(above) as f64 / nodes.len() as f64;
                let cost = on as f64 / balance;
                if best.is_none_or(|b| cost < b.0) {
                    best = Some((cost, axis, plane));
                }
            }
            below += on;
        }
    }
    best.map(|(_, axis, plane)| (axis, plane))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_once_and_separators_last() {
        let places: Vec<[u32; 3]> = (0..21 * 9 * 5)
            .map(|n| [n % 21, n / 21 % 9, n / 21 / 9])
            .collect();
        let order = dissect(&places, 2);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..places.len() as u32));
        let last: Vec<u32> = order[order.len() - 45..].to_vec();
        assert!(
            last.iter()
                .all(|&n| places[n as usize][0] == places[last[0] as usize][0])
        );
    }
}
