//! How long the built-in Cornell box takes: `cargo bench -p ondelette-io --bench light`.
//!
//! One line a basis and tolerance: median wall seconds of three runs, links, elements and rays. Counts are the same on
//! every machine; seconds are not.

use ondelette_io::builtin;
use ondelette_radiosity::{Settings, Solver};
use std::time::Instant;

fn main() {
    println!("{:>6} {:>8} {:>9} {:>9} {:>9} {:>11}", "basis", "error", "seconds", "links", "elements", "rays");
    for (basis, error) in [("haar", 0.05), ("m2", 0.05), ("m2", 0.03), ("m2", 0.01), ("m3", 0.03), ("m3", 0.01)] {
        let settings =
            Settings { basis: basis.parse().expect("a basis of the list above"), error, ..Settings::default() };
        let mut seconds = Vec::new();
        let mut counts = (0, 0, 0);
        for _ in 0..3 {
            let start = Instant::now();
            let scene = builtin::cornell().expect("the built-in scene is valid");
            let mut solver = Solver::new(scene, settings).expect("the built-in scene has a lamp");
            while solver.step().is_some() {}
            let solution = solver.into_solution();
            seconds.push(start.elapsed().as_secs_f64());
            counts = (solution.links().len(), solution.forest().leaves(), solution.statistics().rays);
        }
        seconds.sort_by(f64::total_cmp);
        let (links, elements, rays) = counts;
        println!("{basis:>6} {:>6} % {:>9.2} {links:>9} {elements:>9} {rays:>11}", 100.0 * error, seconds[1]);
    }
}
