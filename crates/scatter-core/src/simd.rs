//! The instruction set that inner loops are compiled for, chosen once when a technique is made.

pub use fearless_simd::Level;

/// The widest one of this CPU. `SCATTER_SIMD` in the environment forces less: `baseline` what every CPU of the target has,
/// `avx2` that where the CPU has it.
pub fn simd_level() -> Level {
    at_most(std::env::var("SCATTER_SIMD").unwrap_or_default().as_str())
}

/// The level of that name where the CPU has it; of any other name, the widest one.
fn at_most(name: &str) -> Level {
    let widest = Level::new();
    match name {
        "baseline" => Level::baseline(),
        #[cfg(target_arch = "x86_64")]
        "avx2" => widest.as_avx2().map_or(widest, Level::Avx2),
        _ => widest,
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_forces_its_level() {
        assert_eq!(format!("{:?}", at_most("")), format!("{:?}", Level::new()));
        assert_eq!(format!("{:?}", at_most("baseline")), format!("{:?}", Level::baseline()));
        #[cfg(target_arch = "x86_64")]
        {
            let forced = at_most("avx2");
            assert!(forced.as_avx512().is_none() || Level::new().as_avx2().is_none(), "{forced:?}");
            assert_eq!(forced.as_avx2().is_some(), Level::new().as_avx2().is_some());
        }
    }
}
