//! Banded operators of one axis: the same taps in every interior row, lists of entries in the others.

/// A sparse matrix whose interior rows are shifts of one another.
#[derive(Clone, Debug)]
pub(crate) struct Stencil {
    pub(crate) rows: usize,
    pub(crate) cols: usize,
    /// Interior rows `lo..hi`: row `r` has `taps[k]` in column `r + first + k`.
    lo: usize,
    hi: usize,
    first: isize,
    taps: Vec<f64>,
    edges: Vec<(usize, Vec<(usize, f64)>)>,
}

impl Stencil {
    /// Finds the interior of a matrix given by its rows.
    pub(crate) fn new(cols: usize, rows: Vec<Vec<(usize, f64)>>) -> Stencil {
        let n = rows.len();
        let rows: Vec<Vec<(usize, f64)>> = rows.into_iter().map(compact).collect();
        let middle = n / 2;
        let like = |r: usize| {
            let (a, b) = (&rows[r], &rows[middle]);
            a.len() == b.len() && a.iter().zip(b).all(|(x, y)| x.1 == y.1 && x.0 + middle == y.0 + r)
        };
        let contiguous = rows[middle].windows(2).all(|w| w[1].0 == w[0].0 + 1);
        let (mut lo, mut hi) = (middle, middle);
        if contiguous && !rows[middle].is_empty() {
            hi = middle + 1;
            while lo > 0 && like(lo - 1) {
                lo -= 1;
            }
            while hi < n && like(hi) {
                hi += 1;
            }
        }
        let first = rows[middle].first().map_or(0, |e| e.0 as isize - middle as isize);
        let taps = rows[middle].iter().map(|e| e.1).collect();
        let edges = rows.into_iter().enumerate().filter(|(r, _)| !(lo..hi).contains(r)).collect();
        Stencil { rows: n, cols, lo, hi, first, taps, edges }
    }

    /// Puts more rows and columns into the middle, all like the middle row, which the interior must hold.
    pub(crate) fn lengthen(&mut self, more: usize) {
        let (rows, cols) = (self.rows / 2, self.cols / 2);
        for (r, row) in &mut self.edges {
            *r += if *r > rows { more } else { 0 };
            row.iter_mut().for_each(|(c, _)| *c += if *c > cols { more } else { 0 });
        }
        self.rows += more;
        self.cols += more;
        self.hi += more;
    }

    /// Its rows as lists of entries.
    pub(crate) fn to_rows(&self) -> Vec<Vec<(usize, f64)>> {
        let mut rows = vec![Vec::new(); self.rows];
        for r in self.lo..self.hi {
            rows[r] = self.taps.iter().enumerate().map(|(k, v)| ((r as isize + self.first) as usize + k, *v)).collect();
        }
        for (r, row) in &self.edges {
            rows[*r].clone_from(row);
        }
        rows
    }

    /// Every entry: row, column, value.
    pub(crate) fn each_entry(&self, mut f: impl FnMut(usize, usize, f64)) {
        for r in self.lo..self.hi {
            let from = (r as isize + self.first) as usize;
            self.taps.iter().enumerate().for_each(|(k, v)| f(r, from + k, *v));
        }
        for (r, row) in &self.edges {
            row.iter().for_each(|(c, v)| f(*r, *c, *v));
        }
    }

    pub(crate) fn transposed(&self) -> Stencil {
        let mut rows = vec![Vec::new(); self.cols];
        for (r, row) in self.to_rows().into_iter().enumerate() {
            row.into_iter().for_each(|(c, v)| rows[c].push((r, v)));
        }
        Stencil::new(self.rows, rows)
    }

    /// `self * other`.
    pub(crate) fn times(&self, other: &Stencil) -> Stencil {
        let right = other.to_rows();
        let product = |row: Vec<(usize, f64)>| {
            row.into_iter().flat_map(|(k, v)| right[k].iter().map(move |(c, w)| (*c, v * w))).collect()
        };
        Stencil::new(other.cols, self.to_rows().into_iter().map(product).collect())
    }

    /// `y = self * x` along rows of the last axis: `x` holds rows of `cols` values, `y` rows of `rows`.
    pub(crate) fn along(&self, x: &[f64], y: &mut [f64]) {
        for (x, y) in x.chunks_exact(self.cols).zip(y.chunks_exact_mut(self.rows)) {
            if self.lo < self.hi {
                let from = (self.lo as isize + self.first) as usize;
                interior(&self.taps, &x[from..], &mut y[self.lo..self.hi]);
            }
            for (r, row) in &self.edges {
                y[*r] = row.iter().map(|(c, v)| v * x[*c]).sum();
            }
        }
    }

    /// `y += self * x` along the first axis of a grid with rows of `width` values (`y = ` with `fresh`).
    pub(crate) fn across(&self, x: &[f64], y: &mut [f64], width: usize, fresh: bool) {
        let row = |c: usize| &x[c * width..][..width];
        for (r, y) in y.chunks_exact_mut(width).enumerate() {
            if fresh {
                y.fill(0.0);
            }
            if (self.lo..self.hi).contains(&r) {
                let from = (r as isize + self.first) as usize;
                gather(&self.taps, &x[from * width..], width, y);
            }
        }
        for (r, entries) in &self.edges {
            let y = &mut y[r * width..][..width];
            for (c, v) in entries {
                y.iter_mut().zip(row(*c)).for_each(|(y, x)| *y += v * x);
            }
        }
    }
}

/// Sorted by column, equal columns added, zeros dropped.
fn compact(mut row: Vec<(usize, f64)>) -> Vec<(usize, f64)> {
    row.sort_by_key(|e| e.0);
    let mut out: Vec<(usize, f64)> = Vec::with_capacity(row.len());
    for (c, v) in row {
        match out.last_mut() {
            Some(last) if last.0 == c => last.1 += v,
            _ => out.push((c, v)),
        }
    }
    // A zero inside a row stays where it keeps the taps contiguous.
    while out.last().is_some_and(|e| e.1 == 0.0) {
        out.pop();
    }
    let lead = out.iter().take_while(|e| e.1 == 0.0).count();
    out.drain(..lead);
    out
}

/// `y[i] = sum taps[k] * x[i + k]`.
fn interior(taps: &[f64], x: &[f64], y: &mut [f64]) {
    let n = y.len();
    match *taps {
        [a, b] => {
            for (y, (p, q)) in y.iter_mut().zip(x.iter().zip(&x[1..])) {
                *y = a * p + b * q;
            }
        }
        [a, b, c] => {
            for (y, ((p, q), r)) in y.iter_mut().zip(x.iter().zip(&x[1..]).zip(&x[2..])) {
                *y = a * p + b * q + c * r;
            }
        }
        [a, b, c, d, e, f, g] => {
            let x = &x[..n + 6];
            let (x0, x1, x2, x3) = (&x[..n], &x[1..n + 1], &x[2..n + 2], &x[3..n + 3]);
            let (x4, x5, x6) = (&x[4..n + 4], &x[5..n + 5], &x[6..n + 6]);
            for i in 0..n {
                y[i] = (a * x0[i] + b * x1[i] + c * x2[i]) + d * x3[i] + (e * x4[i] + f * x5[i] + g * x6[i]);
            }
        }
        _ => {
            y.fill(0.0);
            for (k, t) in taps.iter().enumerate() {
                y.iter_mut().zip(&x[k..]).for_each(|(y, x)| *y += t * x);
            }
        }
    }
}

/// `y += sum taps[k] * row k of x`.
fn gather(taps: &[f64], x: &[f64], width: usize, y: &mut [f64]) {
    let row = |k: usize| &x[k * width..][..width];
    match *taps {
        [a, b] => {
            let (p, q) = (row(0), row(1));
            for i in 0..width {
                y[i] += a * p[i] + b * q[i];
            }
        }
        [a, b, c] => {
            let (p, q, r) = (row(0), row(1), row(2));
            for i in 0..width {
                y[i] += a * p[i] + b * q[i] + c * r[i];
            }
        }
        [a, b, c, d, e, f, g] => {
            let (x0, x1, x2, x3, x4, x5, x6) = (row(0), row(1), row(2), row(3), row(4), row(5), row(6));
            let y = &mut y[..width];
            for i in 0..width {
                y[i] += (a * x0[i] + b * x1[i] + c * x2[i]) + d * x3[i] + (e * x4[i] + f * x5[i] + g * x6[i]);
            }
        }
        _ => {
            for (k, t) in taps.iter().enumerate() {
                y.iter_mut().zip(row(k)).for_each(|(y, x)| *y += t * x);
            }
        }
    }
}
