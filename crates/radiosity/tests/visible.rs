//! Exact visibility against rays, closed forms and blocked configurations with known answers.

use glam::DVec3;
use ondelette_numerics::{gauss, seed};
use ondelette_radiosity::kernel::density;
use ondelette_radiosity::visible::{View, irradiance_from, visible_parts};

const TOLERANCE: f64 = 1e-9;

/// Numbers in [0, 1), one after the other.
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 += 1;
        seed::unit(self.0)
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next() - 0.5, self.next() - 0.5, self.next() - 0.5)
    }
}

fn square(half: f64, z: f64) -> [DVec3; 4] {
    [[half, half], [half, -half], [-half, -half], [-half, half]].map(|[x, y]| DVec3::new(x, y, z))
}

fn normal(corners: &[DVec3]) -> DVec3 {
    (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize()
}

/// Whether the open segment from a to b crosses a convex polygon.
fn crosses(a: DVec3, b: DVec3, corners: &[DVec3]) -> bool {
    let n = normal(corners);
    let (ha, hb) = (n.dot(a - corners[0]), n.dot(b - corners[0]));
    if (ha > 0.0) == (hb > 0.0) {
        return false;
    }
    let p = a + (b - a) * (ha / (ha - hb));
    let k = corners.len();
    (0..k).all(|i| n.dot((corners[(i + 1) % k] - corners[i]).cross(p - corners[i])) >= 0.0)
}

/// Irradiance by brute force: a fine midpoint rule over the source, a ray to each point.
fn by_rays(x: DVec3, n: DVec3, source: &[DVec3], blockers: &[Vec<DVec3>], steps: usize) -> f64 {
    let (m, o) = (normal(source), source[0]);
    let mut sum = 0.0;
    for t in 1..source.len() - 1 {
        let (u, v) = (source[t] - o, source[t + 1] - o);
        let cell = 0.5 * u.cross(v).length() / (steps * steps) as f64;
        for i in 0..steps {
            for j in 0..steps - i {
                // the upright cell, and the inverted one beside it
                for (shift, there) in [(1.0 / 3.0, true), (2.0 / 3.0, i + j + 1 < steps)] {
                    let y = o + u * ((i as f64 + shift) / steps as f64) + v * ((j as f64 + shift) / steps as f64);
                    if there && !blockers.iter().any(|b| crosses(x, y, b)) {
                        sum += cell * density(x, n, y, m);
                    }
                }
            }
        }
    }
    sum
}

fn parallelogram(draw: &mut Draw, size: f64) -> Vec<DVec3> {
    let (o, u, v) = (draw.vector(), draw.vector() * size, draw.vector() * size);
    if draw.next() < 0.5 { vec![o, o + u, o + u + v, o + v] } else { vec![o, o + u, o + v] }
}

#[test]
fn any_blockers_in_any_position_agree_with_rays() {
    let mut draw = Draw(17);
    let (mut seen, mut dark, mut partial) = (0, 0, 0);
    for case in 0..360 {
        let source = parallelogram(&mut draw, 1.5);
        let x = draw.vector() * 1.4;
        let n = draw.vector().normalize();
        let blockers: Vec<Vec<DVec3>> = (0..case % 6).map(|_| parallelogram(&mut draw, 1.2)).collect();
        let views: Vec<&[DVec3]> = blockers.iter().map(Vec::as_slice).collect();
        let exact = irradiance_from(x, n, &source, &views, TOLERANCE);
        let free = irradiance_from(x, n, &source, &[], TOLERANCE);
        let rays = by_rays(x, n, &source, &blockers, 120);
        // the rule errs by the cells that a shadow edge crosses
        let allowed = 3e-3 * free.max(rays) + 2e-5;
        assert!((exact - rays).abs() <= allowed * (1.0 + blockers.len() as f64), "case {case}: {exact}, rays {rays}");
        seen += usize::from(exact > 1e-3);
        dark += usize::from(exact == 0.0 && free > 0.0);
        partial += usize::from(exact > 0.0 && exact < 0.999 * free);
    }
    assert!(seen > 50 && dark > 2 && partial > 20, "{seen} {dark} {partial}: the cases test nothing");
}

#[test]
fn parts_are_disjoint_pieces_of_the_source() {
    let source = square(0.5, 1.0);
    let blockers: [Vec<DVec3>; 3] = [0.3, 0.5, 0.7].map(|z| square(0.15, z).map(|c| c + DVec3::X * (z - 0.5)).to_vec());
    let views: Vec<&[DVec3]> = blockers.iter().map(Vec::as_slice).collect();
    let x = DVec3::new(0.05, 0.02, 0.0);
    let parts = visible_parts(x, DVec3::Z, &source, &views, TOLERANCE);
    let area = |c: &[DVec3]| (1..c.len() - 1).map(|i| 0.5 * (c[i] - c[0]).cross(c[i + 1] - c[0]).z.abs()).sum::<f64>();
    let whole: f64 = parts.iter().map(|p| area(p)).sum();
    assert!(parts.iter().flatten().all(|p| (p.z - 1.0).abs() < 1e-12 && p.x.abs().max(p.y.abs()) < 0.5 + 1e-12));
    let steps = 800;
    let open = (0..steps * steps).filter(|k| {
        let at = |i: usize| (i as f64 + 0.5) / steps as f64 - 0.5;
        let y = DVec3::new(at(k % steps), at(k / steps), 1.0);
        !blockers.iter().any(|b| crosses(x, y, b))
    });
    let counted = open.count() as f64 / (steps * steps) as f64;
    assert!((whole - counted).abs() < 2e-3 && whole < 0.9, "{whole} {counted}");
}

/// Two parallel unit squares at distance 1 with an opaque square of side a midway: pointwise closed forms, integrated
/// over the receiver by a rule of its own.
#[test]
fn a_square_between_two_squares_takes_what_it_should() {
    for (side, want) in [(0.25, 0.169474204911786), (0.5, 0.0995062945989849)] {
        let (source, blocker) = (square(0.5, 1.0), square(0.5 * side, 0.5));
        let mut view = View::new(TOLERANCE);
        let (points, weights) = gauss::square_rule(64);
        let mut sum = 0.0;
        for ([s, t], w) in points.iter().zip(&weights) {
            view.aim(DVec3::new(s - 0.5, t - 0.5, 0.0), DVec3::Z, &source);
            view.block(&blocker);
            sum += w * view.irradiance();
        }
        assert!(f64::abs(sum - want) < 2e-5, "{sum} instead of {want}");
    }
}

#[test]
fn walls_that_meet_let_exactly_nothing_through() {
    // a wall of four pieces with T-junctions, standing on the receiver's plane and reaching the source's
    let wall = |y: [f64; 2], z: [f64; 2]| {
        vec![
            DVec3::new(0.5, y[0], z[0]),
            DVec3::new(0.5, y[1], z[0]),
            DVec3::new(0.5, y[1], z[1]),
            DVec3::new(0.5, y[0], z[1]),
        ]
    };
    let third = 1.0 / 3.0;
    let pieces = [
        wall([-9.0, third], [0.0, 0.7]),
        wall([third, 9.0], [0.0, 0.1 + 0.2]),
        wall([third, 9.0], [0.3, 0.7]),
        wall([-9.0, 9.0], [0.7, 1.0]),
    ];
    let views: Vec<&[DVec3]> = pieces.iter().map(Vec::as_slice).collect();
    let mut draw = Draw(5);
    for _ in 0..1000 {
        let x = DVec3::new(0.5 * draw.next() - 1e-3, draw.next(), 0.0);
        // on the ceiling behind the wall, touching it; and a lamp on the far wall from floor to ceiling
        let ceiling = [[0.5, 1.0], [2.0, 1.0], [2.0, 0.0], [0.5, 0.0]].map(|[x, y]| DVec3::new(x, y, 1.0));
        let far = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]].map(|[y, z]| DVec3::new(2.0, 1.0 - y, z));
        for source in [&ceiling, &far] {
            let open = irradiance_from(x, DVec3::Z, source, &[], 1e-7);
            assert!(open > 0.0);
            assert_eq!(irradiance_from(x, DVec3::Z, source, &views, 1e-7), 0.0, "{x}");
        }
    }
}

#[test]
fn what_touches_the_point_or_the_source_hides_nothing() {
    let source = square(0.5, 1.0);
    let free = irradiance_from(DVec3::ZERO, DVec3::Z, &source, &[], TOLERANCE);
    let idle = [
        square(3.0, 0.0),   // the receiver's own plane
        square(3.0, 1.0),   // the source's own plane
        square(3.0, 2.0),   // behind the source
        square(3.0, -1.0),  // behind the point
        square(3.0, 1e-13), // the receiver's plane, but for rounding
    ];
    for blocker in &idle {
        assert_eq!(irradiance_from(DVec3::ZERO, DVec3::Z, &source, &[blocker], TOLERANCE), free);
    }
    // a wall seen edge-on, through the point
    let edge = [[-1.0, 0.0], [1.0, 0.0], [1.0, 0.5], [-1.0, 0.5]].map(|[x, z]| DVec3::new(x, 0.0, z));
    let e = irradiance_from(DVec3::ZERO, DVec3::Z, &source, &[&edge], TOLERANCE);
    assert_eq!(e, free);
    // a lamp seen from behind, or in the point's plane
    assert_eq!(irradiance_from(DVec3::Z * 2.0, -DVec3::Z, &source, &[], TOLERANCE), 0.0);
    assert_eq!(irradiance_from(DVec3::Z, DVec3::Z, &source, &[], TOLERANCE), 0.0);
}

#[test]
fn a_panel_on_a_lamp_covers_it() {
    let source = square(0.5, 1.0);
    let mut view = View::new(TOLERANCE);
    let corner = [[0.0, 0.0], [0.0, 0.5], [0.5, 0.5], [0.5, 0.0]].map(|[x, y]| DVec3::new(x, y, 1.0));
    assert!(view.aim(DVec3::ZERO, DVec3::Z, &source));
    let whole = view.irradiance();
    view.cover(&corner);
    assert!((view.irradiance() - 0.75 * whole).abs() < 1e-8);
}

/// Six hundred confetti in the way: more pieces than are kept, so the late ones are sampled, near the truth and always
/// the same.
#[test]
fn too_many_blockers_are_sampled_in_a_fixed_way() {
    let mut draw = Draw(99);
    let source = square(0.5, 1.0);
    let blockers: Vec<Vec<DVec3>> = (0..600)
        .map(|_| {
            let o = DVec3::new(draw.next() - 0.5, draw.next() - 0.5, 0.4 + 0.2 * draw.next());
            vec![o, o + DVec3::X * 0.015, o + DVec3::Y * 0.015]
        })
        .collect();
    let mut view = View::new(TOLERANCE);
    let x = DVec3::new(0.1, 0.05, 0.0);
    let look = |view: &mut View| {
        view.aim(x, DVec3::Z, &source);
        blockers.iter().for_each(|b| view.block(b));
        view.irradiance()
    };
    let first = look(&mut view);
    assert!(!view.is_exact() && view.len() > View::MOST_PIECES);
    assert_eq!(first.to_bits(), look(&mut view).to_bits());
    let rays = by_rays(x, DVec3::Z, &source, &blockers, 500);
    let free = irradiance_from(x, DVec3::Z, &source, &[], TOLERANCE);
    assert!((first - rays).abs() < 0.02 * rays && rays < 0.95 * free, "{first}, rays {rays}, free {free}");
}

#[test]
fn results_do_not_depend_on_the_unit_of_length() {
    let mut draw = Draw(7);
    for _ in 0..50 {
        let (source, blocker) = (parallelogram(&mut draw, 1.5), parallelogram(&mut draw, 1.2));
        let (x, n) = (draw.vector() * 1.4, draw.vector().normalize());
        let at = |k: f64| {
            let scaled = |c: &[DVec3]| c.iter().map(|p| *p * k).collect::<Vec<_>>();
            irradiance_from(x * k, n, &scaled(&source), &[&scaled(&blocker)], TOLERANCE * k)
        };
        assert!((at(1.0) - at(1e3)).abs() < 1e-12 && (at(1.0) - at(1e-3)).abs() < 1e-12);
    }
}
