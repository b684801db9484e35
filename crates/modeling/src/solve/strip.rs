//! Cholesky factors of narrow strips: matrices of a band that is a few entries wide.

/// A lower triangular factor of half bandwidth `band`.
#[derive(Clone, Debug)]
pub(crate) struct Strip {
    band: usize,
    /// Row i: entries of columns i - band .. i, then the inverse pivot.
    rows: Vec<f64>,
}

impl Strip {
    /// Factors the matrix whose lower triangle `entries` lists; a part of the largest pivot is added to all where it is
    /// not positive definite. Time: `n band^2`. `None` for numbers that are not finite.
    pub(crate) fn new(n: usize, band: usize, entries: &[(usize, usize, f64)]) -> Option<Strip> {
        let mut rows = vec![0.0; n * (band + 1)];
        let mut largest = 0.0_f64;
        for &(r, c, v) in entries {
            rows[r * (band + 1) + c + band - r] += v;
        }
        (0..n).for_each(|i| largest = largest.max(rows[i * (band + 1) + band]));
        factored(rows.clone(), band).or_else(|| {
            (0..n).for_each(|i| rows[i * (band + 1) + band] += 1e-10 * largest);
            factored(rows, band)
        })
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rows.len() / (self.band + 1)
    }

    /// `x = L^-T L^-1 x`.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        let band = self.band;
        let part = |i: usize| (i.saturating_sub(band), &self.rows[i * (band + 1)..][..band + 1]);
        for i in 0..x.len() {
            let (from, row) = part(i);
            let sum: f64 = row[from + band - i..band].iter().zip(&x[from..i]).map(|(l, x)| l * x).sum();
            x[i] = (x[i] - sum) * row[band];
        }
        for i in (0..x.len()).rev() {
            let (from, row) = part(i);
            x[i] *= row[band];
            let by = x[i];
            row[from + band - i..band].iter().zip(&mut x[from..i]).for_each(|(l, x)| *x -= l * by);
        }
    }
}

fn factored(mut rows: Vec<f64>, band: usize) -> Option<Strip> {
    let width = band + 1;
    for i in 0..rows.len() / width {
        let first = i.saturating_sub(band);
        let (done, row) = rows.split_at_mut(i * width);
        for j in first..=i {
            let from = first.max(j.saturating_sub(band));
            let own = &row[from + band - i..j + band - i];
            let sum: f64 = if j == i {
                own.iter().map(|l| l * l).sum()
            } else {
                own.iter().zip(&done[j * width + from + band - j..][..j - from]).map(|(a, b)| a * b).sum()
            };
            let value = row[j + band - i] - sum;
            if j < i {
                row[j + band - i] = value * done[j * width + band];
            } else {
                // Far less than what was there is rounding.
                if !(value > 1e-15 * row[band] && value.is_finite()) {
                    return None;
                }
                row[band] = 1.0 / value.sqrt();
            }
        }
    }
    Some(Strip { band, rows })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_is_solved_to_rounding_and_a_null_space_is_held() {
        let (n, band) = (40, 5);
        let entry = |r: usize, c: usize| if r == c { 12.0 } else { ((r * 7 + c * 3) as f64).sin() };
        let all = || (0..n).flat_map(|r: usize| (r.saturating_sub(band)..=r).map(move |c| (r, c)));
        let entries: Vec<_> = all().map(|(r, c)| (r, c, entry(r, c))).collect();
        let want: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
        let mut x = vec![0.0; n];
        for &(r, c, v) in &entries {
            x[r] += v * want[c];
            x[c] += if r == c { 0.0 } else { v * want[r] };
        }
        let strip = Strip::new(n, band, &entries).unwrap();
        assert_eq!(strip.len(), n);
        strip.solve(&mut x);
        assert!(x.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-13));
        // Differences alone: constants are free.
        let differences: Vec<_> = (0..n).map(|i| (i, i, 2.0)).chain((1..n).map(|i| (i, i - 1, -1.0))).collect();
        let mut loose = differences;
        (loose[0].2, loose[n - 1].2) = (1.0, 1.0);
        assert!(Strip::new(n, 1, &loose).is_some());
        assert!(Strip::new(1, 0, &[(0, 0, f64::NAN)]).is_none());
    }
}
