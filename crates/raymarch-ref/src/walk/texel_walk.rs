//! The walk of a view ray through the texels of a shadow map: the lit parts of the ray, exactly and in order.
//!
//! A digital differential analyser (Amanatides and Woo 1987) whose crossings come from the border's index
//! ([`MapPath`]); within a texel the crossing with its depth is solved. The hierarchical walk takes whole blocks
//! that a min/max tree shows to be all lit or all dark and descends where it cannot tell; it meets the same borders
//! at the same bits, so both walks report the same lit parts.

use scatter_core::{MapRay, ShadowLayer};

use super::map_path::{BlockVerdict, MapPath};
use super::min_max_tree::MinMaxTree;

/// Collects the lit parts of a ray and joins those that touch, so that each stretch is integrated once.
#[derive(Debug)]
pub struct LitParts<F: FnMut(f64, f64)> {
    open: Option<(f64, f64)>,
    emit: F,
}

impl<F: FnMut(f64, f64)> LitParts<F> {
    /// `emit(a, b)` is called for each stretch, in order.
    pub fn new(emit: F) -> Self {
        Self { open: None, emit }
    }

    /// A lit part, behind all earlier ones.
    pub fn push(&mut self, a: f64, b: f64) {
        if !(b > a) {
            return;
        }
        match &mut self.open {
            Some((_, end)) if *end == a => *end = b,
            _ => {
                if let Some((start, end)) = self.open.replace((a, b)) {
                    (self.emit)(start, end);
                }
            }
        }
    }

    /// The last stretch.
    pub fn finish(mut self) {
        if let Some((start, end)) = self.open.take() {
            (self.emit)(start, end);
        }
    }
}

/// Pushes the lit parts of the ray's part `(a, b)`, which lies inside of the layer; returns the texels and blocks
/// that were asked. `tree` is the layer's, `None` for the plain walk.
pub fn walk_layer<F: FnMut(f64, f64)>(
    layer: &ShadowLayer<'_>,
    tree: Option<MinMaxTree<'_>>,
    ray: MapRay,
    (a, b): (f64, f64),
    lit: &mut LitParts<F>,
) -> u64 {
    let projection = layer.projection();
    let Some(path) = MapPath::new(ray, projection.is_perspective(), projection.size(), a, b) else {
        // Less than a rounding error of the ray, on the border of a cone: dark, so that nothing is added.
        return 0;
    };
    match tree {
        None => walk_texels(layer, &path, (a, b), lit),
        Some(tree) => walk_blocks(layer, tree, &path, (a, b), lit),
    }
}

/// Where a walk stands: a texel and the ray parameter of its entry.
#[derive(Clone, Copy)]
struct Stand {
    i: i32,
    j: i32,
    t: f64,
}

fn walk_texels<F: FnMut(f64, f64)>(
    layer: &ShadowLayer<'_>,
    path: &MapPath,
    (a, b): (f64, f64),
    lit: &mut LitParts<F>,
) -> u64 {
    let (i, j) = path.texel_at(a);
    walk_texels_of_block(layer, path, &mut Stand { i, j, t: a }, (b, i32::BITS - 1), lit)
}

/// Walks texel by texel to `b` or out of the block of side `2^shift`.
#[inline(always)]
fn walk_texels_of_block<F: FnMut(f64, f64)>(
    layer: &ShadowLayer<'_>,
    path: &MapPath,
    stand: &mut Stand,
    (b, shift): (f64, u32),
    lit: &mut LitParts<F>,
) -> u64 {
    let Stand { mut i, mut j, mut t } = *stand;
    let (first_i, first_j) = (i, j);
    let (mut exit_u, mut exit_v) = (path.u.exit(i, 1), path.v.exit(j, 1));
    let mut asked = 0;
    loop {
        let end = exit_u.min(exit_v).min(b);
        asked += 1;
        let (from, to) = path.depth.lit_part(layer.at(i as u32, j as u32), t, end);
        lit.push(from, to);
        t = end;
        if end >= b {
            break;
        }
        if exit_u <= exit_v {
            i = path.u.after(i, 1);
            exit_u = path.u.exit(i, 1);
        } else {
            j = path.v.after(j, 1);
            exit_v = path.v.exit(j, 1);
        }
        if ((i ^ first_i) | (j ^ first_j)) >> shift != 0 {
            break;
        }
    }
    *stand = Stand { i, j, t };
    asked
}

fn walk_blocks<F: FnMut(f64, f64)>(
    layer: &ShadowLayer<'_>,
    tree: MinMaxTree<'_>,
    path: &MapPath,
    (a, b): (f64, f64),
    lit: &mut LitParts<F>,
) -> u64 {
    let (i, j) = path.texel_at(a);
    let mut stand = Stand { i, j, t: a };
    let mut level = tree.top();
    let mut asked = 0;
    loop {
        let before = stand;
        let shift = MinMaxTree::shift(level);
        let (first_i, first_j, side) = (stand.i >> shift << shift, stand.j >> shift << shift, 1 << shift);
        let (exit_u, exit_v) = (path.u.exit(first_i, side), path.v.exit(first_j, side));
        let end = exit_u.min(exit_v).min(b);
        let [least, greatest] = tree.bounds(level, stand.i, stand.j);
        asked += 1;
        match path.depth.verdict(least, greatest, stand.t, end) {
            BlockVerdict::Mixed if level > 1 => {
                level -= 1;
                continue;
            }
            BlockVerdict::Mixed => {
                asked += walk_texels_of_block(layer, path, &mut stand, (b, shift), lit);
                if stand.t >= b {
                    return asked;
                }
            }
            verdict => {
                if verdict == BlockVerdict::Lit {
                    lit.push(stand.t, end);
                }
                if end >= b {
                    return asked;
                }
                stand.t = end;
                // One coordinate stands on the border that was crossed; the other one went on inside of the block.
                if exit_u <= exit_v {
                    stand.i = path.u.after(first_i, side);
                    stand.j = path.v.later(stand.j, path.row_at(end));
                } else {
                    stand.j = path.v.after(first_j, side);
                    stand.i = path.u.later(stand.i, path.column_at(end));
                }
            }
        }
        // The larger block was mixed: its parts are taken one by one until the ray leaves it.
        if level < tree.top() {
            let larger = MinMaxTree::shift(level + 1);
            if ((before.i ^ stand.i) | (before.j ^ stand.j)) >> larger != 0 {
                level += 1;
            }
        }
    }
}
