//! How near each kind comes to the uncompressed curve: RMS and largest error of the transmittance over all texels × 256 depths.

use std::error::Error;

use scatter::avsm::{DepthRange, Removal, TranslucentSegment, TransmittanceCurve, UncompressedCurve};

use crate::kinds::{self, By, Visit};
use crate::segments::{SHOTS, Texels, captured, puffs, staged};

/// Texels along the longer side of the maps.
const SIDE: u32 = 128;
/// Depths between the nearest entry and the farthest exit of a map.
const DEPTHS: u32 = 256;

/// Prints the tables.
pub fn print() -> Result<(), Box<dyn Error>> {
    let mut all = vec![("puffs", Judged::new(puffs()))];
    for name in SHOTS {
        all.push((name, Judged::new(captured(&staged(name)?, SIDE)?)));
    }
    for (name, judged) in &all {
        let (texels, longest) = (judged.texels.lists.len(), judged.texels.lists.iter().map(Vec::len).max());
        let segments: usize = judged.texels.lists.iter().map(Vec::len).sum();
        println!("\n{name}: {texels} texels, {segments} segments, at most {} a texel", longest.unwrap_or(0));
        println!(
            "RMS / largest error [%]; range of slices, series and moments 1, 2, 4, 8, 16 times the occluders'"
        );
        kinds::all(&mut Row { judged });
        println!(
            "order of insertion, RMS / largest error [%]: submitted | sorted | shuffled; and by other rules"
        );
        order(judged);
    }
    Ok(())
}

/// Texels with their exact curves' transmittances.
struct Judged {
    texels: Texels,
    depths: Vec<f64>,
    exact: Vec<f32>,
}

impl Judged {
    fn new(texels: Texels) -> Self {
        let DepthRange { near, .. } = texels.range;
        let step = texels.range.length() / f64::from(DEPTHS);
        let depths: Vec<f64> = (0..DEPTHS).map(|n| f64::from(near) + step * (f64::from(n) + 0.5)).collect();
        let mut exact = Vec::with_capacity(texels.lists.len() * depths.len());
        for list in &texels.lists {
            let curve = built(UncompressedCurve::default(), list);
            exact.extend(depths.iter().map(|&depth| curve.transmittance(depth) as f32));
        }
        Self { texels, depths, exact }
    }

    /// RMS and largest error \[%\] of the curves that `make` gives, of each texel's segments as `arranged`.
    fn error<C: TransmittanceCurve>(
        &self,
        make: impl Fn() -> C,
        arranged: impl Fn(&mut [TranslucentSegment]),
    ) -> [f64; 2] {
        let (mut square, mut largest) = (0.0, 0.0f64);
        for (list, exact) in self.texels.lists.iter().zip(self.exact.chunks_exact(self.depths.len())) {
            let mut list = list.clone();
            arranged(list.as_mut_slice());
            let curve = built(make(), &list);
            for (&depth, &exact) in self.depths.iter().zip(exact) {
                let error = (curve.transmittance(depth) - f64::from(exact)).abs();
                square += error * error;
                largest = largest.max(error);
            }
        }
        [100.0 * (square / self.exact.len() as f64).sqrt(), 100.0 * largest]
    }
}

fn built<C: TransmittanceCurve>(mut curve: C, segments: &[TranslucentSegment]) -> C {
    segments.iter().for_each(|segment| curve.insert(segment));
    curve.finish();
    curve
}

struct Row<'a> {
    judged: &'a Judged,
}

impl Visit for Row<'_> {
    fn kind<C: TransmittanceCurve>(&mut self, name: &str, make: impl Fn(DepthRange) -> C) {
        let range = self.judged.texels.range;
        // Only slices, series and moments see a range.
        let sees = ["opacity", "fourier", "moments"].iter().any(|kind| name.starts_with(kind));
        let growths: &[f64] = if sees { &[1.0, 2.0, 4.0, 8.0, 16.0] } else { &[1.0] };
        let of = |growth: f64| {
            let far = f64::from(range.near) + growth * range.length();
            let grown = DepthRange { near: range.near, far: far as f32 };
            let [rms, largest] = self.judged.error(|| make(grown), |_| ());
            format!("{rms:.2} / {largest:.1}")
        };
        let cells: Vec<String> = growths.iter().map(|&growth| of(growth)).collect();
        println!("{name:12} | {}", cells.join(" | "));
    }
}

fn order(judged: &Judged) {
    fn line<const N: usize>(judged: &Judged) {
        let cell = |[rms, largest]: [f64; 2]| format!("{rms:.2} / {largest:.1}");
        let by = |removal: Removal, arranged: fn(&mut [TranslucentSegment])| {
            let make = By::<N>::rule(removal);
            cell(judged.error(|| make(DepthRange::EMPTY), arranged))
        };
        let cells = [
            by(Removal::Exponential, |_| ()),
            by(Removal::Exponential, sorted),
            by(Removal::Exponential, shuffled),
            by(Removal::Triangle, |_| ()),
            by(Removal::LookAhead, |_| ()),
        ];
        println!(
            "avsm {N:2} | {} | {} | {} | triangles {} | look ahead {}",
            cells[0], cells[1], cells[2], cells[3], cells[4]
        );
    }
    line::<4>(judged);
    line::<8>(judged);
    line::<12>(judged);
    line::<16>(judged);
}

fn sorted(list: &mut [TranslucentSegment]) {
    list.sort_by(|a, b| a.entry.total_cmp(&b.entry));
}

/// The same shuffle on every machine: Fisher and Yates, by a congruential generator.
fn shuffled(list: &mut [TranslucentSegment]) {
    let mut state = 0x2545_f491u32;
    for last in (1..list.len()).rev() {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        list.swap(last, (state >> 8) as usize % (last + 1));
    }
}
