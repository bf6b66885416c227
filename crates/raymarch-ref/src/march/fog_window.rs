//! The part of a ray in height fog that is worth marching: between where the fog has hardly begun and where no light is
//! left.

use scatter_core::FogRay;

use super::NEGLIGIBLE_OPTICAL_DEPTH;
use super::packet::Span;

/// Scale heights on the thin side of the fog that are marched: e⁻²¹ = 8e-10 of the fog lies beyond them, and where an
/// optical depth of 17 follows, 17 times that of the light. Smaller values lose light, larger ones spend steps on what no
/// f32 sum can hold.
pub const SCALE_HEIGHTS: f64 = 21.0;

/// The part of `[0, end]` that is marched, finite; `weakest` is the extinction of the weakest channel that scatters.
pub fn fog_window(fog: &FogRay, end: f64, weakest: f64) -> Span {
    let reach = fog.reach(weakest, NEGLIGIBLE_OPTICAL_DEPTH);
    let end = end.min(reach).min(f64::MAX);
    let depth = SCALE_HEIGHTS / fog.slope().abs();
    if fog.slope() > 0.0 {
        Span { start: 0.0, end: end.min(depth) }
    } else {
        Span { start: (end - depth).max(0.0), end }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_is_below_f32() {
        for log_density in [-1000.0, -40.0, -1.0, 0.0, 3.0] {
            for slope in [-4.0, -0.1, -1e-9, 0.0, 1e-9, 0.02, 5.0] {
                for sigma in [1e-6, 0.03, 2.0, 500.0] {
                    for end in [0.1, 40.0, 3000.0] {
                        let fog = FogRay::from_parts(log_density, slope);
                        let span = fog_window(&fog, end, sigma);
                        assert!(0.0 <= span.start && span.start <= span.end && span.end <= end);
                        let whole = fog.sun_interval(sigma, 0.0, end);
                        let part = fog.sun_interval(sigma, span.start, span.end);
                        // An ulp of f32, or less light than f32 has numbers for.
                        assert!(whole - part <= 6e-8 * whole, "{fog:?} {sigma} {end}: {part} of {whole}");
                    }
                }
            }
        }
    }
}
