//! The instruction set that inner loops are compiled for, chosen once when a technique is made.

pub use fearless_simd::Level;

/// The widest one of this CPU; `SCATTER_SIMD=baseline` in the environment forces what every CPU of the target has.
pub fn simd_level() -> Level {
    let baseline = std::env::var_os("SCATTER_SIMD").is_some_and(|value| value == "baseline");
    if baseline { Level::baseline() } else { Level::new() }
}

/// Runs an expression with the instructions of a [`Level`](crate::Level): AVX-512, AVX2 or the target's baseline. Vectors of
/// the name before `=>`, if there is one, are of that kind. Variables of a `Level` are called `simd`: a level is a quality.
///
/// `fearless_simd::dispatch!` without SSE4.2: every CPU that is fast enough has AVX2, the others are served by SSE2, and
/// a copy less of every loop is a quarter of a crate's build.
#[macro_export]
macro_rules! at_level {
    ($simd:expr, $work:expr) => {
        $crate::at_level!($simd, _vectors => $work)
    };
    ($simd:expr, $vectors:ident => $work:expr) => {{
        use $crate::fearless_simd::Simd as _;
        #[cfg(target_arch = "x86_64")]
        {
            if let Some($vectors) = $simd.as_avx512() {
                $vectors.vectorize(#[inline(always)] || $work)
            } else if let Some($vectors) = $simd.as_avx2() {
                $vectors.vectorize(#[inline(always)] || $work)
            } else {
                let Some($vectors) = $simd.as_sse2() else { unreachable!("every x86-64 CPU has SSE2") };
                $vectors.vectorize(#[inline(always)] || $work)
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        $crate::fearless_simd::dispatch!($simd, $vectors => $vectors.vectorize(#[inline(always)] || $work))
    }};
}
