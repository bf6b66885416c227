//! Both factorisations against closed forms: the error of vis never exceeds the bound, whatever is lit.

use proptest::prelude::*;

use super::*;

const DEPTHS: [f64; 5] = [1e-9, 0.1, 1.0, 4.0, 20.0];
const RATIOS: [f64; 3] = [1.19, 1.41, 2.0];

/// `∫ e^{−x·y}` over `u ∈ [from, to]` with `x = depth·u`.
fn exact(depth: f64, y: f64, from: f64, to: f64) -> f64 {
    let rate = depth * y;
    (-rate * from).exp() * -(-rate * (to - from)).exp_m1() / rate
}

/// `Σ Bₖ(y)·(Pₖ(to) − Pₖ(from))`, read from the tables.
fn factorised(factors: &Factors, y: f64, from: f64, to: f64) -> f64 {
    let weights = factors.weights_at(y as f32);
    let (mut a, mut b) = ([0.0; MAX_RANK], [0.0; MAX_RANK]);
    factors.prefix_at(from as f32, &mut a);
    factors.prefix_at(to as f32, &mut b);
    (0..factors.lanes()).map(|k| f64::from(weights[k]) * (f64::from(b[k]) - f64::from(a[k]))).sum()
}

/// The error of vis for the worst visibility: of `∫fV/F − ∫eV/E` the V that is 1 exactly where `f/F > e/E` makes most.
fn worst_error(factors: &Factors, y: f64, end: f64) -> f64 {
    // An odd number of pieces that does not divide the table's intervals.
    let pieces = 3001;
    // Both ends as the tables read them, in f32, so that rounding of positions is not taken for an error of theirs.
    let at = |i: usize| f64::from((end * i as f64 / pieces as f64) as f32);
    let depth = factors.optical_depth();
    let (all_e, all_f) = (exact(depth, y, 0.0, at(pieces)), factorised(factors, y, 0.0, at(pieces)));
    (0..pieces)
        .map(|i| {
            let (e, f) = (exact(depth, y, at(i), at(i + 1)), factorised(factors, y, at(i), at(i + 1)));
            (f / all_f - e / all_e).max(0.0)
        })
        .sum()
}

/// The worst over directions and lengths.
fn worst_of_band(factors: &Factors) -> f64 {
    let mut worst = 0.0f64;
    for i in 0..=10 {
        let y = 1.0 + (factors.ratio() - 1.0) * f64::from(i) / 10.0;
        for end in [0.013, 0.2, 0.61, 1.0] {
            worst = worst.max(worst_error(factors, y, end));
        }
    }
    worst
}

#[test]
fn no_visibility_errs_by_more_than_the_bound() {
    println!("                          Chebyshev            SVD");
    for ratio in RATIOS {
        for depth in DEPTHS {
            for rank in 1..=MAX_RANK {
                print!("ratio {ratio:4} depth {depth:4.1} rank {rank}:");
                for &kind in Factorisation::ALL {
                    let factors = Factors::sun(kind, rank, depth, ratio);
                    let worst = worst_of_band(&factors);
                    print!("  {worst:.2e} of {:.2e}", factors.bound());
                    // 3001 pieces are rounded 3001 times, each by some 1e-7/3001 of all: the bound covers 16.
                    assert!(
                        worst <= factors.bound() + 2e-6,
                        "{kind:?} ratio {ratio} depth {depth} rank {rank}: {worst}"
                    );
                }
                println!();
            }
        }
    }
}

proptest! {
    #[test]
    fn unions_of_lit_intervals_err_by_at_most_the_bound(
        ends in proptest::collection::vec(0.0f32..1.0, 2..20),
        end in 0.001f32..1.0,
        y in 0.0f64..1.0,
        depth in 1e-9f64..20.0,
        ratio in 1.01f64..4.0,
        rank in 1usize..=8,
        paper in any::<bool>(),
    ) {
        let mut ends: Vec<f64> = ends.iter().map(|u| f64::from(u * end)).collect();
        ends.sort_by(f64::total_cmp);
        let kind = Factorisation::ALL[usize::from(paper) % Factorisation::ALL.len()];
        let factors = Factors::sun(kind, rank, depth, ratio);
        let y = 1.0 + (ratio - 1.0) * y;
        let vis = |integral: &dyn Fn(f64, f64) -> f64| {
            ends.chunks_exact(2).map(|lit| integral(lit[0], lit[1])).sum::<f64>() / integral(0.0, f64::from(end))
        };
        let error = (vis(&|a, b| factorised(&factors, y, a, b)) - vis(&|a, b| exact(depth, y, a, b))).abs();
        prop_assert!(error <= factors.bound() + 1e-6, "{error} of {}", factors.bound());
    }
}

#[test]
fn an_empty_medium_has_the_length_as_its_only_factor() {
    for depth in [0.0, 1e-300, 1e-30, f64::NAN, -1.0] {
        let factors = Factors::sun(Factorisation::Chebyshev, 3, depth, 1.7);
        let mut values = [0.0; MAX_RANK];
        for u in [0.0, 0.25, 0.333, 1.0] {
            factors.prefix_at(u, &mut values);
            assert!((values[0] - u).abs() <= 6e-8 && values[1].abs() < 1e-12, "{values:?}");
        }
        assert_eq!(factors.lanes(), 4);
        assert_eq!(values[3], 0.0);
    }
}

#[test]
fn a_band_of_one_direction_needs_one_product() {
    assert_eq!(Factors::rank_for(1e-3, 4.0, 1.0), Some(1));
    let factors = Factors::sun(Factorisation::Chebyshev, 1, 4.0, 1.0);
    assert!(worst_error(&factors, 1.0, 1.0) < factors.bound());
}

#[test]
fn the_rank_for_an_error_is_the_smallest_that_keeps_it() {
    for (error, depth, ratio) in [(1e-1, 1.0, 2.0), (1e-2, 20.0, 2.0), (1e-3, 1.0, 1.41)] {
        let rank = Factors::rank_for(error, depth, ratio).unwrap();
        let bound = |rank| Factors::sun(Factorisation::Chebyshev, rank, depth, ratio).bound();
        assert!(bound(rank) <= error && (rank == 1 || bound(rank - 1) > error));
    }
    assert_eq!(Factors::rank_for(1e-9, 1.0, 2.0), None);
}

#[test]
fn the_second_build_allocates_nothing() {
    let mut factors = Factors::sun(Factorisation::Chebyshev, 4, 1.0, 2.0);
    let (prefix, weights) = (factors.prefix().as_ptr(), factors.weights().as_ptr());
    factors.rebuild(Factorisation::Chebyshev, 4, 0.9, 1.9);
    assert_eq!((prefix, weights), (factors.prefix().as_ptr(), factors.weights().as_ptr()));
}
