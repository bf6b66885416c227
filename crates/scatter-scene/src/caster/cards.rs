//! The cut-outs among a caster's triangles, by their place in the tree, in coordinates of their masks' texels.

use glam::DVec2;

use super::error::CasterError;
use crate::cutout::{AlphaMask, Wrap};
use crate::scene::Scene;

/// A cut-out triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Card {
    /// Index of its mask.
    pub mask: u32,
    /// Where its corners, in welded order, lie on the mask \[texels\], less whole periods of it: the first one of a
    /// texture that repeats is as good as any.
    pub texels: [DVec2; 3],
}

/// All cut-outs of a caster. A scene without any has empty lists.
#[derive(Debug, Default)]
pub(crate) struct Cards {
    /// `[triangle in the tree's order]` → index into `cards`, or [`OPAQUE`]. Empty without cut-outs.
    card_of: Vec<u32>,
    cards: Vec<Card>,
    masks: Vec<AlphaMask>,
    /// Most texels that a straight line over one of them can cross.
    longest: f64,
}

const OPAQUE: u32 = u32::MAX;

/// Whether a scene's cut-outs are as [`Scene::cutouts`] says.
pub(super) fn check(scene: &Scene) -> Result<(), CasterError> {
    let mut before = None;
    for (index, cutout) in scene.cutouts.iter().enumerate() {
        let problem = if cutout.triangle as usize >= scene.triangles.len() {
            "names a triangle that is not there; give an index into the scene's triangles"
        } else if cutout.mask as usize >= scene.masks.len() {
            "names a mask that is not there; give an index into the scene's masks"
        } else if before.is_some_and(|before| before >= cutout.triangle) {
            "is not behind the one before it; sort them by triangle, one a triangle"
        } else if !cutout.uv.iter().all(|uv| uv.is_finite()) {
            "has texture coordinates that are not finite; give numbers"
        } else {
            before = Some(cutout.triangle);
            continue;
        };
        return Err(CasterError::BadCutout { index, problem });
    }
    Ok(())
}

impl Cards {
    /// `corner_of(triangle in the tree's order, corner in the scene's order)` is the triangle's number in the scene and
    /// the corner's vertex in `triangles`.
    pub(super) fn new(
        scene: &Scene,
        triangles: &[[u32; 3]],
        corner_of: impl Fn(usize, usize) -> (u32, u32),
    ) -> Self {
        if scene.cutouts.is_empty() {
            return Self::default();
        }
        let mut cards = Vec::new();
        let card_of = triangles.iter().enumerate().map(|(leaf, corners)| {
            let (source, _) = corner_of(leaf, 0);
            let Ok(found) = scene.cutouts.binary_search_by_key(&source, |cutout| cutout.triangle) else {
                return OPAQUE;
            };
            let cutout = &scene.cutouts[found];
            let mask = &scene.masks[cutout.mask as usize];
            // Three different vertices, so each has one corner.
            let uv = corners.map(|vertex| {
                let corner = (0..3).find(|&corner| corner_of(leaf, corner).1 == vertex);
                cutout.uv[corner.unwrap_or(0)]
            });
            cards.push(Card { mask: cutout.mask, texels: in_texels(mask, uv) });
            cards.len() as u32 - 1
        });
        let card_of = card_of.collect();
        cards.shrink_to_fit();
        let masks = scene.masks.clone();
        let crossed = |card: &Card| {
            let mask = &masks[card.mask as usize];
            let crossed = |axis: usize| {
                let at = card.texels.map(|texel: DVec2| texel[axis]);
                let span = at.into_iter().fold(f64::NEG_INFINITY, f64::max)
                    - at.into_iter().fold(f64::INFINITY, f64::min);
                // What lies beyond a clamped texture's ends has no borders.
                let most =
                    if mask.wrap()[axis] == Wrap::ClampToEdge { mask.size()[axis].into() } else { span };
                span.min(most)
            };
            crossed(0) + crossed(1)
        };
        let longest = cards.iter().map(crossed).fold(0.0, f64::max);
        Self { card_of, cards, masks, longest }
    }

    /// The card that a triangle is, if it is one.
    #[inline]
    pub fn get(&self, triangle: u32) -> Option<&Card> {
        // Past the end, for a scene without cut-outs and for an opaque triangle.
        self.cards.get(*self.card_of.get(triangle as usize)? as usize)
    }

    /// The mask of a card.
    #[inline]
    pub fn mask(&self, card: &Card) -> &AlphaMask {
        &self.masks[card.mask as usize]
    }

    /// Whether nothing is cut out.
    #[cfg(feature = "raster")]
    pub fn is_empty(&self) -> bool {
        self.cards.is_empty()
    }

    /// All of them, with their triangles.
    #[cfg(feature = "raster")]
    pub fn iter(&self) -> impl Iterator<Item = (u32, &Card)> {
        (0..self.card_of.len() as u32).filter_map(|triangle| Some((triangle, self.get(triangle)?)))
    }

    /// All masks.
    #[cfg(feature = "raster")]
    pub fn masks(&self) -> &[AlphaMask] {
        &self.masks
    }

    /// Most texels that a straight line over one of the cut-outs can cross.
    pub fn longest_line(&self) -> f64 {
        self.longest
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let lists = self.card_of.capacity() * size_of::<u32>() + self.cards.capacity() * size_of::<Card>();
        lists as u64 + self.masks.iter().map(AlphaMask::memory_bytes).sum::<u64>()
    }
}

/// Texture coordinates in texels, near the origin of a texture that repeats: what is left has all of its digits, and
/// the whole texels between two corners can be counted.
fn in_texels(mask: &AlphaMask, uv: [DVec2; 3]) -> [DVec2; 3] {
    let size = DVec2::from(mask.size().map(f64::from));
    let mut texels = uv.map(|uv| uv * size);
    for axis in 0..2 {
        let period = match mask.wrap()[axis] {
            Wrap::Repeat => size[axis],
            Wrap::MirroredRepeat => 2.0 * size[axis],
            Wrap::ClampToEdge => continue,
        };
        let lowest = texels.iter().map(|texel| texel[axis]).fold(f64::INFINITY, f64::min);
        // A whole number of texels, taken from whole numbers and halves alike: the difference is exact unless the
        // triangle spans more than 2⁵³ of its smallest digit.
        let whole = (lowest / period).floor() * period;
        for texel in &mut texels {
            texel[axis] -= whole;
        }
    }
    texels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cutout::Cutout;
    use glam::DVec3;

    fn one_card() -> Scene {
        Scene {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]],
            cutouts: vec![Cutout { triangle: 0, mask: 0, uv: [DVec2::ZERO, DVec2::X, DVec2::Y] }],
            masks: vec![AlphaMask::new([2, 2], [Wrap::Repeat; 2], |_, _| true)],
            ..Scene::default()
        }
    }

    #[test]
    fn a_cutout_that_names_nothing_is_an_error() {
        assert_eq!(check(&one_card()), Ok(()));
        type Spoil = fn(&mut Scene);
        let spoilt: [(Spoil, &str); 4] = [
            (|scene| scene.cutouts[0].triangle = 1, "triangle that is not there"),
            (|scene| scene.cutouts[0].mask = 1, "mask that is not there"),
            (|scene| scene.cutouts[0].uv[2].y = f64::NAN, "not finite"),
            (|scene| scene.cutouts.push(scene.cutouts[0]), "sort them"),
        ];
        for (spoil, problem) in spoilt {
            let mut scene = one_card();
            spoil(&mut scene);
            let error = check(&scene).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }

    #[test]
    fn corners_keep_their_coordinates_through_welding_and_renumbering() {
        // Vertices in an order that neither welding nor the tree keeps, with doubles and an empty triangle before.
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let scene = Scene {
            positions: vec![
                at(5.0, 5.0),
                at(0.0, 9.0),
                at(3.0, 0.0),
                at(0.0, 0.0),
                at(0.0, 0.0),
                at(-4.0, 1.0),
            ],
            triangles: vec![[3, 4, 2], [2, 1, 4], [5, 3, 1], [0, 1, 2]],
            cutouts: vec![
                Cutout { triangle: 0, mask: 0, uv: [DVec2::ZERO; 3] },
                Cutout {
                    triangle: 1,
                    mask: 0,
                    uv: [at(3.0, 0.0), at(0.0, 9.0), at(0.0, 0.0)].map(|p| p.truncate()),
                },
                Cutout {
                    triangle: 3,
                    mask: 0,
                    uv: [at(5.0, 5.0), at(0.0, 9.0), at(3.0, 0.0)].map(|p| p.truncate()),
                },
            ],
            masks: vec![AlphaMask::new([1, 1], [Wrap::ClampToEdge; 2], |_, _| true)],
            ..Scene::default()
        };
        let caster = crate::caster::SceneCaster::new(&scene).unwrap();
        let cards: Vec<_> = (0..3).filter_map(|t| Some((t, caster.cards().get(t)?))).collect();
        assert_eq!((caster.triangle_count(), cards.len()), (3, 2));
        for (triangle, card) in cards {
            assert_eq!(card.texels, caster.corners(triangle).map(|p| p.truncate()));
        }
    }

    #[test]
    fn whole_periods_are_left_out() {
        let mask = AlphaMask::new([4, 4], [Wrap::Repeat, Wrap::MirroredRepeat], |_, _| true);
        let uv = [DVec2::new(-1.25, 7.5), DVec2::new(0.5, 8.0), DVec2::new(1e6, 7.0)];
        let expected = [DVec2::new(3.0, 6.0), DVec2::new(10.0, 8.0), DVec2::new(4e6 + 8.0, 4.0)];
        assert_eq!(in_texels(&mask, uv), expected);
    }
}
