//! The sparse stiffness matrix: its pattern, its scaled factor, and solves in blocks.

mod cut;
mod matrix;
mod numeric;
mod reduced;

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::perm::Perm;
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::supernodal::{
    SupernodalLltRef, SupernodeRef, SymbolicSupernodalCholesky,
};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::{Accum, MatMut, MatRef, Par, Side};

use crate::budget::Watch;
use crate::memory;

pub use self::cut::Cut;
pub use self::matrix::{FactorError, Scaled, SymmetricMatrix, bytes, bytes_with};
pub use self::reduced::{BLOCK, ReducedBlock, SolveScratch, common};

/// L Lᵀ of the matrix scaled to a unit diagonal, its rows in the order of elimination.
pub struct Factor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    /// Where each row of the matrix stands in the order of elimination.
    pub order: Vec<u32>,
    /// 1/√ of the diagonal, a row of the matrix each.
    pub scale: Vec<f64>,
    /// Supernode that each row (in the order of elimination) belongs to.
    supernode: Vec<u32>,
    /// Rows below the largest supernode.
    tallest: usize,
    /// Smallest pivot of the scaled matrix: near zero means nearly unheld.
    pub smallest_pivot: f64,
}

/// Right-hand sides, then solutions, of one block: rows in the order of elimination, scaled, [`BLOCK`]
/// columns side by side.
pub struct SolveBlock {
    /// Row-major, dimension × [`BLOCK`].
    pub rows: Vec<f64>,
    /// Supernodes with anything in their rows.
    filled: Vec<bool>,
    below: Vec<f64>,
}

impl Factor {
    /// Factors; what was factored comes back scaled. `order` names the row that is eliminated first, second …; without one, rows
    /// are taken by approximate minimum degree.
    pub fn new(
        matrix: SymmetricMatrix,
        order: Option<Vec<usize>>,
        watch: Watch,
    ) -> Result<(Self, Scaled), FactorError> {
        let n = matrix.dimension();
        if let Some(row) =
            (0..n).find(|&c| matrix.diagonal(c) <= 0.0 || !matrix.diagonal(c).is_finite())
        {
            return Err(FactorError::NotPositive { row });
        }
        let scale: Vec<f64> = (0..n).map(|c| matrix.diagonal(c).sqrt().recip()).collect();
        let symbolic = symbolic(&matrix, order, 1)?;
        let entries = symbolic.len_val();
        check_bytes(bytes_with(entries as f64, matrix.rows.len() as f64))?;
        let mut factor = Self::empty(symbolic, scale);
        let scaled = Scaled::new(matrix, &factor.scale, &factor.order);
        let mut values = Vec::new();
        values
            .try_reserve_exact(entries)
            .map_err(|_| FactorError::OutOfMemory)?;
        let nodes = nodes(&factor.symbolic);
        numeric::factorize(nodes, &scaled, &factor.supernode, &mut values, watch).map_err(
            |error| match error {
                FactorError::NotPositive { row } => FactorError::NotPositive {
                    row: factor.row_at(row),
                },
                other => other,
            },
        )?;
        factor.smallest_pivot = smallest_pivot(nodes, &values);
        factor.values = values;
        Ok((factor, scaled))
    }

    /// The row of the matrix that stands at a place in the order of elimination.
    fn row_at(&self, place: usize) -> usize {
        (self.order.iter())
            .position(|&at| at as usize == place)
            .unwrap_or(place)
    }

    fn empty(symbolic: SymbolicCholesky<usize>, scale: Vec<f64>) -> Self {
        let n = scale.len();
        let order = symbolic.perm().map_or_else(
            || (0..n as u32).collect(),
            |p| p.arrays().1.iter().map(|&i| i as u32).collect(),
        );
        let (mut supernode, mut tallest) = (vec![0; n], 0);
        let l = nodes(&symbolic);
        for s in 0..l.n_supernodes() {
            supernode[l.supernode_begin()[s]..l.supernode_end()[s]].fill(s as u32);
            tallest = tallest.max(l.supernode(s).pattern().len());
        }
        Self {
            symbolic,
            values: Vec::new(),
            order,
            scale,
            supernode,
            tallest,
            smallest_pivot: f64::INFINITY,
        }
    }

    fn supernodes(&self) -> SupernodalLltRef<'_, usize, f64> {
        SupernodalLltRef::new(nodes(&self.symbolic), &self.values)
    }

    /// Number of unknowns.
    pub fn dimension(&self) -> usize {
        self.scale.len()
    }

    /// An empty block.
    pub fn block(&self) -> SolveBlock {
        let l = self.supernodes().symbolic();
        SolveBlock {
            rows: vec![0.0; self.dimension() * BLOCK],
            filled: vec![false; l.n_supernodes()],
            below: vec![0.0; self.tallest * BLOCK],
        }
    }

    /// Empties a block for the next right-hand sides.
    pub fn clear(&self, block: &mut SolveBlock) {
        let symbolic = nodes(&self.symbolic);
        let (begins, ends) = (symbolic.supernode_begin(), symbolic.supernode_end());
        for (node, filled) in block.filled.iter_mut().enumerate() {
            if std::mem::take(filled) {
                block.rows[begins[node] * BLOCK..ends[node] * BLOCK].fill(0.0);
            }
        }
    }

    /// Adds to a right-hand side: `row` as the matrix counts them.
    pub fn load(&self, block: &mut SolveBlock, row: usize, column: usize, value: f64) {
        let at = self.order[row] as usize;
        block.rows[at * BLOCK + column] += value * self.scale[row];
        block.filled[self.supernode[at] as usize] = true;
    }

    /// As [`Self::load`] for a row in the order of elimination and a value that is scaled already.
    pub fn load_place(&self, block: &mut SolveBlock, at: u32, column: usize, value: f64) {
        block.rows[at as usize * BLOCK + column] += value;
        block.filled[self.supernode[at as usize] as usize] = true;
    }

    /// Solves in place. Forward, only the supernodes that a load reaches do any work: loads that lie
    /// near each other, and so in the same branches of the elimination tree, should share a block.
    pub fn solve(&self, block: &mut SolveBlock) {
        self.solve_for(|_| true, block);
    }

    /// As [`Self::solve`] for the rows of the supernodes that are needed, and of all above these, which are needed for them; the
    /// others hold nothing that means anything.
    pub fn solve_for(&self, is_needed: impl Fn(usize) -> bool, block: &mut SolveBlock) {
        let l = self.supernodes();
        let count = l.symbolic().n_supernodes();
        for s in 0..count {
            if block.filled[s] {
                self.forward(l, s, block);
            }
        }
        for s in (0..count).rev().filter(|&s| is_needed(s)) {
            backward(l, s, block);
            block.filled[s] = true;
        }
    }

    /// Divides the lower triangle out of right-hand sides, at most [`BLOCK`], below a cut, with `values` (row in the order of
    /// elimination, column, value); `nodes` are the supernodes below that they reach ([`Self::reach`]), `above` the rows above
    /// ([`Self::rows_above`]).
    pub fn reduce(
        &self,
        (nodes, above): (&[u32], &[u32]),
        cut: &Cut,
        values: impl Iterator<Item = (u32, usize, f64)>,
        scratch: &mut SolveScratch,
        into: &mut ReducedBlock,
    ) {
        let l = self.supernodes();
        let begins = l.symbolic().supernode_begin();
        into.lay_out(nodes, above, |node| self.extent(node).0);
        scratch.lay_out((l.symbolic().n_supernodes(), self.dimension()), into);
        let place = |row: usize| {
            let node = self.supernode[row];
            if cut.is_above(node) {
                scratch.places[row] as usize * BLOCK
            } else {
                (scratch.starts[node as usize] as usize + row - begins[node as usize]) * BLOCK
            }
        };
        for (row, column, value) in values {
            into.rows[place(row as usize) + column] += value;
        }
        for at in 0..nodes.len() {
            let node = l.supernode(nodes[at] as usize);
            let own = into.starts[at] * BLOCK..into.starts[at + 1] * BLOCK;
            let below = divide(node, &mut into.rows[own], &mut scratch.below);
            for (&row, part) in node.pattern().iter().zip(below.chunks_exact(BLOCK)) {
                let x = &mut into.rows[place(row)..][..BLOCK];
                for (x, p) in x.iter_mut().zip(part) {
                    *x -= p;
                }
            }
        }
    }

    /// What right-hand sides that were reduced below a cut read of a block that is solved above it and divided below, where it
    /// reaches `nodes` ([`ReducedBlock::read`]).
    pub fn read(
        &self,
        reduced: &ReducedBlock,
        (solved, nodes): (&[f64], &[u32]),
        gathered: &mut Vec<f64>,
        into: &mut [f64],
    ) {
        let begins = self.supernodes().symbolic().supernode_begin();
        let begin = |node: u32| begins[node as usize];
        reduced.read((solved, nodes), begin, gathered, into);
    }

    /// Where the elimination tree is cut to solve for some right-hand sides above and reduce others below.
    pub fn cut(&self) -> Cut {
        let nodes = 0..self.supernodes_count() as u32;
        Cut::new(nodes.map(|node| (self.extent(node).0, self.above(node))))
    }

    /// The rows above a cut, rising, on which right-hand sides leave something that have something in `rows` and reach `nodes`
    /// below it.
    pub fn rows_above(
        &self,
        nodes: &[u32],
        rows: impl Iterator<Item = u32>,
        cut: &Cut,
    ) -> Vec<u32> {
        // What a supernode leaves on rows above the next one is a part of what that one does.
        let last = |node: &&u32| self.above(**node).is_some_and(|next| cut.is_above(next));
        let pattern = |&node: &u32| self.supernodes().supernode(node as usize).pattern();
        let left = nodes.iter().filter(last).flat_map(pattern);
        let own = rows.filter(|&row| cut.is_above(self.supernode[row as usize]));
        let mut above: Vec<u32> = left.map(|&row| row as u32).chain(own).collect();
        above.sort_unstable();
        above.dedup();
        above
    }

    /// The supernode above another one in the elimination tree.
    fn above(&self, node: u32) -> Option<u32> {
        let first = self.supernodes().supernode(node as usize).pattern().first();
        first.map(|&row| self.supernode[row])
    }

    /// The supernodes, rising, that right-hand sides with something in these rows (in the order of elimination) reach.
    pub fn reach(&self, rows: impl Iterator<Item = u32>) -> Vec<u32> {
        let mut is_reached = vec![false; self.supernodes_count()];
        let mut reached = Vec::new();
        for row in rows {
            let mut at = Some(self.supernode[row as usize]);
            while let Some(s) = at
                && !std::mem::replace(&mut is_reached[s as usize], true)
            {
                reached.push(s);
                at = self.above(s);
            }
        }
        reached.sort_unstable();
        reached
    }

    /// Columns of a supernode, and entries of the factor in them.
    pub fn extent(&self, node: u32) -> (usize, f64) {
        let values = self.supernodes().supernode(node as usize).val();
        (
            values.ncols(),
            values.nrows() as f64 * values.ncols() as f64,
        )
    }

    /// How many supernodes there are.
    pub fn supernodes_count(&self) -> usize {
        self.supernodes().symbolic().n_supernodes()
    }

    /// Entries of the factor.
    pub fn entries(&self) -> f64 {
        self.values.len() as f64
    }

    fn forward(&self, l: SupernodalLltRef<'_, usize, f64>, s: usize, block: &mut SolveBlock) {
        let node = l.supernode(s);
        let own = &mut block.rows[node.start() * BLOCK..][..node.val().ncols() * BLOCK];
        let below = divide(node, own, &mut block.below);
        for (&row, part) in node.pattern().iter().zip(below.chunks_exact(BLOCK)) {
            let into = &mut block.rows[row * BLOCK..][..BLOCK];
            for (x, p) in into.iter_mut().zip(part) {
                *x -= p;
            }
        }
        if let Some(&first) = node.pattern().first() {
            block.filled[self.supernode[first] as usize] = true;
        }
    }
}

/// Divides a supernode's triangle out of its own rows of right-hand sides; what they take from the rows of its pattern then, in
/// a buffer.
fn divide<'b>(
    node: SupernodeRef<'_, usize, f64>,
    own: &mut [f64],
    below: &'b mut Vec<f64>,
) -> &'b [f64] {
    let columns = node.val().ncols();
    let (top, bottom) = node.val().split_at_row(columns);
    let mut x = MatMut::from_row_major_slice_mut(own, columns, BLOCK);
    solve_lower_triangular_in_place(top, x.rb_mut(), Par::Seq);
    let rows = node.pattern().len();
    if below.len() < rows * BLOCK {
        below.resize(rows * BLOCK, 0.0);
    }
    let below = &mut below[..rows * BLOCK];
    let product = MatMut::from_row_major_slice_mut(below, rows, BLOCK);
    matmul(product, Accum::Replace, bottom, x.rb(), 1.0, Par::Seq);
    below
}

fn backward(l: SupernodalLltRef<'_, usize, f64>, s: usize, block: &mut SolveBlock) {
    let node = l.supernode(s);
    let columns = node.val().ncols();
    let (top, bottom) = node.val().split_at_row(columns);
    let below = &mut block.below[..node.pattern().len() * BLOCK];
    for (&row, part) in node.pattern().iter().zip(below.chunks_exact_mut(BLOCK)) {
        part.copy_from_slice(&block.rows[row * BLOCK..][..BLOCK]);
    }
    let own = &mut block.rows[node.start() * BLOCK..][..columns * BLOCK];
    let mut x = MatMut::from_row_major_slice_mut(own, columns, BLOCK);
    if !below.is_empty() {
        let known = MatRef::from_row_major_slice(below, node.pattern().len(), BLOCK);
        matmul(
            x.rb_mut(),
            Accum::Add,
            bottom.transpose(),
            known,
            -1.0,
            Par::Seq,
        );
    }
    solve_upper_triangular_in_place(top.transpose(), x, Par::Seq);
}

/// Refuses what takes too much memory, before it is taken.
///
/// # Errors
/// [`FactorError::TooLarge`].
pub fn check_bytes(bytes: f64) -> Result<(), FactorError> {
    if bytes > memory::allowed() {
        return Err(FactorError::TooLarge { bytes });
    }
    Ok(())
}

/// What a factor will be, found on nodes that have several unknowns each: much quicker than on the unknowns, and as
/// good an order.
pub struct FactorPlan {
    /// How many unknowns the nodes have.
    pub unknowns: f64,
    /// Entries of the factor.
    pub entries: f64,
    /// Entries of the lower triangle of the matrix.
    pub of_matrix: f64,
    /// Multiplications of the factorization, about.
    pub multiplications: f64,
}

impl FactorPlan {
    /// Of nodes coupled with those in their lists (rising, themselves among them), with `each` unknowns, eliminated in
    /// this order.
    ///
    /// # Errors
    /// [`FactorError::OutOfMemory`].
    pub fn new(coupled: &[Vec<u32>], order: &[u32], each: usize) -> Result<Self, FactorError> {
        let (mut columns, mut rows) = (vec![0], Vec::new());
        for (node, list) in coupled.iter().enumerate() {
            let below = list.iter().map(|&n| n as usize).filter(|&n| n >= node);
            rows.extend(below);
            columns.push(rows.len());
        }
        let matrix = SymmetricMatrix {
            columns,
            rows,
            values: Vec::new(),
        };
        let order = order.iter().map(|&node| node as usize).collect();
        let symbolic = symbolic(&matrix, Some(order), each)?;
        let each = each as f64;
        Ok(Self {
            unknowns: each * coupled.len() as f64,
            entries: each.powi(2) * symbolic.len_val() as f64,
            of_matrix: each.powi(2) * matrix.rows.len() as f64,
            multiplications: each.powi(3) * numeric::multiplications(nodes(&symbolic)),
        })
    }

    /// Memory that the matrix and its factor take (bytes).
    #[must_use]
    pub fn bytes(&self) -> f64 {
        bytes_with(self.entries, self.of_matrix)
    }
}

/// Two supernodes of together at most so many columns become one where less than such a share of its entries is zero
/// then (the library's own values).
const MERGED: [(usize, f64); 4] = [(4, 1.0), (16, 0.8), (48, 0.1), (usize::MAX, 0.05)];

/// The pattern of the factor of a matrix whose rows stand for `each` unknowns.
fn symbolic(
    matrix: &SymmetricMatrix,
    order: Option<Vec<usize>>,
    each: usize,
) -> Result<SymbolicCholesky<usize>, FactorError> {
    let n = matrix.dimension();
    let merged = MERGED.map(|(columns, zeros)| (columns.div_ceil(each), zeros));
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        supernodal_params: SymbolicSupernodalParams {
            relax: Some(&merged),
        },
        ..Default::default()
    };
    let order = order.map(|forward| {
        let mut inverse = vec![0; n];
        for (place, &row) in forward.iter().enumerate() {
            inverse[row] = place;
        }
        Perm::new_checked(forward.into(), inverse.into(), n)
    });
    let ordering = match &order {
        Some(order) => SymmetricOrdering::Custom(order.as_ref()),
        None => SymmetricOrdering::Amd,
    };
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &matrix.columns, None, &matrix.rows);
    factorize_symbolic_cholesky(pattern, Side::Lower, ordering, params)
        .map_err(|_| FactorError::OutOfMemory)
}

/// The library was made to build supernodes.
fn nodes(symbolic: &SymbolicCholesky<usize>) -> &SymbolicSupernodalCholesky<usize> {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(s) => s,
        SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodes were asked for"),
    }
}

fn smallest_pivot(symbolic: &SymbolicSupernodalCholesky<usize>, values: &[f64]) -> f64 {
    let l = SupernodalLltRef::<'_, usize, f64>::new(symbolic, values);
    let pivots = (0..symbolic.n_supernodes()).flat_map(|s| {
        let columns = l.supernode(s).val();
        (0..columns.ncols()).map(move |j| columns[(j, j)].powi(2))
    });
    pivots.fold(f64::INFINITY, f64::min)
}
