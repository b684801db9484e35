//! Anti-aliased lines and dots.

/// Linear colours are not needed for flat drawings: everything here is in sRGB values, 0 to 1.
pub(super) type Color = [f32; 3];

/// A point in pixels, y down.
pub(super) type P = [f64; 2];

pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<Color>,
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize, color: Color) -> Canvas {
        Canvas { width, height, pixels: vec![color; width * height] }
    }

    fn blend(&mut self, x: usize, y: usize, color: Color, cover: f64) {
        let cover = cover.clamp(0.0, 1.0) as f32;
        let p = &mut self.pixels[y * self.width + x];
        *p = std::array::from_fn(|c| p[c] + cover * (color[c] - p[c]));
    }

    /// Covers every pixel by what `cover` says at its middle; `low` and `high` bound the region.
    fn cover(&mut self, low: P, high: P, color: Color, cover: impl Fn(P) -> f64) {
        let side = |x: f64, n: usize| x.clamp(0.0, n as f64) as usize;
        for y in side(low[1].floor(), self.height)..side(high[1].ceil() + 1.0, self.height) {
            for x in side(low[0].floor(), self.width)..side(high[0].ceil() + 1.0, self.width) {
                let c = cover([x as f64 + 0.5, y as f64 + 0.5]);
                if c > 0.0 {
                    self.blend(x, y, color, c);
                }
            }
        }
    }

    /// A connected line of the given width, without darker joints.
    pub(super) fn line(&mut self, points: &[P], width: f64, color: Color, opacity: f64) {
        // Coverage of the whole line first: its pieces overlap at the joints.
        let reach = 0.5 * width + 1.0;
        let mut cover = std::collections::BTreeMap::new();
        for w in points.windows(2) {
            let [a, b] = [w[0], w[1]];
            if ![a, b].iter().flatten().all(|x| x.is_finite()) {
                continue;
            }
            let low = [a[0].min(b[0]) - reach, a[1].min(b[1]) - reach];
            let high = [a[0].max(b[0]) + reach, a[1].max(b[1]) + reach];
            let side = |x: f64, n: usize| x.clamp(0.0, n as f64) as usize;
            for y in side(low[1].floor(), self.height)..side(high[1].ceil(), self.height) {
                // only the columns near the line on this row
                let (from, to) = row_reach(a, b, y as f64 + 0.5, reach, low[0], high[0]);
                for x in side(from.floor(), self.width)..side(to.ceil(), self.width) {
                    let d = distance([x as f64 + 0.5, y as f64 + 0.5], a, b);
                    let c = (0.5 * width + 0.5 - d).clamp(0.0, width.min(1.0));
                    if c > 0.0 {
                        let slot = cover.entry(y * self.width + x).or_insert(0.0_f64);
                        *slot = slot.max(c);
                    }
                }
            }
        }
        for (at, c) in cover {
            self.blend(at % self.width, at / self.width, color, c * opacity);
        }
    }

    pub(super) fn disc(&mut self, at: P, radius: f64, color: Color) {
        let r = radius + 1.0;
        self.cover([at[0] - r, at[1] - r], [at[0] + r, at[1] + r], color, |p| {
            radius + 0.5 - (p[0] - at[0]).hypot(p[1] - at[1])
        });
    }

    pub(super) fn ring(&mut self, at: P, radius: f64, width: f64, color: Color) {
        let r = radius + width + 1.0;
        self.cover([at[0] - r, at[1] - r], [at[0] + r, at[1] + r], color, |p| {
            0.5 * width + 0.5 - ((p[0] - at[0]).hypot(p[1] - at[1]) - radius).abs()
        });
    }

    pub(super) fn arrow(&mut self, from: P, to: P, width: f64, color: Color) {
        let d = [to[0] - from[0], to[1] - from[1]];
        let n = d[0].hypot(d[1]);
        if n < 1.0 {
            return;
        }
        let (u, head) = ([d[0] / n, d[1] / n], 4.5 * width);
        let base = [to[0] - head * u[0], to[1] - head * u[1]];
        self.line(&[from, base], width, color, 1.0);
        let side = |s: f64| [base[0] - s * 0.45 * head * u[1], base[1] + s * 0.45 * head * u[0]];
        let corners = [to, side(1.0), side(-1.0)];
        let low = [0, 1].map(|c| corners.iter().map(|p| p[c]).fold(f64::INFINITY, f64::min) - 1.0);
        let high = [0, 1].map(|c| corners.iter().map(|p| p[c]).fold(f64::NEG_INFINITY, f64::max) + 1.0);
        self.cover(low, high, color, |p| {
            // least distance inside the three edges, whichever way round they go
            let edge = |a: P, b: P| {
                ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / (b[0] - a[0]).hypot(b[1] - a[1])
            };
            let e = [edge(corners[0], corners[1]), edge(corners[1], corners[2]), edge(corners[2], corners[0])];
            let inside = |s: f64| e.iter().map(|x| s * x).fold(f64::INFINITY, f64::min);
            inside(1.0).max(inside(-1.0)) + 0.5
        });
    }

    pub(super) fn finish(self) -> super::Picture {
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        super::Picture {
            width: self.width as u32,
            height: self.height as u32,
            pixels: self.pixels.into_iter().map(|p| p.map(byte)).collect(),
        }
    }
}

/// Columns of a row that a thick segment can cover.
fn row_reach(a: P, b: P, y: f64, reach: f64, low: f64, high: f64) -> (f64, f64) {
    let dy = b[1] - a[1];
    if dy.abs() < 1e-9 {
        return (low, high);
    }
    let x = a[0] + (y - a[1]) / dy * (b[0] - a[0]);
    let slant = reach * (1.0 + ((b[0] - a[0]) / dy).powi(2)).sqrt();
    ((x - slant).max(low), (x + slant).min(high))
}

fn distance(p: P, a: P, b: P) -> f64 {
    let d = [b[0] - a[0], b[1] - a[1]];
    let size = d[0] * d[0] + d[1] * d[1];
    let w = if size > 0.0 { (((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / size).clamp(0.0, 1.0) } else { 0.0 };
    (p[0] - a[0] - w * d[0]).hypot(p[1] - a[1] - w * d[1])
}
