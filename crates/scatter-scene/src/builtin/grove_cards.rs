//! `grove-cards`: the clearing of `grove` as real files have it, with cut-out cards for leaves.
//!
//! The same trees at the same places; what nine thousand folded leaves are there, a few hundred squares are here, each
//! with a twig's leaves painted into its texture's alpha.

use super::glb_writer::GlbScene;
use super::grove::{GROUND_CELLS, Species, ground, plant_all};
use super::random::{Random, sin_cos_turns};
use super::shot::BuiltinShot;
use super::tree::Foliage;
use glam::DVec2;
use image::{ImageBuffer, ImageFormat, Rgba};
use std::io::Cursor;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "grove-cards",
    shows: "the grove with alpha cut-outs for leaves: a tenth of its triangles, silhouettes by a texture's alpha, as \
            foliage is modelled for real time",
    shot_text: r#"# A clearing among trees whose leaves are cut-out cards, the sun through the leaves ahead.
mesh = "grove-cards.glb"

[camera]
eye = [0.0, 1.7, 15.0]
target = [0.2, 3.6, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 58.0
resolution = [640, 480]
max_distance = 70.0

[light]
kind = "directional"
direction = [0.3, -0.68, 0.67]
irradiance = [10.0, 9.0, 7.5]

[medium]
scattering = [0.02, 0.02, 0.02]
absorption = [0.002, 0.002, 0.002]
phase = "henyey-greenstein"
g = 0.35
"#,
    mesh_extension: "glb",
    mesh_bytes,
    others: &[],
};

/// Cards of a tree.
const CARDS: usize = 680;
/// Their side \[m\].
const SIDE: f64 = 0.78;
/// Texels along their side: six millimetres each.
const TEXELS: u32 = 128;
/// Leaves on a card: half as many again as a tree of `grove` has, for those that overlap
/// on a card or hide one another in one plane, so that as much light comes through.
const LEAVES: u32 = 20;

fn mesh_bytes() -> Vec<u8> {
    let mut scene = GlbScene::default();
    scene.cut_out_by(twig_png());
    scene.add_mesh_node("ground", ground(GROUND_CELLS / 2));
    let species = Species::grow(&mut scene, Foliage::Cards { count: CARDS, side: SIDE });
    plant_all(&mut scene, &species);
    scene.to_bytes()
}

/// A leaf on the card, in units of its side: where its stalk is, where it points to, its length.
struct Leaf {
    base: DVec2,
    tip_dir: DVec2,
    length: f64,
}

impl Leaf {
    /// Whether the rhomb of `grove`'s leaves holds a point: widest, three fifths of its length, after 0.45 of it.
    fn holds(&self, p: DVec2) -> bool {
        let (along, across) =
            ((p - self.base).dot(self.tip_dir), (p - self.base).perp_dot(self.tip_dir).abs());
        let share = along / self.length;
        let half_width = if share < 0.45 { share / 0.45 } else { (1.0 - share) / 0.55 } * 0.3 * self.length;
        across <= half_width
    }
}

/// A twig from the lower edge's middle upwards, with leaves to all sides.
fn twig_is_there() -> impl Fn(u32, u32) -> bool {
    let mut random = Random::new(71);
    let leaves: Vec<Leaf> = (0..LEAVES)
        .map(|index| {
            // From the stalk up, to the left and the right in turn; turned by up to a fifth from straight sideways.
            let up = (f64::from(index) + 0.5) / f64::from(LEAVES);
            let side = if index % 2 == 0 { 1.0 } else { -1.0 };
            let (sine, cosine) = sin_cos_turns(0.02 + 0.16 * random.unit());
            let tip_dir = DVec2::new(side * cosine, -sine);
            let start = DVec2::new(0.5 + side * 0.16 * random.unit(), 0.97 - 0.82 * up);
            let length = 0.26 / SIDE * random.between(0.85, 1.2);
            Leaf { base: start, tip_dir, length }
        })
        .collect();
    move |column, row| {
        let p = (DVec2::new(column.into(), row.into()) + 0.5) / f64::from(TEXELS);
        let is_twig = (p.x - 0.5).abs() < 0.008 && p.y > 0.12;
        is_twig || leaves.iter().any(|leaf| leaf.holds(p))
    }
}

/// The twig as a PNG file with alpha.
fn twig_png() -> Vec<u8> {
    let is_there = twig_is_there();
    let image = ImageBuffer::from_fn(TEXELS, TEXELS, |column, row| {
        Rgba([86u8, 122, 48, if is_there(column, row) { 255 } else { 0 }])
    });
    let mut bytes = Cursor::new(Vec::new());
    // Writing to memory cannot fail, and an empty file would not load.
    let _ = image.write_to(&mut bytes, ImageFormat::Png);
    bytes.into_inner()
}

#[cfg(test)]
mod tests {
    use super::super::BuiltinShot;
    use super::*;

    #[test]
    fn the_texture_covers_what_its_leaves_cover() {
        let image = image::load_from_memory(&twig_png()).unwrap().to_rgba8();
        assert_eq!(image.dimensions(), (TEXELS, TEXELS));
        let is_there = twig_is_there();
        let mut covered = 0;
        for (column, row, pixel) in image.enumerate_pixels() {
            assert_eq!(pixel.0[3] == 255, is_there(column, row));
            covered += u32::from(pixel.0[3] == 255);
        }
        // A leaf of length l covers 0.3·l²; l is 1/3 of the side, so 20 of them 67 % at the most.
        let share = f64::from(covered) / f64::from(TEXELS * TEXELS);
        println!("{share:.3} of the card is there");
        assert!((0.35..0.67).contains(&share), "{share}");
        // What would lie beyond the card's edges would be cut off straight.
        let is_edge = |column: u32| column == 0 || column == TEXELS - 1;
        let cut = image.enumerate_pixels().filter(|(column, _, p)| is_edge(*column) && p.0[3] == 255).count();
        assert!(cut <= 4, "{cut}");
    }

    #[test]
    fn it_has_a_tenth_of_the_groves_triangles() {
        let triangles = |name: &str| {
            let bytes = BuiltinShot::find(name).unwrap().files().mesh.bytes;
            let file = gltf::Gltf::from_slice(&bytes).unwrap();
            let count = |node: gltf::Node<'_>| {
                let primitives =
                    node.mesh().into_iter().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>());
                primitives
                    .map(|primitive| primitive.indices().map_or(0, |indices| indices.count() / 3))
                    .sum::<usize>()
            };
            file.nodes().map(count).sum::<usize>()
        };
        let (cards, leaves) = (triangles("grove-cards"), triangles("grove"));
        println!("grove-cards {cards} triangles, grove {leaves}");
        assert!((9 * cards..11 * cards).contains(&leaves), "{cards} {leaves}");
    }
}
