//! What a walk down a min/max mipmap would visit along a ray, found from the ray's own texels, from the finest blocks up.
//!
//! A block of 2ⁿ texels a side that a ray crosses is decided as a whole where all its depths are on one side of the ray. Only
//! the texels on the ray are known here, not the whole block's, so that blocks look a little more decided than they are.

/// A run of a ray's texels within one block.
#[derive(Debug, Clone, Copy)]
struct BlockRun {
    /// Column and row of the block.
    block: [u32; 2],
    /// Smallest and largest stored depth.
    stored: [f32; 2],
    /// Smallest and largest depth of the ray.
    own: [f32; 2],
    /// Texels crossed.
    texels: u32,
}

/// The finest blocks of one ray through one map, in order; keeps its memory.
#[derive(Debug, Default)]
pub struct BlockRuns(Vec<BlockRun>);

/// What is visited.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Visits {
    /// Blocks of 4×4 texels and larger ones.
    pub nodes: u32,
    /// Blocks of 16×16 texels and larger ones.
    pub coarse_nodes: u32,
    /// Texels within undecided blocks of 4×4.
    pub texels: u32,
}

/// Finest blocks are 2² texels a side, and where nothing is known yet walks start at 2⁷.
const FINEST: u32 = 2;
const COARSEST: u32 = 7;

impl BlockRuns {
    /// Forgets all blocks.
    pub fn start(&mut self) {
        self.0.clear();
    }

    /// Adds the next texel: the stored depth, and the smallest and the largest of the ray within it.
    #[inline]
    pub fn add(&mut self, texel: [u32; 2], stored: f32, own: [f32; 2]) {
        let run = BlockRun { block: texel.map(|side| side >> FINEST), stored: [stored; 2], own, texels: 1 };
        match self.0.last_mut() {
            Some(last) if last.block == run.block => last.join(&run),
            _ => self.0.push(run),
        }
    }

    /// Counts what is visited; the blocks are used up.
    pub fn visits(&mut self) -> Visits {
        let runs = &mut self.0;
        let mut visits = Visits::default();
        for run in runs.iter().filter(|run| run.is_undecided()) {
            visits.texels += run.texels;
        }
        for level in FINEST + 1..=COARSEST {
            let (mut kept, mut children) = (0usize, 0);
            for index in 0..runs.len() {
                let run = BlockRun { block: runs[index].block.map(|side| side >> 1), ..runs[index] };
                if kept > 0 && runs[kept - 1].block == run.block {
                    runs[kept - 1].join(&run);
                    children += 1;
                    continue;
                }
                if kept > 0 {
                    visits.count(&runs[kept - 1], level, children);
                }
                runs[kept] = run;
                kept += 1;
                children = 1;
            }
            if kept > 0 {
                visits.count(&runs[kept - 1], level, children);
            }
            runs.truncate(kept);
        }
        visits.nodes += runs.len() as u32;
        visits.coarse_nodes += runs.len() as u32;
        runs.clear();
        visits
    }
}

impl BlockRun {
    fn join(&mut self, next: &Self) {
        self.stored = [self.stored[0].min(next.stored[0]), self.stored[1].max(next.stored[1])];
        self.own = [self.own[0].min(next.own[0]), self.own[1].max(next.own[1])];
        self.texels += next.texels;
    }

    fn is_undecided(&self) -> bool {
        self.stored[0] < self.own[1] && self.stored[1] >= self.own[0]
    }
}

impl Visits {
    /// Counts the children of a block that is done.
    fn count(&mut self, block: &BlockRun, level: u32, children: u32) {
        if !block.is_undecided() {
            return;
        }
        self.nodes += children;
        if level > FINEST + 2 {
            self.coarse_nodes += children;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(stored: impl Fn(u32) -> f32) -> Visits {
        let mut runs = BlockRuns::default();
        (0..128).for_each(|i| runs.add([i, 5], stored(i), [0.5; 2]));
        runs.visits()
    }

    #[test]
    fn what_is_decided_as_a_whole_is_one_node() {
        for depth in [0.1, 0.9, f32::INFINITY] {
            assert_eq!(row(|_| depth), Visits { nodes: 1, coarse_nodes: 1, texels: 0 });
        }
    }

    #[test]
    fn an_edge_is_found_by_halving() {
        // Two children at each of the levels 3 to 7 above the finest, the root, and the texels of one block.
        let found = row(|i| if i < 42 { 0.1 } else { 0.9 });
        assert_eq!(found, Visits { nodes: 11, coarse_nodes: 7, texels: 4 });
    }

    #[test]
    fn where_everything_is_mixed_everything_is_visited() {
        let found = row(|i| if i % 2 == 0 { 0.1 } else { 0.9 });
        assert_eq!(
            found,
            Visits { nodes: 1 + 2 + 4 + 8 + 16 + 32, coarse_nodes: 1 + 2 + 4 + 8, texels: 128 }
        );
        assert_eq!(BlockRuns::default().visits(), Visits::default());
    }
}
