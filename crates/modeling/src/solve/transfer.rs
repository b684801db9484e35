//! Exact refinement of a spline onto half spans, and its transpose, on grids.

use crate::axis::Axis;
use crate::system::Space;
use ondelette_wavelet::Boundary;

/// Refinement of one axis: fine coefficients from coarse ones.
#[derive(Clone, Debug)]
pub(crate) struct Refine {
    pub(crate) coarse: usize,
    pub(crate) fine: usize,
    pub(crate) rows: Vec<Vec<(usize, f64)>>,
    /// Coarse coefficients `lo .. hi` whose five fine ones, from `2 i - shift`, have the plain factors 1 4 6 4 1 / 8.
    lo: usize,
    hi: usize,
    shift: usize,
    /// Entries `(fine, coarse, factor)` of the other columns.
    edges: Vec<(usize, usize, f64)>,
}

impl Refine {
    /// From `spans` spans to twice as many.
    pub(crate) fn new(boundary: Boundary, spans: usize) -> Refine {
        let rows = rows(boundary, spans);
        let fine = rows.len();
        let coarse = match boundary {
            Boundary::Open => spans + 3,
            Boundary::Mirrored => spans + 1,
            Boundary::Periodic => spans,
        };
        let mut columns = vec![Vec::new(); coarse];
        for (r, row) in rows.iter().enumerate() {
            row.iter().for_each(|&(c, v)| columns[c].push((r, v)));
        }
        // Open function i has its centre at knot i - 1: fine number 2 (i - 1) + 1 = 2 i - 1.
        let shift = if boundary == Boundary::Open { 3 } else { 2 };
        let plain = |i: usize| {
            2 * i >= shift
                && columns[i].len() == 5
                && columns[i]
                    .iter()
                    .zip([1.0, 4.0, 6.0, 4.0, 1.0])
                    .enumerate()
                    .all(|(k, (e, f))| e.0 == 2 * i - shift + k && e.1 == f / 8.0)
        };
        let middle = coarse / 2;
        let (mut lo, mut hi) = (middle, middle);
        if plain(middle) {
            hi += 1;
            while lo > 0 && plain(lo - 1) {
                lo -= 1;
            }
            while hi < coarse && plain(hi) {
                hi += 1;
            }
        }
        let edges = columns
            .iter()
            .enumerate()
            .filter(|(c, _)| !(lo..hi).contains(c))
            .flat_map(|(c, col)| col.iter().map(move |&(r, v)| (r, c, v)))
            .collect();
        Refine { coarse, fine, rows, lo, hi, shift, edges }
    }

    /// An axis that stays as it is.
    fn identity(n: usize) -> Refine {
        let rows = (0..n).map(|i| vec![(i, 1.0)]).collect();
        Refine { coarse: n, fine: n, rows, lo: 0, hi: 0, shift: 0, edges: (0..n).map(|i| (i, i, 1.0)).collect() }
    }

    /// `y = R x` along rows.
    fn along(&self, x: &[f64], y: &mut [f64]) {
        for (x, y) in x.chunks_exact(self.coarse).zip(y.chunks_exact_mut(self.fine)) {
            y.fill(0.0);
            if self.lo < self.hi {
                // Between whole coarse neighbours each fine value is a short sum; the ends of the run get their parts.
                let x = &x[self.lo..self.hi];
                let y = &mut y[2 * self.lo - self.shift..][..2 * x.len() + 3];
                let n = x.len();
                for (k, f) in [0.125, 0.5, 0.75, 0.5, 0.125].into_iter().enumerate() {
                    y[k] += f * x[0];
                    if n > 1 {
                        y[2 * (n - 1) + k] += f * x[n - 1];
                    }
                }
                if n > 2 {
                    // add the columns 1 .. n - 1, pairwise
                    for i in 1..n - 1 {
                        let v = x[i];
                        let y = &mut y[2 * i..2 * i + 5];
                        y[0] += 0.125 * v;
                        y[1] += 0.5 * v;
                        y[2] += 0.75 * v;
                        y[3] += 0.5 * v;
                        y[4] += 0.125 * v;
                    }
                }
            }
            for &(r, c, v) in &self.edges {
                y[r] += v * x[c];
            }
        }
    }

    /// `x = R^T y` along rows.
    fn along_transposed(&self, y: &[f64], x: &mut [f64]) {
        for (x, y) in x.chunks_exact_mut(self.coarse).zip(y.chunks_exact(self.fine)) {
            x.fill(0.0);
            if self.lo < self.hi {
                let y = &y[2 * self.lo - self.shift..];
                for (x, y) in x[self.lo..self.hi].iter_mut().zip(y.windows(5).step_by(2)) {
                    *x = 0.125 * (y[0] + y[4]) + 0.5 * (y[1] + y[3]) + 0.75 * y[2];
                }
            }
            for &(r, c, v) in &self.edges {
                x[c] += v * y[r];
            }
        }
    }

    /// `y = R x` along the first axis of a grid with rows of `width`.
    fn across(&self, x: &[f64], y: &mut [f64], width: usize) {
        for (y, row) in y.chunks_exact_mut(width).zip(&self.rows) {
            combine(row, x, width, y);
        }
    }

    /// `x = R^T y` along the first axis.
    fn across_transposed(&self, y: &[f64], x: &mut [f64], width: usize) {
        for (c, x) in x.chunks_exact_mut(width).enumerate() {
            if (self.lo..self.hi).contains(&c) {
                let from = (2 * c - self.shift) * width;
                let row = |k: usize| &y[from + k * width..][..width];
                let (a, b, c, d, e) = (row(0), row(1), row(2), row(3), row(4));
                for i in 0..width {
                    x[i] = 0.125 * (a[i] + e[i]) + 0.5 * (b[i] + d[i]) + 0.75 * c[i];
                }
            } else {
                x.fill(0.0);
            }
        }
        for &(r, c, v) in &self.edges {
            let from = &y[r * width..][..width];
            x[c * width..][..width].iter_mut().zip(from).for_each(|(x, y)| *x += v * y);
        }
    }
}

/// `y = sum v * row c of x`.
fn combine(row: &[(usize, f64)], x: &[f64], width: usize, y: &mut [f64]) {
    let at = |c: usize| &x[c * width..][..width];
    match *row {
        [(a, u), (b, v)] => {
            let (p, q) = (at(a), at(b));
            for i in 0..width {
                y[i] = u * p[i] + v * q[i];
            }
        }
        [(a, u), (b, v), (c, w)] => {
            let (p, q, r) = (at(a), at(b), at(c));
            for i in 0..width {
                y[i] = u * p[i] + v * q[i] + w * r[i];
            }
        }
        _ => {
            y.fill(0.0);
            for (c, v) in row {
                y.iter_mut().zip(at(*c)).for_each(|(y, x)| *y += v * x);
            }
        }
    }
}

fn rows(boundary: Boundary, spans: usize) -> Vec<Vec<(usize, f64)>> {
    let n = spans as isize;
    let fold = |i: isize| match boundary {
        Boundary::Periodic => i.rem_euclid(n) as usize,
        _ => {
            let i = i.rem_euclid(2 * n);
            i.min(2 * n - i) as usize
        }
    };
    let merge = |row: Vec<(usize, f64)>| {
        let mut out: Vec<(usize, f64)> = Vec::new();
        for (c, v) in row {
            match out.iter_mut().find(|e| e.0 == c) {
                Some(e) => e.1 += v,
                None => out.push((c, v)),
            }
        }
        out.sort_by_key(|e| e.0);
        out
    };
    match boundary {
        Boundary::Open if spans <= 8 => inserted(spans),
        Boundary::Open => {
            let small = inserted(8);
            let fine = 2 * spans + 3;
            (0..fine)
                .map(|r| {
                    if r < 8 {
                        small[r].clone()
                    } else if r + 8 >= fine {
                        small[r + 19 - fine].iter().map(|&(c, v)| (c + spans - 8, v)).collect()
                    } else if r % 2 == 1 {
                        let c = r.div_ceil(2);
                        vec![(c - 1, 0.125), (c, 0.75), (c + 1, 0.125)]
                    } else {
                        vec![(r / 2, 0.5), (r / 2 + 1, 0.5)]
                    }
                })
                .collect()
        }
        _ => {
            let count = if boundary == Boundary::Periodic { 2 * n } else { 2 * n + 1 };
            (0..count)
                .map(|r| {
                    let c = r / 2;
                    merge(if r % 2 == 0 {
                        vec![(fold(c - 1), 0.125), (fold(c), 0.75), (fold(c + 1), 0.125)]
                    } else {
                        vec![(fold(c), 0.5), (fold(c + 1), 0.5)]
                    })
                })
                .collect()
        }
    }
}

/// Open refinement by inserting the middle of every span (Boehm).
fn inserted(spans: usize) -> Vec<Vec<(usize, f64)>> {
    let mut knots: Vec<f64> = (-3..=spans as isize + 3).map(|i| i.clamp(0, spans as isize) as f64).collect();
    let n = spans + 3;
    let mut points: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for span in 0..spans {
        let u = span as f64 + 0.5;
        let Some(k) = knots.iter().rposition(|t| *t <= u) else { continue };
        let mut new = Vec::with_capacity(points.len() + 1);
        for i in 0..=points.len() {
            if i + 3 <= k {
                new.push(points[i].clone());
            } else if i > k {
                new.push(points[i - 1].clone());
            } else {
                let a = (u - knots[i]) / (knots[i + 3] - knots[i]);
                new.push(points[i].iter().zip(&points[i - 1]).map(|(p, q)| a * p + (1.0 - a) * q).collect());
            }
        }
        points = new;
        knots.insert(k + 1, u);
    }
    points.into_iter().map(|row| row.into_iter().enumerate().filter(|e| e.1 != 0.0).collect()).collect()
}

/// Refinement of a space, axis by axis.
#[derive(Clone, Debug)]
pub(crate) struct Transfer {
    axes: Vec<Refine>,
}

impl Transfer {
    /// From a space to the one on twice as many spans.
    pub(crate) fn new(coarse: &Space) -> Transfer {
        Transfer { axes: coarse.axes().iter().map(|a| Refine::new(a.boundary(), a.spans())).collect() }
    }

    /// From a space to one that has twice as many spans on an axis, or as many.
    pub(crate) fn between(coarse: &Space, fine: &Space) -> Transfer {
        let axis = |(c, f): (&Axis, &Axis)| match c.spans() == f.spans() {
            true => Refine::identity(c.len()),
            false => Refine::new(c.boundary(), c.spans()),
        };
        Transfer { axes: coarse.axes().iter().zip(fine.axes()).map(axis).collect() }
    }

    /// `fine = R coarse`.
    pub(crate) fn refine(&self, coarse: &[f64], fine: &mut [f64], work: &mut Vec<f64>) {
        match &self.axes[..] {
            [s, t] => {
                work.resize(s.coarse * t.fine, 0.0);
                t.along(coarse, work);
                s.across(work, fine, t.fine);
            }
            [t] => t.along(coarse, fine),
            _ => {}
        }
    }

    /// `coarse = R^T fine`.
    pub(crate) fn restrict(&self, fine: &[f64], coarse: &mut [f64], work: &mut Vec<f64>) {
        match &self.axes[..] {
            [s, t] => {
                work.resize(s.coarse * t.fine, 0.0);
                s.across_transposed(fine, work, t.fine);
                t.along_transposed(work, coarse);
            }
            [t] => t.along_transposed(fine, coarse),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refined_coefficients_are_the_same_function_and_restriction_is_the_transpose() {
        for (boundary, least) in [(Boundary::Open, 1), (Boundary::Mirrored, 1), (Boundary::Periodic, 4)] {
            for spans in (least..12).chain([32]) {
                let axis = |n: usize| Axis::new(boundary, n, [0.0, 1.0]).unwrap();
                let t = Transfer::new(&Space::curve(axis(spans)));
                let (a, b) = (axis(spans), axis(2 * spans));
                let x: Vec<f64> = (0..a.len()).map(|i| ((i * i) as f64).sin()).collect();
                let mut y = vec![0.0; b.len()];
                t.refine(&x, &mut y, &mut Vec::new());
                for k in 0..=50 {
                    let p = k as f64 / 50.0;
                    let d = crate::basis::taps(&a, p, 0).apply(&x) - crate::basis::taps(&b, p, 0).apply(&y);
                    assert!(d.abs() < 1e-14, "{boundary:?} {spans} at {p}: {d}");
                }
                let r: Vec<f64> = (0..b.len()).map(|i| (i as f64).cos()).collect();
                let mut back = vec![0.0; a.len()];
                t.restrict(&r, &mut back, &mut Vec::new());
                let u: f64 = r.iter().zip(&y).map(|(a, b)| a * b).sum();
                let v: f64 = back.iter().zip(&x).map(|(a, b)| a * b).sum();
                assert!((u - v).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_grid_refined_along_one_axis_is_the_same_surface() {
        let axis = |n: usize| Axis::new(Boundary::Open, n, [0.0, 1.0]).unwrap();
        let coarse = Space::surface(axis(4), axis(9));
        for fine in [Space::surface(axis(8), axis(9)), Space::surface(axis(4), axis(18))] {
            let transfer = Transfer::between(&coarse, &fine);
            let x: Vec<f64> = (0..coarse.len()).map(|i| ((i * i) as f64).sin()).collect();
            let mut y = vec![0.0; fine.len()];
            transfer.refine(&x, &mut y, &mut Vec::new());
            let value = |space: &Space, x: &[f64], at: [f64; 2]| -> f64 {
                let [s, t] = space.axes() else { return f64::NAN };
                let along = crate::basis::taps(t, at[1], 0);
                let row = |i: usize| along.apply(&x[i * t.len()..][..t.len()]);
                crate::basis::taps(s, at[0], 0).iter().map(|(i, v)| v * row(i)).sum()
            };
            for k in 0..=30 {
                let at = [k as f64 / 30.0, (7 * k % 31) as f64 / 30.0];
                assert!((value(&coarse, &x, at) - value(&fine, &y, at)).abs() < 1e-14);
            }
            let r: Vec<f64> = (0..fine.len()).map(|i| (i as f64).cos()).collect();
            let mut back = vec![0.0; coarse.len()];
            transfer.restrict(&r, &mut back, &mut Vec::new());
            let u: f64 = r.iter().zip(&y).map(|(a, b)| a * b).sum();
            let v: f64 = back.iter().zip(&x).map(|(a, b)| a * b).sum();
            assert!((u - v).abs() < 1e-12);
        }
    }

    #[test]
    fn grids_refine_by_both_axes() {
        let s = Axis::new(Boundary::Open, 4, [0.0, 1.0]).unwrap();
        let t = Axis::new(Boundary::Periodic, 6, [0.0, 1.0]).unwrap();
        let transfer = Transfer::new(&Space::surface(s, t));
        let (p, q) = (Refine::new(Boundary::Open, 4), Refine::new(Boundary::Periodic, 6));
        let x: Vec<f64> = (0..42).map(|i| f64::from(i * i % 13)).collect();
        let mut y = vec![0.0; p.fine * q.fine];
        transfer.refine(&x, &mut y, &mut Vec::new());
        for i in 0..p.fine {
            for j in 0..q.fine {
                let x = &x;
                let want: f64 =
                    p.rows[i].iter().flat_map(|a| q.rows[j].iter().map(move |b| a.1 * b.1 * x[a.0 * 6 + b.0])).sum();
                assert!((y[i * q.fine + j] - want).abs() < 1e-12);
            }
        }
    }
}
