//! What the bases miss of known rows: one plane, a few layers, a slope, foliage.

use crate::fourier::{FourierAnswers, FourierRow, Terms};
use crate::moments::{Answer, MomentAnswers, MomentRow, bias_of};
use crate::runs::{Asked, DepthScale, Runs};
use crate::storage::Storage;
use crate::weights::BandWeights;
use epipolar::rows::Row;
use scatter_core::{Level, at_level};
use scatter_testing::Random;

/// Columns of the slices.
const COLUMNS: u32 = 1000;

/// A row of runs of one weight, and one view ray a column that ends behind all of them.
struct Case {
    row: Row,
    asked: Asked,
    band: BandWeights,
    exact: Vec<f32>,
}

impl Case {
    fn new(lit: &[u32]) -> Self {
        let mut row = Row::default();
        row.clear(lit.len() + 1);
        for (run, &lit) in lit.iter().enumerate() {
            row.push(run as f32, lit);
        }
        // Nothing lies behind the end.
        row.push(lit.len() as f32, 0);
        row.finish();
        let runs = row.lit().len();
        let mut asked = Asked::default();
        asked.make_room(COLUMNS as usize);
        let mut band = BandWeights::default();
        band.make_room(runs, COLUMNS as usize);
        band.starts[0][..runs].copy_from_slice(&row.starts()[..runs]);
        let mut exact = Vec::new();
        for rank in 0..COLUMNS {
            let ray = rank as usize;
            (asked.queries[ray], asked.columns[ray], asked.ranks[ray]) = (rank, rank, rank);
            (asked.gammas[ray], asked.ends[ray]) = (lit.len() as f32, runs as u32 - 1);
            band.ends[0][ray] = lit.len() as f32;
            exact.push(lit.iter().filter(|&&lit| lit > rank).count() as f32 / lit.len() as f32);
        }
        Self { row, asked, band, exact }
    }

    fn scale() -> DepthScale {
        DepthScale::new([0, COLUMNS - 1])
    }

    /// RMS error of a Fourier series of `count` coefficients over all view rays but those near the range's ends.
    fn fourier(&self, count: usize, storage: Storage) -> f32 {
        let runs = Runs::new(&self.row, None);
        let mut rows = [FourierRow::default(), FourierRow::default()];
        let weights = &self.band.starts[0][..runs.lit.len()];
        rows[0].make_room(storage, runs.lit.len(), count);
        rows[0].fill(&runs, 0, weights, Self::scale());
        let task =
            FourierAnswers { rows: &rows, band: &self.band, runs, scale: Self::scale(), channel: 0, count };
        let mut shares = vec![0.0; COLUMNS as usize];
        task.answer(&self.asked, 0..COLUMNS as usize, &mut Terms::default(), &mut shares);
        self.rms(shares.into_iter())
    }

    /// RMS error of moments, and the largest excess of an error over its certificate.
    fn moments<const N: usize>(&self) -> (f32, f32) {
        let runs = Runs::new(&self.row, None);
        let mut rows = [MomentRow::default(), MomentRow::default()];
        let weights = &self.band.starts[0][..runs.lit.len()];
        rows[0].make_room(Storage::F32, runs.lit.len());
        rows[0].fill(&runs, 0, weights, Self::scale());
        let task = MomentAnswers {
            rows: &rows,
            band: &self.band,
            runs,
            scale: Self::scale(),
            channel: 0,
            bias: bias_of(2 * N as u32),
            brightest: 1.0,
        };
        let mut answers = vec![Answer::default(); COLUMNS as usize];
        at_level!(Level::new(), simd => task.answer::<N, _>(simd, &self.asked, 0..COLUMNS as usize, &mut answers));
        let excess =
            answers.iter().zip(&self.exact).map(|(own, exact)| (own.share - exact).abs() - own.certificate);
        let excess = excess.fold(f32::MIN, f32::max);
        (self.rms(answers.iter().map(|answer| answer.share)), excess)
    }

    fn rms(&self, shares: impl Iterator<Item = f32>) -> f32 {
        let all = shares.zip(&self.exact).map(|(own, exact)| (own - exact).powi(2));
        (all.sum::<f32>() / COLUMNS as f32).sqrt()
    }
}

/// Rows as they occur: kind, and the ends of 512 runs.
fn rows() -> [(&'static str, Vec<u32>); 5] {
    let mut random = Random(7);
    let mut any = |least: f64, most: f64| random.range(least, most) as u32;
    [
        ("one plane", vec![500; 512]),
        ("two layers", (0..512).map(|n| if n % 2 == 0 { 300 } else { 650 }).collect()),
        ("three layers", (0..512).map(|n| [200, 450, 800][n % 3]).collect()),
        ("slope", (0..512).map(|n| 200 + n as u32).collect()),
        ("foliage", (0..512).map(|_| any(100.0, 900.0)).collect()),
    ]
}

#[test]
fn a_series_rings_at_a_plane_as_its_tail_says() {
    for count in [4, 8, 16, 32, 64] {
        // The tail's RMS over a period is 1/(π·√M); clamping takes some of it away, the margins at both ends some that would not ring.
        let planes: Vec<f32> =
            (0..9).map(|n| Case::new(&vec![300 + 50 * n; 512]).fourier(count, Storage::F32)).collect();
        let rms = (planes.iter().map(|rms| rms * rms).sum::<f32>() / planes.len() as f32).sqrt();
        let expected = std::f32::consts::FRAC_1_PI / (count as f32).sqrt();
        println!("M = {count}: {rms:.4}, 0.318/sqrt(M) = {expected:.4}");
        assert!((0.85..1.15).contains(&(rms / expected)));
    }
}

#[test]
fn few_layers_are_exact_by_half_as_many_moments_and_all_keep_their_certificates() {
    for (name, lit) in rows() {
        let case = Case::new(&lit);
        let moments = [case.moments::<2>(), case.moments::<3>(), case.moments::<4>()];
        let series = [8, 16, 32].map(|count| case.fourier(count, Storage::F32));
        let kept = [Storage::F16, Storage::U8].map(|storage| case.fourier(32, storage));
        println!(
            "{name}: moments 4, 6, 8: {:.4?}; series 8, 16, 32: {series:.4?}; 32 as f16, u8: {kept:.4?}",
            moments.map(|m| m.0)
        );
        for (rms, excess) in moments {
            assert!(excess < 1e-6 && rms < 0.2, "{name}: {excess}");
        }
        let layers = match name {
            "one plane" => 1,
            "two layers" => 2,
            "three layers" => 3,
            _ => continue,
        };
        for (count, (rms, _)) in moments.into_iter().enumerate() {
            if layers <= count + 2 {
                // The bias smears a layer over some columns of a thousand.
                assert!(rms < 0.04, "{name}, {} moments: {rms}", 4 + 2 * count);
            }
        }
        // Half a step of 2/255 a coefficient, of which those of k count 2/c_k: 0.0084 for 32.
        assert!((kept[1] - series[2]).abs() < 0.0084 && (kept[0] - series[2]).abs() < 1e-3);
    }
}
