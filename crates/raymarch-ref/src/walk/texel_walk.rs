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

fn walk_texels<F: FnMut(f64, f64)>(
    layer: &ShadowLayer<'_>,
    path: &MapPath,
    (a, b): (f64, f64),
    lit: &mut LitParts<F>,
) -> u64 {
    let (mut i, mut j) = path.texel_at(a);
    let (mut exit_u, mut exit_v) = (path.u.exit(i, 1), path.v.exit(j, 1));
    let mut t = a;
    let mut asked = 0;
    loop {
        let end = exit_u.min(exit_v).min(b);
        asked += 1;
        let (from, to) = path.depth.lit_part(layer.at(i as u32, j as u32), t, end);
        lit.push(from, to);
        if end >= b {
            return asked;
        }
        t = end;
        if exit_u <= exit_v {
            i = path.u.after(i, 1);
            exit_u = path.u.exit(i, 1);
        } else {
            j = path.v.after(j, 1);
            exit_v = path.v.exit(j, 1);
        }
    }
}

fn walk_blocks<F: FnMut(f64, f64)>(
    layer: &ShadowLayer<'_>,
    tree: MinMaxTree<'_>,
    path: &MapPath,
    (a, b): (f64, f64),
    lit: &mut LitParts<F>,
) -> u64 {
    let (mut i, mut j) = path.texel_at(a);
    let mut t = a;
    let mut level = tree.top();
    let mut asked = 0;
    loop {
        let shift = if level == 0 { 0 } else { MinMaxTree::shift(level) };
        let (first_i, first_j, side) = (i >> shift << shift, j >> shift << shift, 1 << shift);
        let (exit_u, exit_v) = (path.u.exit(first_i, side), path.v.exit(first_j, side));
        let end = exit_u.min(exit_v).min(b);
        asked += 1;
        if level == 0 {
            let (from, to) = path.depth.lit_part(layer.at(i as u32, j as u32), t, end);
            lit.push(from, to);
        } else {
            let [least, greatest] = tree.bounds(level, i, j);
            match path.depth.verdict(least, greatest, t, end) {
                BlockVerdict::Lit => lit.push(t, end),
                BlockVerdict::Dark => {}
                BlockVerdict::Mixed => {
                    level -= 1;
                    continue;
                }
            }
        }
        if end >= b {
            return asked;
        }
        t = end;
        // One coordinate stands on the border that was crossed; the other one went on inside of the block.
        if exit_u <= exit_v {
            i = path.u.after(first_i, side);
            if level > 0 {
                j = path.v.later(j, path.row_at(t));
            }
        } else {
            j = path.v.after(first_j, side);
            if level > 0 {
                i = path.u.later(i, path.column_at(t));
            }
        }
        // Behind a block's border a larger block may be uniform; a step at a time, since mixed blocks have mixed
        // neighbours.
        if level < tree.top() {
            level += 1;
        }
    }
}
