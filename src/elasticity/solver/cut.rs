//! Where the elimination tree is cut in two.

/// A branch with no more than this share of all rows lies below the cut, whole. Twice or half as many make a tenth of a difference to
/// what reading thousands of sites under thousands of touches takes.
const SHARE: usize = 16;

/// Which supernodes lie above the cut: with every one all that are above it in the tree.
pub struct Cut(Vec<bool>);

impl Cut {
    /// Of supernodes in the order of elimination, each with its columns and the supernode above it.
    pub fn new(nodes: impl ExactSizeIterator<Item = (usize, Option<u32>)>) -> Self {
        let mut branches = vec![0; nodes.len()];
        let mut all = 0;
        for (node, (columns, above)) in nodes.enumerate() {
            branches[node] += columns;
            all += columns;
            if let Some(above) = above {
                branches[above as usize] += branches[node];
            }
        }
        let is_above = |branch: usize| branch > all / SHARE;
        Self(branches.into_iter().map(is_above).collect())
    }

    /// With nothing above it.
    pub fn at_the_root(count: usize) -> Self {
        Self(vec![false; count])
    }

    /// Whether a supernode lies above.
    pub fn is_above(&self, node: u32) -> bool {
        self.0[node as usize]
    }
}
