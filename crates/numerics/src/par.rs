//! Ordered parallelism: the only user of rayon in the project.
//!
//! Work is split into chunks of a fixed size, outputs are disjoint and results come back in order, so that no result
//! depends on the number of threads.

use rayon::prelude::*;

/// `f` of every index in `0..n`, in order.
///
/// ```
/// assert_eq!(ondelette_numerics::par::map(4, |i| i * i), [0, 1, 4, 9]);
/// ```
pub fn map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..n).into_par_iter().map(f).collect()
}

/// Runs `f(chunk_index, chunk)` over consecutive chunks of `chunk` items; the last may be shorter.
///
/// # Panics
/// If `chunk` is 0.
pub fn for_each_chunk<T: Send>(data: &mut [T], chunk: usize, f: impl Fn(usize, &mut [T]) + Sync) {
    data.par_chunks_mut(chunk).enumerate().for_each(|(i, c)| f(i, c));
}

/// Runs `f` on every task; tasks own what they write, so their order cannot matter.
///
/// ```
/// let mut halves = [1, 2, 3, 4];
/// let tasks: Vec<&mut [i32]> = halves.chunks_mut(2).collect();
/// ondelette_numerics::par::for_each(tasks, |half| half.reverse());
/// assert_eq!(halves, [2, 1, 4, 3]);
/// ```
pub fn for_each<T: Send>(tasks: Vec<T>, f: impl Fn(T) + Sync) {
    tasks.into_par_iter().for_each(&f);
}

/// Runs `f` with exactly `threads` worker threads (0: as many as the machine has).
///
/// # Errors
/// The operating system refused the threads.
pub fn with_threads<R: Send>(threads: usize, f: impl FnOnce() -> R + Send) -> Result<R, String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| e.to_string())?;
    Ok(pool.install(f))
}
