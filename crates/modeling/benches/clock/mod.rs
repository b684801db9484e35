//! CPU time of this thread, which other programs on the machine do not lengthen.

use std::time::Instant;

/// Seconds of CPU time so far (to a microsecond; the scheduler's own statistics tick in milliseconds), where the system
/// counts them, else of wall time since `origin`.
#[cfg(unix)]
fn now(_origin: Instant) -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn now(origin: Instant) -> f64 {
    origin.elapsed().as_secs_f64()
}

/// The median of batches of runs, in seconds a run: at least `least` batches of one run each, more runs a batch where
/// these are short, so that a figure stands for about `work` seconds.
pub(crate) fn median(work: f64, least: usize, mut f: impl FnMut()) -> f64 {
    let origin = Instant::now();
    f();
    let from = now(origin);
    f();
    let once = (now(origin) - from).max(1e-7);
    let batches = least.max(5);
    let runs = (work / once / batches as f64).clamp(1.0, 1e6) as usize;
    let batches = if once > 1.0 { 1 } else { batches };
    let mut times: Vec<f64> = (0..batches)
        .map(|_| {
            let from = now(origin);
            (0..runs).for_each(|_| f());
            (now(origin) - from) / runs as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
