//! Trees: tubes for wood, and folded rhombs for leaves or cards with a twig's leaves painted on, all from one seed.

use super::mesh::{Mesh, perpendiculars};
use super::random::Random;
use glam::DVec3;

/// A tree at the origin, its trunk sunk a little into the ground.
#[derive(Debug)]
pub(crate) struct Tree {
    /// Trunk and branches: closed tubes that run into each other.
    pub wood: Mesh,
    /// Leaves, or cards: two triangles each.
    pub leaves: Mesh,
}

/// How a tree grows. Lengths in metres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Habit {
    /// Height of the trunk's tip.
    pub height: f64,
    /// Share of the height below the first branch, in (0, 1).
    pub bare: f64,
    /// Length of the longest branches.
    pub spread: f64,
    /// Branches on the trunk.
    pub branches: usize,
    /// What hangs in the tufts.
    pub foliage: Foliage,
    /// Radius of the tuft of leaves around a twig's end.
    pub tuft: f64,
}

/// What a tree's tufts are made of.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Foliage {
    /// Folded rhombs.
    Leaves {
        /// Of the whole tree.
        count: usize,
        /// Length of a leaf.
        length: f64,
    },
    /// Squares that show a twig with its leaves; they stand for the twigs' wood too, and the rest of it is coarser.
    Cards {
        /// Of the whole tree.
        count: usize,
        /// Side of a card.
        side: f64,
    },
}

impl Tree {
    /// Grows a tree: the same one for the same seed and habit.
    pub(crate) fn grow(seed: u64, habit: &Habit) -> Self {
        let mut random = Random::new(seed);
        let mut tree = Self { wood: Mesh::default(), leaves: Mesh::default() };
        let trunk = tree.grow_trunk(&mut random, habit);
        let tufts = tree.grow_branches(&mut random, habit, &trunk);
        match habit.foliage {
            Foliage::Leaves { count, length } => {
                tree.grow_leaves(&mut random, habit, (count, length), &tufts);
            }
            Foliage::Cards { count, side } => {
                tree.grow_cards(&mut random, habit, (count, side), &tufts);
            }
        }
        tree
    }

    /// A slightly bent trunk: its points with their radii.
    fn grow_trunk(&mut self, random: &mut Random, habit: &Habit) -> Vec<(DVec3, f64)> {
        let foot = 0.035 * habit.height;
        let mut centre = DVec3::new(0.0, -0.3, 0.0);
        let mut path = vec![(centre, 1.3 * foot)];
        let steps = 8;
        for step in 1..=steps {
            let share = f64::from(step) / f64::from(steps);
            let sway = 0.04 * habit.height / f64::from(steps);
            centre += DVec3::new(
                random.between(-sway, sway) * 2.0,
                (habit.height + 0.3) / f64::from(steps),
                random.between(-sway, sway) * 2.0,
            );
            path.push((centre, foot * (1.0 - 0.85 * share)));
        }
        self.wood.add_tube(&path, if habit.is_coarse() { 6 } else { 10 });
        path
    }

    /// Branches with twigs; returns the centres of the tufts of leaves, and how large each is.
    fn grow_branches(
        &mut self,
        random: &mut Random,
        habit: &Habit,
        trunk: &[(DVec3, f64)],
    ) -> Vec<(DVec3, f64)> {
        let mut tufts = Vec::new();
        for index in 0..habit.branches {
            let up = (index as f64 + random.unit()) / habit.branches as f64;
            let along = (habit.bare + (1.0 - habit.bare) * up) * (trunk.len() - 1) as f64;
            let lower = (along.floor() as usize).min(trunk.len() - 2);
            let blend = along - lower as f64;
            let start = trunk[lower].0.lerp(trunk[lower + 1].0, blend);
            let radius = 0.6 * (trunk[lower].1 * (1.0 - blend) + trunk[lower + 1].1 * blend);

            // A round crown: longest a third of the way up, rising more steeply towards the top.
            let mut outwards = random.direction();
            outwards.y = 0.0;
            let rise = 0.25 + 0.9 * up * up;
            let heading = (outwards.normalize_or(DVec3::X) + DVec3::Y * rise).normalize();
            let length = habit.spread * (0.35 + 2.6 * up * (1.0 - up).max(0.0) + 0.25 * random.unit());
            let bend = random.direction() * 0.18 * length;
            let middle = start + heading * (0.5 * length) + 0.5 * bend;
            let end = start + heading * length + bend + DVec3::Y * (0.12 * length);
            let sides = if habit.is_coarse() { 4 } else { 6 };
            self.wood.add_tube(&[(start, radius), (middle, 0.6 * radius), (end, 0.2 * radius)], sides);
            tufts.push((end, 1.0));

            for twig in 0..5 {
                let share = 0.35 + 0.13 * f64::from(twig);
                let from = if share < 0.5 {
                    start.lerp(middle, 2.0 * share)
                } else {
                    middle.lerp(end, 2.0 * share - 1.0)
                };
                let side = (random.direction() + heading * 0.6 + DVec3::Y * 0.25).normalize();
                let tip = from + side * (habit.spread * random.between(0.22, 0.45));
                if !habit.is_coarse() {
                    self.wood.add_tube(&[(from, 0.35 * radius), (tip, 0.1 * radius)], 5);
                }
                tufts.push((tip, random.between(0.65, 1.1)));
            }
        }
        tufts
    }

    /// Spreads the leaves over the tufts.
    fn grow_leaves(
        &mut self,
        random: &mut Random,
        habit: &Habit,
        (count, leaf): (usize, f64),
        tufts: &[(DVec3, f64)],
    ) {
        for index in 0..count {
            let (centre, size) = tufts[index % tufts.len()];
            let offset = random.in_ball() * DVec3::new(1.0, 0.7, 1.0);
            let base = centre + offset * (habit.tuft * size);
            // Leaves hang outwards and a little down, and turn their faces to all sides but mostly up.
            let tip_dir = (random.direction() + offset - DVec3::Y * 0.3).normalize_or(DVec3::X);
            let (sideways, across) = perpendiculars(tip_dir);
            let width_dir =
                (sideways * random.between(0.5, 1.0) + across * random.between(-0.7, 0.7)).normalize();
            let length = leaf * random.between(0.7, 1.2);
            let fold = tip_dir.cross(width_dir) * (0.12 * length);
            let left = base + tip_dir * (0.45 * length) + width_dir * (0.3 * length) + fold;
            let right = base + tip_dir * (0.45 * length) - width_dir * (0.3 * length) + fold;
            let corners = [base, right, base + tip_dir * length, left].map(|p| self.leaves.push_apart(p));
            // Cut along the midrib, from base to tip, about which the leaf is folded.
            self.leaves.quad(corners);
        }
    }

    /// Spreads the cards over the tufts.
    fn grow_cards(
        &mut self,
        random: &mut Random,
        habit: &Habit,
        (count, side): (usize, f64),
        tufts: &[(DVec3, f64)],
    ) {
        for index in 0..count {
            let (centre, size) = tufts[index % tufts.len()];
            let offset = random.in_ball() * DVec3::new(1.0, 0.7, 1.0);
            let middle = centre + offset * (0.8 * habit.tuft * size);
            // As leaves hang and turn.
            let down = (random.direction() + offset - DVec3::Y * 0.3).normalize_or(DVec3::X);
            let (sideways, across) = perpendiculars(down);
            let right =
                (sideways * random.between(0.5, 1.0) + across * random.between(-0.7, 0.7)).normalize();
            let side = side * size * random.between(0.8, 1.2);
            let (right, down) = (right * side, down * side);
            self.leaves.card(middle - 0.5 * (right + down), right, down);
        }
    }
}

impl Habit {
    /// Whether its wood is to have few triangles.
    fn is_coarse(&self) -> bool {
        matches!(self.foliage, Foliage::Cards { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::assert_closed;
    use super::*;

    const HABIT: Habit = Habit {
        height: 7.0,
        bare: 0.3,
        spread: 2.0,
        branches: 7,
        foliage: Foliage::Leaves { count: 901, length: 0.2 },
        tuft: 0.5,
    };

    #[test]
    fn wood_is_closed_and_every_leaf_has_two_triangles() {
        let tree = Tree::grow(3, &HABIT);
        assert_closed(&tree.wood);
        assert_eq!(tree.leaves.triangles.len(), 2 * 901);
    }

    #[test]
    fn cards_show_the_whole_texture_each_and_the_wood_is_still_closed() {
        let tree = Tree::grow(3, &Habit { foliage: Foliage::Cards { count: 77, side: 0.5 }, ..HABIT });
        assert_closed(&tree.wood);
        assert!(tree.wood.triangles.len() < Tree::grow(3, &HABIT).wood.triangles.len() / 3);
        assert_eq!((tree.leaves.triangles.len(), tree.leaves.uv.len()), (2 * 77, 4 * 77));
        for [a, b, c] in &tree.leaves.triangles {
            let [a, b, c] =
                [a, b, c].map(|&index| DVec3::from(tree.leaves.positions[index as usize].map(f64::from)));
            // Half a square of some tenths of a metre, on a grid of a quarter of a millimetre.
            let (area, sides) = ((b - a).cross(c - a).length(), (b - a).length().min((c - b).length()));
            assert!((area / (sides * sides) - 1.0).abs() < 0.01, "{a} {b} {c}");
        }
    }

    #[test]
    fn seeds_differ_and_repeat() {
        assert_eq!(Tree::grow(3, &HABIT).leaves.positions, Tree::grow(3, &HABIT).leaves.positions);
        assert_ne!(Tree::grow(3, &HABIT).leaves.positions, Tree::grow(4, &HABIT).leaves.positions);
    }
}
