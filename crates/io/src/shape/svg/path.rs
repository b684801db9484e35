//! The grammar of path data and of transforms.

use super::{MOST, Matrix, product};

/// Numbers, letters and separators of an attribute.
struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Scanner<'_> {
    fn skip(&mut self) {
        while self.bytes.get(self.at).is_some_and(|b| b.is_ascii_whitespace() || *b == b',') {
            self.at += 1;
        }
    }

    fn letter(&mut self) -> Option<u8> {
        self.skip();
        let b = *self.bytes.get(self.at)?;
        b.is_ascii_alphabetic().then(|| {
            self.at += 1;
            b
        })
    }

    fn ends(&mut self) -> bool {
        self.skip();
        self.at == self.bytes.len()
    }

    /// Whether a number comes next.
    fn number_ahead(&mut self) -> bool {
        self.skip();
        self.bytes.get(self.at).is_some_and(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.'))
    }

    fn number(&mut self) -> Result<f64, String> {
        self.skip();
        let start = self.at;
        let take = |s: &mut Self, set: &[u8]| {
            if s.bytes.get(s.at).is_some_and(|b| set.contains(b)) {
                s.at += 1;
            }
        };
        let digits = |s: &mut Self| {
            let from = s.at;
            while s.bytes.get(s.at).is_some_and(u8::is_ascii_digit) {
                s.at += 1;
            }
            s.at > from
        };
        take(self, b"+-");
        let whole = digits(self);
        take(self, b".");
        let part = digits(self);
        if whole || part {
            let before = self.at;
            if self.bytes.get(self.at).is_some_and(|b| matches!(b, b'e' | b'E')) {
                self.at += 1;
                take(self, b"+-");
                if !digits(self) {
                    self.at = before;
                }
            }
        }
        let text = std::str::from_utf8(&self.bytes[start..self.at]).unwrap_or_default();
        match text.parse::<f64>() {
            Ok(x) if x.is_finite() && x.abs() <= MOST => Ok(x),
            Ok(x) => Err(format!("path data, byte {start}: {x:e} is not a finite number below {MOST:e}")),
            Err(_) => Err(format!("path data, byte {start}: a number is missing")),
        }
    }

    fn flag(&mut self) -> Result<bool, String> {
        self.skip();
        match self.bytes.get(self.at) {
            Some(b @ (b'0' | b'1')) => {
                self.at += 1;
                Ok(*b == b'1')
            }
            _ => Err(format!("path data, byte {}: an arc's flag is 0 or 1", self.at)),
        }
    }
}

/// Sub-paths as chains of cubics: 3 n + 1 points each. Single points are left out.
pub(super) fn parse(data: &str) -> Result<Vec<Vec<[f64; 2]>>, String> {
    let mut s = Scanner { bytes: data.as_bytes(), at: 0 };
    let mut out = Vec::new();
    let mut now: Vec<[f64; 2]> = Vec::new();
    let (mut at, mut start) = ([0.0; 2], [0.0; 2]);
    // the control point that S and T reflect
    let mut handle: Option<(u8, [f64; 2])> = None;
    let mut command = 0;
    while !s.ends() {
        let offset = s.at;
        match s.letter() {
            Some(b) => command = b,
            None if command == 0 || !s.number_ahead() => {
                return Err(format!("path data, byte {offset}: a command letter is missing"));
            }
            None => {}
        }
        let relative = command.is_ascii_lowercase();
        let kind = command.to_ascii_uppercase();
        if kind != b'M' && kind != b'Z' && now.is_empty() {
            if out.is_empty() && offset == 0 {
                return Err("path data begins with M".to_owned());
            }
            now.push(at);
        }
        let base = if relative { at } else { [0.0; 2] };
        let point =
            |s: &mut Scanner<'_>| -> Result<[f64; 2], String> { Ok([base[0] + s.number()?, base[1] + s.number()?]) };
        let reflected = |of: u8| match handle {
            Some((kind, h)) if kind == of => [2.0 * at[0] - h[0], 2.0 * at[1] - h[1]],
            _ => at,
        };
        let mut next = None;
        match kind {
            b'M' => {
                let p = point(&mut s)?;
                finish(&mut now, &mut out);
                now.push(p);
                (at, start) = (p, p);
                // further pairs are lines
                command = if relative { b'l' } else { b'L' };
            }
            b'Z' => {
                let gap = (at[0] - start[0]).abs().max((at[1] - start[1]).abs());
                if now.len() > 1 && gap > 1e-12 * start[0].abs().max(start[1].abs()) {
                    line(&mut now, at, start);
                } else if now.len() > 1 {
                    now.pop();
                    now.push(start);
                }
                finish(&mut now, &mut out);
                at = start;
                command = 0;
            }
            b'L' | b'H' | b'V' => {
                let p = match kind {
                    b'L' => point(&mut s)?,
                    b'H' => [base[0] + s.number()?, at[1]],
                    _ => [at[0], base[1] + s.number()?],
                };
                line(&mut now, at, p);
                at = p;
            }
            b'C' | b'S' => {
                let a = if kind == b'C' { point(&mut s)? } else { reflected(b'C') };
                let (b, c) = (point(&mut s)?, point(&mut s)?);
                now.extend([a, b, c]);
                next = Some((b'C', b));
                at = c;
            }
            b'Q' | b'T' => {
                let q = if kind == b'Q' { point(&mut s)? } else { reflected(b'Q') };
                let c = point(&mut s)?;
                let toward = |p: [f64; 2]| std::array::from_fn(|k| p[k] + 2.0 / 3.0 * (q[k] - p[k]));
                now.extend([toward(at), toward(c), c]);
                next = Some((b'Q', q));
                at = c;
            }
            b'A' => {
                let radii = [s.number()?.abs(), s.number()?.abs()];
                let turn = s.number()?;
                let (large, sweep) = (s.flag()?, s.flag()?);
                let to = point(&mut s)?;
                arc(&mut now, at, to, radii, turn.to_radians(), large, sweep);
                at = to;
            }
            _ => return Err(format!("path data, byte {offset}: there is no command {:?}", command as char)),
        }
        if at.iter().any(|x| x.is_nan() || x.abs() > MOST) {
            return Err(format!("path data, byte {offset}: the path leaves the plane's {MOST:e}"));
        }
        handle = next;
    }
    finish(&mut now, &mut out);
    Ok(out)
}

fn finish(now: &mut Vec<[f64; 2]>, out: &mut Vec<Vec<[f64; 2]>>) {
    if now.len() > 1 {
        out.push(std::mem::take(now));
    } else {
        now.clear();
    }
}

fn line(now: &mut Vec<[f64; 2]>, a: [f64; 2], b: [f64; 2]) {
    let at = |w: f64| [a[0] + w * (b[0] - a[0]), a[1] + w * (b[1] - a[1])];
    now.extend([at(1.0 / 3.0), at(2.0 / 3.0), b]);
}

/// An elliptic arc (SVG 1.1, F.6.5) as cubics of at most 30 degrees.
fn arc(
    now: &mut Vec<[f64; 2]>,
    from: [f64; 2],
    to: [f64; 2],
    [mut rx, mut ry]: [f64; 2],
    turn: f64,
    large: bool,
    sweep: bool,
) {
    if from == to {
        return;
    }
    if rx == 0.0 || ry == 0.0 {
        return line(now, from, to);
    }
    let (sin, cos) = turn.sin_cos();
    let half = [(from[0] - to[0]) / 2.0, (from[1] - to[1]) / 2.0];
    let p = [cos * half[0] + sin * half[1], -sin * half[0] + cos * half[1]];
    let excess = (p[0] / rx).powi(2) + (p[1] / ry).powi(2);
    if excess > 1.0 {
        rx *= excess.sqrt();
        ry *= excess.sqrt();
    }
    let excess = (p[0] / rx).powi(2) + (p[1] / ry).powi(2);
    let root = ((1.0 - excess).max(0.0) / excess).sqrt() * if large == sweep { -1.0 } else { 1.0 };
    let c = [root * rx * p[1] / ry, -root * ry * p[0] / rx];
    let middle = [cos * c[0] - sin * c[1] + (from[0] + to[0]) / 2.0, sin * c[0] + cos * c[1] + (from[1] + to[1]) / 2.0];
    let start = ((p[1] - c[1]) / ry).atan2((p[0] - c[0]) / rx);
    let end = ((-p[1] - c[1]) / ry).atan2((-p[0] - c[0]) / rx);
    let mut angle = end - start;
    if sweep && angle < 0.0 {
        angle += std::f64::consts::TAU;
    } else if !sweep && angle > 0.0 {
        angle -= std::f64::consts::TAU;
    }
    if !angle.is_finite() {
        return line(now, from, to);
    }
    let pieces = (angle.abs() / 30f64.to_radians()).ceil().clamp(1.0, 12.0);
    let step = angle / pieces;
    let reach = 4.0 / 3.0 * (step / 4.0).tan();
    let place = |x: f64, y: f64| [middle[0] + cos * rx * x - sin * ry * y, middle[1] + sin * rx * x + cos * ry * y];
    for k in 0..pieces as usize {
        let (a, b) = (start + step * k as f64, start + step * (k + 1) as f64);
        now.push(place(a.cos() - reach * a.sin(), a.sin() + reach * a.cos()));
        now.push(place(b.cos() + reach * b.sin(), b.sin() - reach * b.cos()));
        now.push(if k + 1 == pieces as usize { to } else { place(b.cos(), b.sin()) });
    }
}

/// The product of a transform attribute.
pub(super) fn transform(text: &str) -> Result<Matrix, String> {
    let mut out = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let mut rest = text.trim_matches(|c: char| c.is_whitespace() || c == ',');
    while !rest.is_empty() {
        let wrong = || format!("transform {text:?} is not known");
        let (name, tail) = rest.split_once('(').ok_or_else(wrong)?;
        let (numbers, tail) = tail.split_once(')').ok_or_else(wrong)?;
        let mut s = Scanner { bytes: numbers.as_bytes(), at: 0 };
        let mut n = Vec::new();
        while !s.ends() {
            n.push(s.number()?);
        }
        let turn = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            [cos, sin, -sin, cos, 0.0, 0.0]
        };
        let step = match (name.trim(), n.as_slice()) {
            ("matrix", &[a, b, c, d, e, f]) => [a, b, c, d, e, f],
            ("translate", &[x]) => [1.0, 0.0, 0.0, 1.0, x, 0.0],
            ("translate", &[x, y]) => [1.0, 0.0, 0.0, 1.0, x, y],
            ("scale", &[k]) => [k, 0.0, 0.0, k, 0.0, 0.0],
            ("scale", &[x, y]) => [x, 0.0, 0.0, y, 0.0, 0.0],
            ("rotate", &[a]) => turn(a),
            ("rotate", &[a, x, y]) => {
                let there = [1.0, 0.0, 0.0, 1.0, x, y];
                product(&product(&there, &turn(a)), &[1.0, 0.0, 0.0, 1.0, -x, -y])
            }
            ("skewX", &[a]) => [1.0, 0.0, a.to_radians().tan(), 1.0, 0.0, 0.0],
            ("skewY", &[a]) => [1.0, a.to_radians().tan(), 0.0, 1.0, 0.0, 0.0],
            _ => return Err(wrong()),
        };
        out = product(&out, &step);
        rest = tail.trim_start_matches(|c: char| c.is_whitespace() || c == ',');
    }
    Ok(out)
}
