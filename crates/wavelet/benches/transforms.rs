//! Throughput of full pyramids, in process CPU time on one thread (best of several runs), and wall time on two.
//!
//! `cargo bench -p ondelette-wavelet` prints a table; `-- --csv` prints `case,type,msamples_per_cpu_second` lines for
//! `bench/peers/wavelets.py`, which runs PyWavelets on the same cases in the same minute. Further arguments are parts
//! of names of cases to run; `threads` is the comparison of one thread with two.

use std::time::Instant;

use ondelette_numerics::par;
use ondelette_wavelet::{Boundary, Family, Kind, Layout, Pyramid, Scalar, Tensor, Workspace};

/// CPU seconds used by all threads of this process (Linux), or wall seconds since `start` elsewhere.
fn cpu_seconds(start: Instant) -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let of = |dir: std::path::PathBuf| {
        let text = std::fs::read_to_string(dir.join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    let nanoseconds: f64 = tasks.filter_map(|t| of(t.path())).sum();
    if nanoseconds > 0.0 { nanoseconds * 1e-9 } else { start.elapsed().as_secs_f64() }
}

struct Case {
    name: &'static str,
    family: &'static str,
    boundary: Boundary,
    shape: &'static [usize],
}

const CASES: &[Case] = &[
    Case { name: "bspline-periodic-2d", family: "bspline", boundary: Boundary::Periodic, shape: &[4096, 4096] },
    Case { name: "bspline-mirror-2d", family: "bspline", boundary: Boundary::Mirrored, shape: &[4097, 4097] },
    Case { name: "haar-2d", family: "haar", boundary: Boundary::Periodic, shape: &[4096, 4096] },
    Case { name: "d4-2d", family: "d4", boundary: Boundary::Periodic, shape: &[4096, 4096] },
    Case { name: "cdf97-2d", family: "cdf97", boundary: Boundary::Periodic, shape: &[4096, 4096] },
    Case { name: "bspline-periodic-1d", family: "bspline", boundary: Boundary::Periodic, shape: &[1 << 20] },
];

fn data<S: Scalar>(n: usize) -> Vec<S> {
    (0..n).map(|i| S::from_f64(((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / 1e7)).collect()
}

/// Best CPU seconds (one thread) of `runs` transforms up and down.
fn time<S: ondelette_wavelet::Coefficient<Scalar = S> + Scalar>(case: &Case, runs: usize) -> (f64, f64) {
    let family: Family = case.family.parse().expect("a family");
    let axes = case.shape.iter().map(|&n| Pyramid::deepest(family, case.boundary, n).expect("a length that fits"));
    let tensor = Tensor::new(axes.collect(), Layout::NonStandard).expect("equal axes");
    let x: Vec<S> = data(tensor.len());
    let (mut y, mut z) = (x.clone(), x.clone());
    let mut work = Workspace::default();
    par::with_threads(1, || {
        let start = Instant::now();
        let mut best = (f64::INFINITY, f64::INFINITY);
        // The kernel's account of CPU time is as coarse as its tick: repeat until ticks do not show.
        let repeat = (3_usize << 24).div_ceil(tensor.len());
        for _ in 0..runs {
            let t0 = cpu_seconds(start);
            for _ in 0..repeat {
                tensor.up_with(Kind::Coefficients, &x, &mut y, &mut work).expect("finite");
            }
            let t1 = cpu_seconds(start);
            for _ in 0..repeat {
                tensor.down_with(Kind::Coefficients, &y, &mut z, &mut work).expect("finite");
            }
            let t2 = cpu_seconds(start);
            let repeat = repeat as f64;
            best = (best.0.min((t1 - t0) / repeat), best.1.min((t2 - t1) / repeat));
        }
        best
    })
    .expect("one thread")
}

/// Best wall seconds of an analysis of 4096^2 doubles on one thread and on two, in turns.
fn wall() -> [f64; 2] {
    let axis = Pyramid::deepest("bspline".parse().expect("a family"), Boundary::Periodic, 4096).expect("fits");
    let tensor = Tensor::new(vec![axis.clone(), axis], Layout::NonStandard).expect("equal axes");
    let x: Vec<f64> = data(tensor.len());
    let mut y = x.clone();
    let mut work = Workspace::default();
    let mut best = [f64::INFINITY; 2];
    for _ in 0..6 {
        for (threads, best) in [1, 2].into_iter().zip(&mut best) {
            let seconds = par::with_threads(threads, || {
                (0..4).fold(f64::INFINITY, |least, _| {
                    let start = Instant::now();
                    tensor.up_with(Kind::Coefficients, &x, &mut y, &mut work).expect("finite");
                    least.min(start.elapsed().as_secs_f64())
                })
            });
            *best = best.min(seconds.expect("threads"));
        }
    }
    best
}

/// Copy bandwidth in GB/s (read plus write) on `threads` threads.
fn copy_bandwidth(threads: usize) -> f64 {
    let x: Vec<f64> = data(1 << 24);
    let mut y = x.clone();
    par::with_threads(threads, || {
        let best = (0..8)
            .map(|_| {
                let start = Instant::now();
                par::for_each_chunk(&mut y, 1 << 16, |i, to| to.copy_from_slice(&x[i << 16..][..to.len()]));
                start.elapsed().as_secs_f64()
            })
            .fold(f64::INFINITY, f64::min);
        2.0 * 8.0 * x.len() as f64 / best / 1e9
    })
    .expect("threads")
}

fn main() {
    let csv = std::env::args().any(|a| a == "--csv");
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let runs = 7;
    if !csv {
        println!("{:<24}{:>6}{:>14}{:>14}", "case", "type", "up Ms/s", "down Ms/s");
    }
    for case in CASES.iter().filter(|c| wanted.is_empty() || wanted.iter().any(|w| c.name.contains(w.as_str()))) {
        let n = case.shape.iter().product::<usize>() as f64 / 1e6;
        for (kind, (up, down)) in [("f64", time::<f64>(case, runs)), ("f32", time::<f32>(case, runs))] {
            if csv {
                println!("{},{kind},{:.2},{:.2}", case.name, n / up, n / down);
            } else {
                println!("{:<24}{kind:>6}{:>14.0}{:>14.0}", case.name, n / up, n / down);
            }
        }
    }
    if !csv && (wanted.is_empty() || wanted.iter().any(|w| w == "threads")) {
        let [one, two] = wall();
        let n = 4096.0 * 4096.0;
        println!(
            "\n4096^2 f64 periodic, wall: one thread {:.0} Ms/s, two {:.0} Ms/s ({:.2}x)",
            n / one / 1e6,
            n / two / 1e6,
            one / two
        );
        // Every level reads its input and writes as much: 4/3 of 16 bytes a sample.
        println!(
            "moved: {:.1} and {:.1} GB/s; copy bandwidth {:.1} and {:.1} GB/s",
            n * 64.0 / 3.0 / one / 1e9,
            n * 64.0 / 3.0 / two / 1e9,
            copy_bandwidth(1),
            copy_bandwidth(2)
        );
    }
}
