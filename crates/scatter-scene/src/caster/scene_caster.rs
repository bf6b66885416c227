//! A scene made ready for ray casts: an f32 tree proposes triangles, f64 arithmetic on welded vertices decides.

use glam::DVec3;

use super::cards::{self, Card, Cards};
use super::error::CasterError;
use super::ray_plane::{RayPlane, Segment};
use super::weld;
use crate::limits::MAX_COORDINATE;
use crate::scene::Scene;
use crate::translucent::Occluders;
use crate::tree::{Bvh, RayWalk};

/// A scene made ready for ray casts: f64 vertices, welded, and a tree over its triangles.
///
/// Triangles block from both sides; a hit on a texel of a cut-out that is not there is passed through, and the walk goes
/// on behind it. Hits are f64 throughout and watertight: a ray never slips between two triangles
/// that share an edge or a vertex.
#[derive(Debug)]
pub struct SceneCaster {
    /// Distinct world-space positions.
    positions: Vec<DVec3>,
    /// Indices into `positions`, ascending within a triangle, in the order of the tree's leaves.
    triangles: Vec<[u32; 3]>,
    cards: Cards,
    bvh: Bvh,
    bounds: Option<(DVec3, DVec3)>,
    occluders: Option<Occluders>,
}

/// obvhs numbers up to twice as many nodes in 32 bits.
const LARGEST_COUNT: usize = 1 << 30;

impl SceneCaster {
    /// Welds the vertices, drops triangles with two equal corners (they have no area and change no outline) and
    /// builds the tree, and another one over what dims light. A scene without triangles is fine: nothing is ever hit.
    pub fn new(scene: &Scene) -> Result<Self, CasterError> {
        for (what, found) in [("triangles", scene.triangles.len()), ("vertices", scene.positions.len())] {
            if found > LARGEST_COUNT {
                return Err(CasterError::TooMany { what, found, limit: LARGEST_COUNT });
            }
        }
        let bad =
            scene.positions.iter().position(|p| !(p.abs().max_element() <= MAX_COORDINATE && p.is_finite()));
        if let Some(index) = bad {
            let DVec3 { x, y, z } = scene.positions[index];
            return Err(CasterError::BadVertex { index, x, y, z });
        }
        let count = scene.positions.len();
        for (triangle, indices) in scene.triangles.iter().enumerate() {
            if let Some(&vertex) = indices.iter().find(|&&vertex| vertex as usize >= count) {
                return Err(CasterError::BadIndex { triangle, vertex, count });
            }
        }
        cards::check(scene)?;
        let occluders = Occluders::new(scene)?;
        let welded = weld::weld(&scene.positions);
        let of_welded = |triangle: &[u32; 3]| {
            let mut indices = triangle.map(|index| welded.index_of[index as usize]);
            indices.sort_unstable();
            indices
        };
        let has_area = |[a, b, c]: &[u32; 3]| a != b && b != c;
        let triangles: Vec<[u32; 3]> = scene.triangles.iter().map(of_welded).filter(has_area).collect();
        // The number in the scene of each that is kept.
        let kept: Vec<u32> = if scene.cutouts.is_empty() {
            Vec::new()
        } else {
            (0..).zip(&scene.triangles).filter(|(_, t)| has_area(&of_welded(t))).map(|(n, _)| n).collect()
        };
        let positions = welded.positions;
        // Of the triangles, not of stray vertices.
        let bounds =
            triangles.iter().flatten().map(|&index| positions[index as usize]).fold(None, |bounds, p| {
                let (low, high): (DVec3, DVec3) = bounds.unwrap_or((p, p));
                Some((low.min(p), high.max(p)))
            });
        let (bvh, order) = Bvh::build(&positions, &triangles, bounds.unwrap_or_default());
        let mut triangles: Vec<[u32; 3]> = order.iter().map(|&index| triangles[index as usize]).collect();
        let (positions, renumbered) = in_order_of_use(&positions, &mut triangles);
        let cards = Cards::new(scene, &triangles, |leaf, corner| {
            let source = kept[order[leaf] as usize];
            let vertex = scene.triangles[source as usize][corner];
            (source, renumbered[welded.index_of[vertex as usize] as usize])
        });
        Ok(Self { positions, triangles, cards, bvh, bounds, occluders })
    }

    /// Lowest and highest corner of all triangles, world space; `None` without triangles.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }

    /// Smoke and hair of the scene, which dim light and stop no ray; the source of its frames
    /// ([`Translucent::Source`](scatter_core::Translucent::Source)).
    pub fn occluders(&self) -> Option<&Occluders> {
        self.occluders.as_ref()
    }

    /// Middle and radius of a sphere that holds all triangles but for strays, and all that dims light, world space.
    pub(crate) fn sphere(&self) -> (DVec3, f64) {
        if self.has_strays() {
            return (self.bvh.centre, self.bvh.rest * 3f64.sqrt());
        }
        let (low, high) = match (self.bounds, &self.occluders) {
            (bounds, None) => bounds.unwrap_or_default(),
            (None, Some(occluders)) => occluders.bounds().into(),
            (Some((low, high)), Some(occluders)) => {
                let [other_low, other_high] = occluders.bounds();
                (low.min(other_low), high.max(other_high))
            }
        };
        (0.5 * (low + high), (0.5 * (high - low)).length())
    }

    /// Whether a vertex lies so far out that the rest of the scene is a point beside it.
    pub(super) fn has_strays(&self) -> bool {
        self.bvh.rest < f64::INFINITY
    }

    /// Triangles that can be hit.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Bytes that the caster holds.
    pub fn memory_bytes(&self) -> u64 {
        let vertices = self.positions.capacity() * size_of::<DVec3>();
        let triangles = self.triangles.capacity() * size_of::<[u32; 3]>();
        let occluders = self.occluders.as_ref().map_or(0, Occluders::memory_bytes);
        (vertices + triangles) as u64 + self.cards.memory_bytes() + self.bvh.memory_bytes() + occluders
    }

    /// Distance > 0 to the first surface along the ray from `start` (world space) in the unit direction `along`, not
    /// beyond `limit`; `None` if there is none.
    pub fn closest_hit(&self, start: DVec3, along: DVec3, limit: f64) -> Option<f64> {
        self.first_crossing(&RayPlane::any(start, DVec3::ZERO, along), limit)
    }

    /// Whether any surface lies on the ray at a distance > 0 and ≤ `limit`.
    pub fn any_hit(&self, start: DVec3, along: DVec3, limit: f64) -> bool {
        self.any_crossing(&RayPlane::any(start, DVec3::ZERO, along), limit)
    }

    /// The corners of all triangles relative to the middle of [`Self::sphere`], shared ones repeatedly; strays are drawn
    /// in to where the sphere ends.
    pub(crate) fn all_corners(&self) -> impl Iterator<Item = DVec3> + '_ {
        let (centre, rest) = (self.sphere().0, self.bvh.rest);
        let corners =
            self.triangles.iter().flatten().map(move |&index| self.positions[index as usize] - centre);
        corners.map(move |p| p.clamp(DVec3::splat(-rest), DVec3::splat(rest)))
    }

    /// Distinct positions, world space, and the triangles' indices into them.
    #[cfg(feature = "raster")]
    pub(crate) fn welded(&self) -> (&[DVec3], &[[u32; 3]]) {
        (&self.positions, &self.triangles)
    }

    pub(crate) fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The corners of a triangle, in welded order.
    #[inline]
    pub(crate) fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|index| self.positions[index as usize])
    }

    /// The cut-outs among the triangles.
    pub(crate) fn cards(&self) -> &Cards {
        &self.cards
    }

    /// Where the plane's ray meets a triangle: at a distance that may be negative; `None` where it passes.
    #[inline]
    fn meeting(&self, plane: &RayPlane, triangle: u32) -> Option<f64> {
        let corners = self.corners(triangle);
        let segment = plane.cut(corners)?;
        let crossing = segment.crossing()?;
        match self.cards.get(triangle) {
            Some(card) if !self.is_there(plane, corners, &segment, card) => None,
            _ => Some(crossing),
        }
    }

    /// Whether a card has a texel where its segment crosses the plane's ray.
    #[cold]
    fn is_there(&self, plane: &RayPlane, corners: [DVec3; 3], segment: &Segment, card: &Card) -> bool {
        let [a, b] = plane.carried(corners, card.texels);
        let share = segment.crossing_share().unwrap_or(0.0);
        self.cards.mask(card).is_there_at(a + (b - a) * share)
    }

    /// The first crossing of the plane's ray with a surface, in (0, limit].
    pub(crate) fn first_crossing(&self, plane: &RayPlane, limit: f64) -> Option<f64> {
        self.first_crossing_from(plane, 0.0, limit)
    }

    /// The first crossing of the plane's line with a surface, in (from, limit]; `from` may be −∞.
    pub(super) fn first_crossing_from(&self, plane: &RayPlane, from: f64, limit: f64) -> Option<f64> {
        let walk = RayWalk::new(&self.bvh, plane.reference + plane.start, plane.along, from)?;
        let mut first = None;
        walk.visit(limit, |start, count, limit| {
            let mut limit = limit;
            for triangle in start..start + count {
                if let Some(x) = self.meeting(plane, triangle)
                    && x > from
                    && x <= limit
                {
                    limit = x;
                    first = Some(x);
                }
            }
            limit
        });
        first
    }

    /// Whether the plane's ray crosses a surface in (0, limit].
    pub(crate) fn any_crossing(&self, plane: &RayPlane, limit: f64) -> bool {
        let Some(walk) = RayWalk::new(&self.bvh, plane.reference + plane.start, plane.along, 0.0) else {
            return false;
        };
        let end = walk.visit(limit, |start, count, limit| {
            let hit = (start..start + count)
                .any(|triangle| self.meeting(plane, triangle).is_some_and(|x| x > 0.0 && x <= limit));
            if hit { f64::NEG_INFINITY } else { limit }
        });
        end == f64::NEG_INFINITY
    }
}

/// Renumbers the vertices in the order in which the triangles use them first, so that neighbours in the tree are
/// neighbours in memory; drops those that none uses. Indices ascend again within each triangle afterwards. Returns the
/// positions, and the new number of each old vertex.
fn in_order_of_use(positions: &[DVec3], triangles: &mut [[u32; 3]]) -> (Vec<DVec3>, Vec<u32>) {
    const UNUSED: u32 = u32::MAX;
    let mut renumbered = vec![UNUSED; positions.len()];
    let mut used = Vec::new();
    for triangle in triangles {
        for index in triangle.iter_mut() {
            let old = *index as usize;
            if renumbered[old] == UNUSED {
                renumbered[old] = used.len() as u32;
                used.push(positions[old]);
            }
            *index = renumbered[old];
        }
        triangle.sort_unstable();
    }
    used.shrink_to_fit();
    (used, renumbered)
}
