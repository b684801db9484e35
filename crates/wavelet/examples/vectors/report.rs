//! Lines, tolerances and reading of reference values.

use serde_json::Value;

/// The result of a run.
#[derive(Default)]
pub(crate) struct Report {
    /// One line per field.
    pub(crate) lines: Vec<String>,
    /// Fields within tolerance.
    pub(crate) passed: usize,
    /// Fields outside, or that could not be computed.
    pub(crate) failed: usize,
    /// Sections that concern other crates.
    pub(crate) skipped: usize,
}

impl Report {
    /// A section about another crate.
    pub(crate) fn skip(&mut self, name: &str) {
        self.skipped += 1;
        self.lines.push(format!("{name} SKIP"));
    }

    /// A field that could not be computed or read.
    pub(crate) fn fail(&mut self, name: &str, why: impl std::fmt::Display) {
        self.failed += 1;
        self.lines.push(format!("{name} FAIL {why}"));
    }

    /// Compares an array with the reference of that name, if there is one: largest difference over largest reference.
    pub(crate) fn check(&mut self, name: &str, got: &[f64], want: &Value, tol: f64) {
        self.check_part(name, got, want, want, tol);
    }

    /// [`Report::check`] of a part of a larger array (a block of a decomposition): relative to the largest value of
    /// the whole, since a part can be zero but for rounding.
    pub(crate) fn check_part(&mut self, name: &str, got: &[f64], want: &Value, whole: &Value, tol: f64) {
        if want.is_null() {
            return;
        }
        let whole = numbers(whole).unwrap_or_default();
        let Some(want) = numbers(want) else { return self.fail(name, "reference is not numbers") };
        if got.len() != want.len() {
            return self.fail(name, format!("{} values, reference has {}", got.len(), want.len()));
        }
        let scale = whole.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let worst = got.iter().zip(&want).fold(0.0_f64, |m, (a, b)| {
            let d = (a - b).abs();
            if d.is_nan() { f64::INFINITY } else { m.max(d) }
        });
        let rel = if scale > 0.0 { worst / scale } else { worst };
        let pass = rel <= tol;
        self.passed += usize::from(pass);
        self.failed += usize::from(!pass);
        self.lines.push(format!("{name} {} {rel:.2e} {tol:.0e}", if pass { "PASS" } else { "FAIL" }));
    }

    /// [`Report::check`] of a result that may be an error.
    pub(crate) fn check_result<E: std::fmt::Display>(
        &mut self,
        name: &str,
        got: Result<Vec<f64>, E>,
        want: &Value,
        tol: f64,
    ) {
        match got {
            _ if want.is_null() => {}
            Ok(got) => self.check(name, &got, want, tol),
            Err(e) => self.fail(name, e),
        }
    }

    /// Runs `f` on each entry of a list, as `section[i]`.
    pub(crate) fn each(
        &mut self,
        name: &str,
        section: &Value,
        f: impl Fn(&str, &Value, &mut Report) -> Result<(), String>,
    ) {
        let Some(entries) = section.as_array() else {
            if !section.is_null() {
                self.fail(name, "is not a list");
            }
            return;
        };
        for (i, entry) in entries.iter().enumerate() {
            let name = format!("{name}[{i}]");
            if let Err(e) = f(&name, entry, self) {
                self.fail(&name, e);
            }
        }
    }
}

/// All numbers of a nested array or object, in order; rationals `"p/q"` are divided.
pub(crate) fn numbers(v: &Value) -> Option<Vec<f64>> {
    fn walk(v: &Value, out: &mut Vec<f64>) -> Option<()> {
        match v {
            Value::Array(a) => a.iter().try_for_each(|v| walk(v, out)),
            Value::Object(o) => o.values().try_for_each(|v| walk(v, out)),
            Value::String(s) => {
                let (p, q) = s.split_once('/').unwrap_or((s, "1"));
                out.push(p.trim().parse::<f64>().ok()? / q.trim().parse::<f64>().ok()?);
                Some(())
            }
            v => {
                out.push(v.as_f64()?);
                Some(())
            }
        }
    }
    let mut out = Vec::new();
    walk(v, &mut out)?;
    Some(out)
}

/// The numbers of a field that must be there.
pub(crate) fn field(entry: &Value, name: &str) -> Result<Vec<f64>, String> {
    numbers(&entry[name]).filter(|_| !entry[name].is_null()).ok_or_else(|| format!("no field {name}"))
}

/// A whole number up to `most` that must be there.
pub(crate) fn count(entry: &Value, name: &str, most: usize) -> Result<usize, String> {
    let n = entry[name].as_u64().ok_or_else(|| format!("no whole number {name}"))?;
    usize::try_from(n).ok().filter(|n| *n <= most).ok_or_else(|| format!("{name} = {n} is above {most}"))
}

/// A level, an order or a number of derivatives: a small whole number that must be there.
pub(crate) fn whole(entry: &Value, name: &str) -> Result<usize, String> {
    count(entry, name, 24)
}
