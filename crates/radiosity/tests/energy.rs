//! What a closed box must satisfy whatever its light: integral of B = integral of M / (1 - rho).

use ondelette_radiosity::scene::samples;
use ondelette_radiosity::{Basis, Settings, Solver};

#[test]
fn unequal_emission_in_a_closed_box_keeps_the_energy_identity() {
    for (name, error) in [("haar", 0.05), ("m2", 0.01), ("m3", 0.01), ("f2", 0.05)] {
        let basis: Basis = name.parse().unwrap();
        let rho = 0.7;
        let scene = samples::cube(rho, [3.0, 0.0, 0.5, 0.0, 0.0, 1.0]);
        let mut solver = Solver::new(scene, Settings { basis, error }).unwrap();
        while solver.step().is_some() {}
        let solution = solver.solution();
        let reflected: f64 = (0..6).map(|s| rho * solution.mean_irradiance(s).0[0]).sum();
        let (radiosity, want) = (reflected + 4.5, 4.5 / (1.0 - rho));
        println!("{name} {radiosity} {want} links {}", solution.links().len());
        assert!((radiosity / want - 1.0).abs() < 0.005, "{name}: {radiosity} instead of {want}");
    }
}
