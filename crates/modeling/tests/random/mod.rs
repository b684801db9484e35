//! Random variational problems, small enough to solve fully beside.

use ondelette_modeling::Axis;
use ondelette_modeling::constraint::{Constraint, Demand};
use ondelette_modeling::energy::Energy;
use ondelette_modeling::system::{Problem, Space};
use ondelette_numerics::seed;
use ondelette_wavelet::Boundary;

/// Random numbers in order.
struct Dice {
    number: u64,
    count: u64,
}

impl Dice {
    fn unit(&mut self) -> f64 {
        self.count += 1;
        seed::unit(seed::combine(self.number, self.count))
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }
}

/// A problem and an energy bound by number: curves and surfaces on all boundaries, 1 to 3 coordinates, positions,
/// derivatives and normals, hard and soft, scattered and clustered; bounds 1e-1 to 1e-4.
pub(crate) fn problem(number: u64) -> (Problem, f64) {
    let mut dice = Dice { number, count: 0 };
    let boundary = |i: usize| [Boundary::Mirrored, Boundary::Periodic, Boundary::Open][i];
    let surface = dice.below(2) == 1;
    let axis = |dice: &mut Dice, least: usize, many: usize| {
        let b = boundary(dice.below(3));
        let spans = (least << dice.below(many)).max(if b == Boundary::Open { 16 } else { 8 });
        Axis::new(b, spans, [0.0, 1.0]).expect("an axis")
    };
    let space = if surface {
        Space::surface(axis(&mut dice, 8, 2), axis(&mut dice, 8, 2))
    } else {
        Space::curve(axis(&mut dice, 8, 5))
    };
    let coordinates = [1, 1, 2, 3][dice.below(4)];
    let energy = match dice.below(6) {
        0 => Energy::new(0.01, 1.0, 0.0),
        1 => Energy::new(0.0, 1.0, 1e-3),
        _ => Ok(Energy::BEND),
    };
    let soft = dice.below(4) == 0;
    let near = dice.below(5) == 0;
    let many = 1 + dice.below(if surface { 40 } else { 15 });
    let bound = 10.0_f64.powf(-1.0 - 3.0 * dice.unit());
    let dimension = space.axes().len();
    let mut rows: Vec<Constraint> = Vec::new();
    for i in 0..many {
        let at: Vec<f64> =
            (0..dimension).map(|_| if near && i > 2 { 0.4 + 0.2 * dice.unit() } else { dice.unit() }).collect();
        let values: Vec<Option<f64>> = (0..coordinates).map(|_| Some(dice.unit() - 0.5)).collect();
        let demand = match (dice.unit() * 12.0) as usize {
            0 if i > 2 => Demand::Derivative(dimension - 1, values),
            1 if i > 2 && coordinates == 3 && dimension == 2 => Demand::Normal(vec![0.3, dice.unit(), 1.0]),
            _ => Demand::Position(values),
        };
        let row = Constraint::new(format!("{i}"), &at, demand);
        rows.push(if soft && dice.unit() < 0.5 { row.soft(1e3) } else { row });
    }
    let energy = energy.expect("weights");
    (Problem::new(space, coordinates, energy, None, rows).expect("a problem"), bound)
}
