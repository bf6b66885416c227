//! Rung 2 of the ladder for epipolar's in-slice sums: the dual sweep and the plain sum, both equal to a Rust mirror to the bit.

use scatter_gpu::harness::{Bound, HarnessDevice};
use scatter_kernels::in_slice::{DIRECT, InSlice, MODULES, SUMS, answers_mirror};
use scatter_kernels::modules::Module;
use scatter_testing::Random;

/// What a row looks like.
#[derive(Debug, Clone, Copy)]
enum Texels {
    /// Neighbouring runs end near each other.
    Smooth,
    /// All lit or all dark.
    Bars,
    /// Anything.
    Noise,
}

/// A slice of so many runs and columns, a ray a column and some more.
fn push_slice(problem: &mut InSlice, [runs, columns]: [u32; 2], texels: Texels, random: &mut Random) {
    let lit: Vec<u32> = (0..runs)
        .map(|run| match texels {
            Texels::Smooth => ((f64::from(run) * 0.05).sin().abs() * f64::from(columns + 1)) as u32,
            Texels::Bars => columns * (run / 3 % 2),
            Texels::Noise => random.below(columns + 3),
        })
        .collect();
    // Prefixes of up to 2²⁹, of both signs: differences are weights of runs.
    let mut prefix = [0i32; 4];
    let mut prefixes = vec![prefix];
    for _ in 0..runs {
        for (term, value) in prefix.iter_mut().enumerate() {
            let weight = random.below((1 << 29) / runs + 1) as i32;
            *value += if term == 0 { weight } else { weight / 2 - (1 << 27) / runs as i32 };
        }
        prefixes.push(prefix);
    }
    let rays: Vec<_> = (0..columns + columns / 3)
        .map(|ray| {
            let run = random.below(runs);
            let (start, end) = (prefixes[run as usize], prefixes[run as usize + 1]);
            let inside = std::array::from_fn(|term| start[term] + (end[term] - start[term]) / 3);
            (ray % columns, run, inside)
        })
        .collect();
    problem.push(&lit, &prefixes, &rays);
}

fn answers(device: &HarnessDevice, module: &'static Module, problem: &InSlice) -> Vec<[i32; 4]> {
    let blank = vec![0x55u8; 16 * problem.asks.len()];
    let all = [
        (10, Bound::Storage(bytemuck::cast_slice(&problem.tasks))),
        (11, Bound::Storage(bytemuck::cast_slice(&problem.lit_columns))),
        (12, Bound::Storage(bytemuck::cast_slice(&problem.prefixes))),
        (13, Bound::Storage(bytemuck::cast_slice(&problem.asks))),
        (14, Bound::Storage(bytemuck::cast_slice(&problem.chunk_starts))),
        (15, Bound::Storage(&blank)),
    ];
    let is_bound = |number: u32| module.entries[0].bindings.iter().any(|binding| binding.number == number);
    let bound: Vec<_> = all.into_iter().filter(|(number, _)| is_bound(*number)).collect();
    let found = device.run(module, 0, &bound, [problem.tasks.len() as u32, 1, 1]);
    bytemuck::pod_collect_to_vec(found.last().expect("the answers"))
}

fn slices() -> InSlice {
    let (mut problem, mut random) = (InSlice::default(), Random(9));
    for texels in [Texels::Smooth, Texels::Bars, Texels::Noise] {
        for size in [[1, 1], [2, 63], [127, 64], [128, 65], [129, 640], [257, 641], [1000, 127], [700, 1500]]
        {
            push_slice(&mut problem, size, texels, &mut random);
        }
    }
    problem
}

#[test]
fn the_sweep_and_the_plain_sum_are_the_mirrors_to_the_bit() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let problem = slices();
    let expected = answers_mirror(&problem);
    println!(
        "{} tasks, {} runs, {} asks, {} bytes, at most {} atomics",
        problem.tasks.len(),
        problem.lit_columns.len(),
        problem.asks.len(),
        problem.bytes(),
        problem.atomics()
    );
    for module in MODULES {
        let found = answers(&device, module, &problem);
        let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
        println!("{}: {differing} of {} answers differ", module.name, found.len());
        assert_eq!((differing, found.len()), (0, expected.len()), "{}", module.name);
    }
}

/// All lit: exactly the ray's own prefix. All dark: exactly 0.
#[test]
fn a_ray_in_full_light_gets_its_own_prefix_and_one_in_the_dark_nothing() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let mut problem = InSlice::default();
    let prefixes: Vec<_> = (0..301).map(|run| [run * 1_000_003, -run, run * run, 7 * run]).collect();
    let rays: Vec<_> = (0..300u32).map(|n| (n % 65, n, prefixes[n as usize + 1])).collect();
    problem.push(&[65; 300], &prefixes, &rays);
    problem.push(&[0; 300], &prefixes, &rays);
    let found = answers(&device, &SUMS_STATIC, &problem);
    for (ray, &(_, _, end)) in rays.iter().enumerate() {
        assert_eq!((found[ray], found[300 + ray]), (end, [0; 4]), "{ray}");
    }
}

static SUMS_STATIC: Module = SUMS;

/// A chunk off by one, and columns compared the wrong way.
#[test]
fn mutants_of_the_sweep_are_seen() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let problem = slices();
    let expected = answers_mirror(&problem);
    for (name, module, old, new) in [
        ("sums, a chunk off by one", &SUMS, "j < inside", "j <= inside"),
        ("sums, the column itself", &SUMS, "let first = rank + 1u;", "let first = rank;"),
        ("direct, the run of the end twice", &DIRECT, "run < end_run", "run <= end_run"),
    ] {
        let text = module.assemble();
        assert!(text.contains(old), "{old}");
        let files: &'static [&'static str] =
            Box::leak(Box::new([&*Box::leak(text.replace(old, new).into_boxed_str())]));
        let mutant: &'static Module = Box::leak(Box::new(Module { name, files, entries: module.entries }));
        assert_ne!(answers(&device, mutant, &problem), expected, "{name} is not seen");
    }
}
