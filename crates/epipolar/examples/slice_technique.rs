//! A technique in eighty lines: its option, what it can do, and how it sums a slice; the slice driver does the rest.
//!
//! It takes the lit share of a view ray's length for the lit share of its light: exact in media so thin that transmittance
//! does not matter, under a sun. `cargo run --release -p epipolar --example slice_technique`

use epipolar::driver::{SliceDriver, SliceQueries, SliceRoom, SliceSettings, SliceView};
use epipolar::{SliceIntegrator, rows::Row};
use scatter_core::*;

struct Options {
    spacing: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { spacing: 1.0 }
    }
}

static TABLE: OptionTable<Options> = OptionTable {
    technique: "thin",
    rows: &[option_row!(
        "spacing",
        "distance of slices",
        "pixels",
        OptionRange::Real([0.25, 8.0]),
        spacing as f64
    )],
};

/// The integrator has nothing to prepare.
struct LitLength;

impl SliceIntegrator for LitLength {
    type Scratch = Row;

    fn reserve(&self, room: &SliceRoom<'_>, row: &mut Row) {
        row.clear(room.runs);
    }

    fn integrate(&self, slice: &SliceView<'_>, queries: &mut SliceQueries, row: &mut Row) {
        slice.rectify(0.0, row);
        let open = queries.open(0..queries.len());
        let [shares, ..] = open.shares;
        for (query, (&column, &end)) in open.columns.iter().zip(open.gammas).enumerate() {
            // Of the light rays before the ray's end, those that the column's place in the order of light sees lit.
            let rank = slice.order.rank(slice.order.columns[0] + column);
            let runs = row.starts().windows(2).zip(row.lit());
            let lit = runs
                .filter(|(_, columns)| **columns > rank)
                .map(|(run, _)| run[1].min(end) - run[0].min(end));
            shares[query] = if end > 0.0 { (lit.sum::<f32>() / end).clamp(0.0, 1.0) } else { 1.0 };
        }
    }
}

struct Thin {
    options: Options,
    driver: SliceDriver<LitLength>,
}

impl VolumetricShadow for Thin {
    fn id(&self) -> &'static str {
        TABLE.technique
    }

    fn capabilities(&self) -> Capabilities {
        let maps = &[MapKind::Unshadowed, MapKind::Orthographic, MapKind::Cascades];
        Capabilities {
            lights: &[LightKind::Directional],
            textures: &[],
            height_fog: &[],
            translucent: &[],
            maps,
            ..epipolar::CAPABILITIES
        }
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        Ok(self.driver.render(frame, &SliceSettings::even(self.options.spacing), out))
    }
}

// The technique ends here: what follows sets a scene and shows what came out.
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let size = [160, 90];
    let camera = Camera::perspective([0.0, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 60.0, size)?;
    let distances = vec![12.0f32; 160 * 90];
    let light = Light::directional([0.3, -1.0, 0.2], [1.0; 3])?;
    let up = [0.0, 0.0, 1.0];
    let projection = MapProjection::orthographic([0.0, 9.0, 0.0], [0.3, -1.0, 0.2], up, [8.0; 2], [64; 2])?;
    // Boards with gaps of their own width between them.
    let texels: Vec<f32> = (0..64 * 64).map(|n| if n % 16 < 8 { 6.0 } else { f32::INFINITY }).collect();
    let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels)?);
    let haze = Medium::homogeneous([1e-4; 3], [0.0; 3], Phase::Isotropic)?;
    let frame = Frame::new(&camera, DepthMap::new(&distances, size)?, &light, &shadow, &haze, 20.0)?;

    let mut options = Options::default();
    TABLE.set(&mut options, "spacing", "0.5")?;
    let mut thin = Thin { options, driver: SliceDriver::new(LitLength) };
    let mut image = ScatterImage::new();
    let stats = thin.render(&frame, &mut image)?;
    let exact = walked_radiance(&frame, 80, 60);
    println!("{}: {} of exact {}; {:?}", thin.id(), image.at(80, 60)[0], exact.x, stats.counts.get("slices"));
    // A wrong technique must not pass for an example.
    assert!((f64::from(image.at(80, 60)[0]) / exact.x - 1.0).abs() < 0.02);
    Ok(())
}
