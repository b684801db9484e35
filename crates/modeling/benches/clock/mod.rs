//! CPU time of this thread, which other programs on the machine do not lengthen.

use std::time::Instant;

/// Seconds of CPU time so far (Linux), else of wall time since `origin`.
fn now(origin: Instant) -> f64 {
    let read = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = read.as_deref().and_then(|s| s.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| origin.elapsed().as_secs_f64(), |n| n * 1e-9)
}

/// The median of several runs, in seconds. The clock may tick in milliseconds: short work is repeated within a run.
pub(crate) fn median(runs: usize, mut f: impl FnMut()) -> f64 {
    let origin = Instant::now();
    f();
    let once = origin.elapsed().as_secs_f64().max(1e-7);
    let repeats = (0.08 / once).clamp(1.0, 5000.0) as usize;
    let runs = if repeats > 1 { runs.clamp(1, 3) } else { runs.max(1) };
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let from = now(origin);
            (0..repeats).for_each(|_| f());
            (now(origin) - from) / repeats as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
