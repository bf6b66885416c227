//! Smoke and hair on one view ray: which of them dim its light, where the transmittance has its kinks and jumps, and the
//! radiance of a lit interval between them.
//!
//! The tree proposes occluders as it proposes triangles (`shadow_walk`); each says on which stretch of the ray it dims, and
//! where that has a kink (`disc_shadow`) or a jump (`strand_shadow`). Between two neighbouring ones the number of strand
//! passes is constant and the chords in spheres are smooth, so each piece is a closed form times a constant, or an integral
//! that converges at once ([`RayLight::dimmed_interval`](scatter_core::RayLight::dimmed_interval)).
//!
//! What is not exact: where it changes which segment of a strand is the nearest, or whether two runs of its segments are one
//! pass, is found by samples and bisection; and pieces of the strand that lie wholly behind the view ray are not asked
//! whether they are nearer. Both matter only within a strand's radius.

use glam::DVec3;

use super::disc_shadow::{Disc, Stretch};
use super::ray_radiance::RayRadiance;
use super::shadow_plane::{LightOnRay, PlaneLight};
use super::strand_shadow::Capsule;
use crate::caster::RayPlane;
use crate::translucent::{NearSegment, Occluder, Occluders, each_pass};
use crate::tree::{Pending, RayWalk};

/// Error of a piece's integral that does not count, as a share of the unoccluded ray's radiance: ten thousand pieces add up to
/// a tenth of what is promised.
const NEGLIGIBLE: f64 = 1e-9;

/// What dims one view ray. Buffers are reused from ray to ray.
#[derive(Debug, Default)]
pub(super) struct Dimming {
    discs: Vec<(Stretch, Disc)>,
    capsules: Vec<NearCapsule>,
    /// Kinks and jumps, ascending.
    cuts: Vec<f64>,
    /// Of the discs and capsules, in the order of their stretches: how many have begun, and which of them have not ended.
    begun: [usize; 2],
    /// With where each ends.
    active_discs: Vec<(f64, Disc)>,
    /// Ascending by segment.
    active_capsules: Vec<NearCapsule>,
    near: Vec<NearSegment>,
    runs: Vec<NearSegment>,
}

#[derive(Debug, Clone, Copy)]
struct NearCapsule {
    stretch: Stretch,
    segment: u32,
    strand: u32,
    opacity: f64,
    /// Whether it lies wholly between the light and the ray, so that it is passed wherever it is near.
    is_between: bool,
    capsule: Capsule,
}

impl Dimming {
    /// Finds what dims the ray up to `end`. Whether anything does.
    pub fn gather(&mut self, occluders: &Occluders, light: &LightOnRay, end: f64) -> bool {
        self.discs.clear();
        self.capsules.clear();
        self.cuts.clear();
        self.begun = [0; 2];
        self.active_discs.clear();
        self.active_capsules.clear();
        let (plane, in_plane) = (light.plane(), light.in_plane());
        match light {
            LightOnRay::Plane(shadow) => {
                let bvh = occluders.bvh();
                let box_shadow = shadow.box_shadow(bvh);
                let mut pending = Pending::<u32>::new();
                if !bvh.nodes.is_empty() {
                    pending.push(0);
                }
                while let Some(index) = pending.pop() {
                    let node = &bvh.nodes[index as usize];
                    if !box_shadow.of(node).is_some_and(|(low, high)| high >= 0.0 && low <= end) {
                        continue;
                    }
                    if node.count > 0 {
                        for place in node.first..node.first + node.count {
                            self.add(occluders, plane, in_plane, occluders.in_leaf(place), end);
                        }
                    } else {
                        pending.push(node.first);
                        pending.push(node.first + 1);
                    }
                }
            }
            // Light, ray and shadow rays are on one line.
            LightOnRay::Towards(_, distance) => {
                self.add_on_line(occluders, plane, in_plane, [0.0, *distance], end)
            }
            LightOnRay::Away(_, distance) => {
                self.add_on_line(occluders, plane, in_plane, [-distance, end], end)
            }
        }
        self.discs.sort_unstable_by(|(a, _), (b, _)| a[0].total_cmp(&b[0]));
        self.capsules
            .sort_unstable_by(|a, b| a.stretch[0].total_cmp(&b.stretch[0]).then(a.segment.cmp(&b.segment)));
        self.cuts.sort_unstable_by(f64::total_cmp);
        self.cuts.dedup();
        !self.discs.is_empty() || !self.capsules.is_empty()
    }

    fn add_on_line(
        &mut self,
        occluders: &Occluders,
        plane: &RayPlane,
        light: PlaneLight,
        [from, to]: Stretch,
        end: f64,
    ) {
        let start = plane.reference + plane.start;
        let Some(walk) = RayWalk::new(occluders.bvh(), start, plane.along, from) else { return };
        walk.visit(to, |first, count, limit| {
            for place in first..first + count {
                self.add(occluders, plane, light, occluders.in_leaf(place), end);
            }
            limit
        });
    }

    fn add(&mut self, occluders: &Occluders, plane: &RayPlane, light: PlaneLight, number: u32, end: f64) {
        let local = |p: DVec3| {
            let q = (p - plane.reference) - plane.start;
            DVec3::new(plane.along.dot(q), plane.up.dot(q), plane.normal.dot(q))
        };
        let reaches = |[low, high]: Stretch| low < end && high > 0.0;
        match occluders.occluder(number) {
            Occluder::Particle(index) => {
                let particle = &occluders.particles()[index as usize];
                let middle = local(particle.centre);
                let square = (particle.radius - middle.z) * (particle.radius + middle.z);
                if !(square > 0.0) {
                    return;
                }
                let disc =
                    Disc { middle: middle.truncate(), radius: square.sqrt(), density: particle.density };
                let Some((stretch, kinks)) = disc.shadow(light).filter(|(stretch, _)| reaches(*stretch))
                else {
                    return;
                };
                self.cuts.extend(kinks.into_iter().filter(|kink| *kink > 0.0 && *kink < end));
                self.discs.push((stretch, disc));
            }
            Occluder::Segment(index) => {
                let segment = occluders.segment(index);
                let capsule = Capsule { ends: occluders.ends(segment).map(local), radius: segment.radius };
                // Most of what the tree proposes: on one side of the plane, or behind the ray.
                let [a, b] = capsule.ends;
                if a.z.min(b.z) >= capsule.radius
                    || a.z.max(b.z) <= -capsule.radius
                    || a.y.max(b.y) <= -capsule.radius
                {
                    return;
                }
                let Some(stretch) = capsule.shadow(light).filter(|stretch| reaches(*stretch)) else { return };
                let jumps = [stretch[0], stretch[1], crossing(&capsule, light, stretch, end)];
                self.cuts.extend(jumps.into_iter().filter(|jump| *jump > 0.0 && *jump < end));
                self.capsules.push(NearCapsule {
                    stretch,
                    segment: index,
                    strand: segment.strand,
                    opacity: segment.opacity,
                    is_between: a.y.min(b.y) > capsule.radius,
                    capsule,
                });
            }
        }
    }

    /// In-scattered radiance of the lit interval `[a, b]`; intervals of one ray come in ascending order.
    pub fn radiance(
        &mut self,
        occluders: &Occluders,
        light: PlaneLight,
        ray: &RayRadiance<'_>,
        [a, b]: Stretch,
    ) -> DVec3 {
        let negligible = NEGLIGIBLE * ray.whole.max_element();
        let mut sum = DVec3::ZERO;
        let first = self.cuts.partition_point(|cut| *cut <= a);
        let last = self.cuts.partition_point(|cut| *cut < b).max(first);
        let mut from = a;
        for index in first..=last {
            let to = if index < last { self.cuts[index] } else { b };
            self.move_to(from, to);
            while from < to {
                let (end, strands) = self.constant_part(occluders, light, from, to);
                // Nothing comes through a strand that is opaque.
                if strands > 0.0 {
                    sum += strands * self.smoky(light, ray, [from, end], negligible);
                }
                from = end;
            }
        }
        sum
    }

    /// The radiance of a piece without kinks that strands leave alone.
    fn smoky(&self, light: PlaneLight, ray: &RayRadiance<'_>, [a, b]: Stretch, negligible: f64) -> DVec3 {
        let discs = &self.active_discs;
        if discs.is_empty() {
            return ray.lit_piece(a, b);
        }
        ray.dimmed(a, b, negligible, &mut |t| {
            (-discs.iter().map(|(_, disc)| disc.optical_depth(light, t)).sum::<f64>()).exp()
        })
    }

    /// How far from `from` on strands take the same, at most to `to`, and what they leave.
    ///
    /// The strands that are near do not change within a piece. But of two segments of one strand either may be the nearest,
    /// before or behind the point, and two passes may become one: such jumps are looked for between three places, and
    /// bisected.
    fn constant_part(&mut self, occluders: &Occluders, light: PlaneLight, from: f64, to: f64) -> (f64, f64) {
        if !to.is_finite() {
            return (to, self.strand_transmittance(occluders, light, 2.0 * from.max(1.0)));
        }
        // Neighbours that lie wholly between the light and the ray are one pass, whichever is the nearer.
        let is_simple = self.active_capsules.windows(2).all(|pair| {
            let is_joint = pair[0].segment + 1 == pair[1].segment && pair[0].is_between && pair[1].is_between;
            is_joint || pair[0].strand != pair[1].strand
        });
        let at = |share: f64| from + share * (to - from);
        if is_simple {
            return (to, self.strand_transmittance(occluders, light, at(0.5)));
        }
        // Not at the ends, where rounding decides whether a segment is near.
        let first = self.strand_transmittance(occluders, light, at(1e-3));
        let mut low = at(1e-3);
        for share in [0.5, 1.0 - 1e-3] {
            let mut high = at(share);
            if self.strand_transmittance(occluders, light, high) == first {
                low = high;
                continue;
            }
            // To a millionth of the piece: what is left of a strand's radius does not count.
            for _ in 0..24 {
                let middle = 0.5 * (low + high);
                if self.strand_transmittance(occluders, light, middle) == first {
                    low = middle
                } else {
                    high = middle
                }
            }
            // A piece that is too short to be cut is whole.
            return (if high > from { high } else { to }, first);
        }
        (to, first)
    }

    /// Makes those active whose stretches reach into the piece `[from, to]`.
    fn move_to(&mut self, from: f64, to: f64) {
        let [disc, capsule] = &mut self.begun;
        while let Some((stretch, next)) = self.discs.get(*disc).filter(|(stretch, _)| stretch[0] < to) {
            self.active_discs.push((stretch[1], *next));
            *disc += 1;
        }
        self.active_discs.retain(|(end, _)| *end > from);
        while let Some(next) = self.capsules.get(*capsule).filter(|capsule| capsule.stretch[0] < to) {
            let at = self.active_capsules.partition_point(|active| active.segment < next.segment);
            self.active_capsules.insert(at, *next);
            *capsule += 1;
        }
        self.active_capsules.retain(|capsule| capsule.stretch[1] > from);
    }

    /// What the strands leave of the light of the point at t.
    ///
    /// A strand that lies between the light and the ray, with neighbours alone, is passed once wherever it is active: nothing has
    /// to be asked where it is nearest. That is nearly all of a head of hair.
    fn strand_transmittance(&mut self, occluders: &Occluders, light: PlaneLight, t: f64) -> f64 {
        let place = Capsule::place_of(light, t);
        let mut left = 1.0;
        let Self { active_capsules, near, runs, .. } = self;
        for strand in active_capsules.chunk_by(|a, b| a.strand == b.strand) {
            let is_one_pass = strand.iter().all(|near| near.is_between && near.opacity == strand[0].opacity)
                && strand.windows(2).all(|pair| pair[0].segment + 1 == pair[1].segment);
            if is_one_pass {
                left *= 1.0 - strand[0].opacity;
                continue;
            }
            near.clear();
            for NearCapsule { segment, capsule, .. } in strand {
                let closest = capsule.closest(light, t);
                if closest.distance_sq < capsule.radius * capsule.radius {
                    let (distance_sq, along) = (closest.distance_sq, closest.along);
                    near.push(NearSegment { segment: *segment, distance_sq, along });
                }
            }
            each_pass(occluders, near, runs, |along, opacity| {
                // At its own depth a strand dims nothing yet.
                if along < place {
                    left *= 1.0 - opacity;
                }
            });
        }
        left
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let bytes = self.discs.capacity() * size_of::<(Stretch, Disc)>()
            + (self.capsules.capacity() + self.active_capsules.capacity()) * size_of::<NearCapsule>()
            + self.cuts.capacity() * size_of::<f64>()
            + self.active_discs.capacity() * size_of::<(f64, Disc)>()
            + (self.near.capacity() + self.runs.capacity()) * size_of::<NearSegment>();
        bytes as u64
    }
}

/// Where on a stretch the point of the ray passes the place at which the capsule is nearest to its shadow ray; NaN where it
/// does not.
fn crossing(capsule: &Capsule, light: PlaneLight, [low, high]: Stretch, end: f64) -> f64 {
    // Between the light and the ray from one end of the stretch to the other: nothing is passed.
    let lowest = capsule.ends[0].y.min(capsule.ends[1].y) - capsule.radius;
    if lowest > 0.0 {
        return f64::NAN;
    }
    let is_before = |t: f64| capsule.closest(light, t).along < Capsule::place_of(light, t);
    // A ray without end: beyond 1e9 times its begin nothing has weight.
    let (mut low, mut high) = (low.max(0.0), high.min(end).min(1e9 * (1.0 + low.max(0.0))));
    let before = is_before(low);
    if is_before(high) == before {
        return f64::NAN;
    }
    // Until the two are neighbours in f64, or nearly.
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if !(middle > low && middle < high) {
            break;
        }
        if is_before(middle) == before { low = middle } else { high = middle }
    }
    high
}
