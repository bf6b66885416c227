//! The instruction set that inner loops are compiled for, chosen once when the technique is made.

pub use fearless_simd::Level;

/// The widest one of this CPU; `SCATTER_SIMD=baseline` forces what every CPU of the target has.
pub fn chosen() -> Level {
    let baseline = std::env::var_os("SCATTER_SIMD").is_some_and(|value| value == "baseline");
    if baseline { Level::baseline() } else { Level::new() }
}

/// Runs an expression with the instructions of a level, AVX-512, AVX2 or the target's baseline; vectors of the name
/// before `=>` are of that kind.
macro_rules! at_level {
    ($level:expr, $work:expr) => {
        at_level!($level, _simd => $work)
    };
    ($level:expr, $simd:ident => $work:expr) => {{
        use fearless_simd::Simd;
        #[cfg(target_arch = "x86_64")]
        {
            if let Some($simd) = $level.as_avx512() {
                $simd.vectorize(#[inline(always)] || $work)
            } else if let Some($simd) = $level.as_avx2() {
                $simd.vectorize(#[inline(always)] || $work)
            } else {
                let Some($simd) = $level.as_sse2() else { unreachable!("every x86-64 CPU has SSE2") };
                $simd.vectorize(#[inline(always)] || $work)
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        fearless_simd::dispatch!($level, $simd => $simd.vectorize(#[inline(always)] || $work))
    }};
}
pub(crate) use at_level;
