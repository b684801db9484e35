//! Sums and products with the rounding errors kept: numbers of twice the precision, as unevaluated sums of two.

use super::stencil::Stencil;

/// An unevaluated sum `.0 + .1`, the second far below the first.
pub(crate) type Twofold = (f64, f64);

/// a + b exactly (Knuth).
pub(crate) fn sum(a: f64, b: f64) -> Twofold {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// a * b exactly (Dekker, with Veltkamp's splitting).
pub(crate) fn product(a: f64, b: f64) -> Twofold {
    let split = |x: f64| {
        let c = 134_217_729.0 * x;
        let high = c - (c - x);
        (high, x - high)
    };
    let p = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

/// `a + b`.
pub(crate) fn add(a: Twofold, b: Twofold) -> Twofold {
    let (s, e) = sum(a.0, b.0);
    let (h, l) = sum(s, e + a.1 + b.1);
    (h, l)
}

/// `a * b` for a plain factor.
pub(crate) fn scale(a: Twofold, b: f64) -> Twofold {
    let (p, e) = product(a.0, b);
    sum(p, e + a.1 * b)
}

impl Stencil {
    /// `self * x` with twice the precision.
    pub(crate) fn along_twofold(&self, x: &[Twofold]) -> Vec<Twofold> {
        let mut out = vec![(0.0, 0.0); self.rows];
        self.each_entry(|r, c, v| out[r] = add(out[r], scale(x[c], v)));
        out
    }
}
