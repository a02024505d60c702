//! The supernodes as a tree, in the order in which a triangular solve visits them.
//!
//! A supernode passes what it knows to its parent, the one that has its first row below. Subtrees of
//! moderate size are tasks, worked on from leaves to root by one thread each; what is above them goes
//! level by level, all supernodes of a level at once. Neither depends on the number of threads.

use std::ops::Range;

use super::{TILE, factorisation::SparseCholesky};

/// Entries of L in a task: about 20 microseconds of work.
const TASK_ENTRIES: usize = 1 << 16;

/// A supernode with its place in memory.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// Its number in the factorisation.
    pub(super) number: usize,
    /// Particles of its columns.
    pub(super) particles: Vec<u32>,
    /// Rows below its triangle.
    pub(super) below: usize,
    /// For each row below, its row in the front of the parent.
    pub(super) rows_in_parent: Vec<u32>,
    pub(super) parent: Option<usize>,
    /// Children, ascending.
    pub(super) children: Vec<usize>,
    /// Where its front is: three components of [`Node::front_length`] numbers.
    pub(super) front: usize,
    /// Entries of the matrix in its columns, as places in its front, column by column, and in the
    /// pattern of the matrix.
    pub(super) entries: Vec<[u32; 2]>,
}

impl Node {
    pub(super) fn columns(&self) -> usize {
        self.particles.len()
    }

    /// Rows of the front: columns, and rows below.
    pub(super) fn rows(&self) -> usize {
        self.columns() + self.below
    }

    /// Length of the tiles of rows of its panel: each has the columns up to the diagonal.
    pub(super) fn panel_length(&self) -> usize {
        let tiles = 0..self.rows().div_ceil(TILE);
        tiles.map(|tile| TILE * self.columns().min(TILE * (tile + 1))).sum()
    }

    /// Length of the tiles of columns: each has the rows from the diagonal on.
    pub(super) fn panel_transposed_length(&self) -> usize {
        let tiles = 0..self.columns().div_ceil(TILE);
        tiles.map(|tile| TILE * (self.rows() - TILE * tile)).sum()
    }

    /// Rows filled up to whole tiles.
    pub(super) fn front_length(&self) -> usize {
        self.rows().next_multiple_of(TILE)
    }
}

/// All supernodes: those of the tasks first, then the levels above.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// Runs of nodes, each one or more whole subtrees.
    pub(super) tasks: Vec<Range<usize>>,
    /// Runs of nodes, children before parents.
    pub(super) levels: Vec<Range<usize>>,
    /// Length of all fronts.
    pub(super) fronts_length: usize,
}

impl Tree {
    pub(super) fn new(factorisation: &SparseCholesky) -> Self {
        let order = factorisation.order();
        let mut nodes: Vec<Node> = factorisation
            .supernodes()
            .enumerate()
            .map(|(number, supernode)| {
                let columns = supernode.first..supernode.first + supernode.columns;
                Node {
                    number,
                    particles: order[columns].iter().map(|&particle| particle as u32).collect(),
                    below: supernode.rows.len(),
                    rows_in_parent: Vec::new(),
                    parent: None,
                    children: Vec::new(),
                    front: 0,
                    entries: Vec::new(),
                }
            })
            .collect();
        link(&mut nodes, factorisation);
        enter(&mut nodes, factorisation);
        Self::scheduled(nodes)
    }

    /// Sorts nodes into tasks and levels and gives them their places.
    fn scheduled(nodes: Vec<Node>) -> Self {
        // Parents come after their children.
        let mut entries = vec![0; nodes.len()];
        let mut heights = vec![0; nodes.len()];
        let is_task = |entries: usize| entries <= TASK_ENTRIES;
        for (number, node) in nodes.iter().enumerate() {
            entries[number] += node.columns() * node.rows();
            if let Some(parent) = node.parent {
                entries[parent] += entries[number];
                if !is_task(entries[number]) {
                    heights[parent] = heights[parent].max(heights[number] + 1);
                }
            }
        }
        let mut tree = Self::default();
        let mut sequence = Vec::with_capacity(nodes.len());
        let mut filled = 0;
        for root in 0..nodes.len() {
            let is_root = nodes[root].parent.is_none_or(|parent| !is_task(entries[parent]));
            if !is_task(entries[root]) || !is_root {
                continue;
            }
            let start = sequence.len();
            sequence.push(root);
            let mut next = start;
            while let Some(&number) = sequence.get(next) {
                sequence.extend(&nodes[number].children);
                next += 1;
            }
            // Descending numbers turned round: children first, each subtree in one run.
            sequence[start..].sort_unstable();
            match tree.tasks.last_mut() {
                Some(task) if is_task(filled + entries[root]) => {
                    task.end = sequence.len();
                    filled += entries[root];
                }
                _ => {
                    tree.tasks.push(start..sequence.len());
                    filled = entries[root];
                }
            }
        }
        let mut above: Vec<usize> = (0..nodes.len()).filter(|&n| !is_task(entries[n])).collect();
        above.sort_by_key(|&number| heights[number]);
        for level in above.chunk_by(|&a, &b| heights[a] == heights[b]) {
            tree.levels.push(sequence.len()..sequence.len() + level.len());
            sequence.extend(level);
        }
        tree.place(nodes, &sequence);
        tree
    }

    /// Number of nodes in tasks: the first node above them.
    pub(super) fn tasks_end(&self) -> usize {
        self.tasks.last().map_or(0, |task| task.end)
    }

    /// Renumbers nodes in this sequence and gives them memory in the same.
    fn place(&mut self, nodes: Vec<Node>, sequence: &[usize]) {
        let mut places = vec![0; nodes.len()];
        for (place, &number) in sequence.iter().enumerate() {
            places[number] = place;
        }
        let mut nodes: Vec<Option<Node>> = nodes.into_iter().map(Some).collect();
        let moved = sequence.iter().filter_map(|&number| nodes[number].take());
        self.nodes = moved.collect();
        for node in &mut self.nodes {
            node.parent = node.parent.map(|parent| places[parent]);
            node.children.iter_mut().for_each(|child| *child = places[*child]);
            node.front = self.fronts_length;
            self.fronts_length += 3 * node.front_length();
        }
    }
}

/// Finds parents and where the rows of each node are in the front of its parent.
fn link(nodes: &mut [Node], factorisation: &SparseCholesky) {
    let supernodes: Vec<_> = factorisation.supernodes().collect();
    for number in 0..supernodes.len() {
        let Some(&first) = supernodes[number].rows.first() else { continue };
        let parent = supernodes.partition_point(|supernode| supernode.first <= first) - 1;
        let above = supernodes[parent];
        let end = above.first + above.columns;
        // Both are ascending, and every row is in the parent: a merge.
        let mut place = 0;
        let rows = supernodes[number].rows.iter().map(|&row| {
            if row < end {
                return (row - above.first) as u32;
            }
            while above.rows[place] < row {
                place += 1;
            }
            (above.columns + place) as u32
        });
        nodes[number].rows_in_parent = rows.collect();
        nodes[number].parent = Some(parent);
        nodes[parent].children.push(number);
    }
}

/// Finds the entries of the matrix in the columns of each node.
fn enter(nodes: &mut [Node], factorisation: &SparseCholesky) {
    let supernodes: Vec<_> = factorisation.supernodes().collect();
    let mut places = vec![0; factorisation.pattern().len()];
    let mut homes = places.clone();
    for (number, supernode) in supernodes.iter().enumerate() {
        for column in supernode.first..supernode.first + supernode.columns {
            places[factorisation.order()[column]] = column;
            homes[column] = number;
        }
    }
    let pattern = factorisation.pattern();
    for column in 0..pattern.len() {
        for entry in pattern.offsets[column]..pattern.offsets[column + 1] {
            let [a, b] = [places[column], places[pattern.rows[entry]]];
            let (first, second) = (a.min(b), a.max(b));
            let home = &supernodes[homes[first]];
            let row = if second < home.first + home.columns {
                second - home.first
            } else {
                home.columns + home.rows.partition_point(|&row| row < second)
            };
            let height = home.columns + home.rows.len();
            let place = (first - home.first) * height + row;
            nodes[homes[first]].entries.push([place as u32, entry as u32]);
        }
    }
    for node in nodes {
        node.entries.sort_unstable();
    }
}
