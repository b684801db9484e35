//! Filters, pyramids, hybrid bases, index procedures, the semi-orthogonal basis.

use ondelette_wavelet::exact::{Sequence, to_f64};
use ondelette_wavelet::{
    Boundary, Family, Hybrid, Kind, OpenColumns, OpenKnots, Pyramid, Scaling, SplineFamily, TreeFamily, notation, open,
    tree,
};
use serde_json::Value;

use crate::report::{Report, count, field, whole};

/// The pyramid of a family name of the vectors on `2^levels` spans or cells.
pub(crate) fn by_name(name: &str, levels: usize) -> Result<Pyramid, String> {
    let lower = name.to_lowercase();
    let family: Family = lower.parse().map_err(|e| format!("{e}"))?;
    let (boundary, len) = match family {
        Family::Spline(_) => (Boundary::Mirrored, (1 << levels) + 1),
        _ => (Boundary::Periodic, family.cell() << levels),
    };
    Pyramid::new(family, boundary, len, levels).map_err(|e| e.to_string())
}

/// The pyramid of an entry with `family` and `L`.
pub(crate) fn of_entry(entry: &Value) -> Result<Pyramid, String> {
    by_name(entry["family"].as_str().ok_or("no family")?, whole(entry, "L")?)
}

/// A `sigma` of the vectors.
pub(crate) fn sigma(entry: &Value) -> Result<Scaling, String> {
    Ok(Scaling::Sigma(match entry["sigma"].as_str().unwrap_or("1") {
        "1" => 1.0,
        "1/sqrt2" => std::f64::consts::FRAC_1_SQRT_2,
        "2" => 2.0,
        "2^(1/2)" => std::f64::consts::SQRT_2,
        "2^(3/2)" => 2.0 * std::f64::consts::SQRT_2,
        other => return Err(format!("unknown sigma {other:?}")),
    }))
}

fn filter(name: &str, s: &Sequence, offset: isize, want: &Value, report: &mut Report) {
    if want.is_null() {
        return;
    }
    report.check(&format!("{name}.first"), &[(s.first + offset) as f64], &want["first"], 0.0);
    report.check(&format!("{name}.coef"), &s.to_f64().1, &want["coef"], 1e-12);
}

/// Section `filters`.
pub(crate) fn filters(section: &Value, report: &mut Report) {
    let f = SplineFamily::CUBIC.filters();
    let bank = &section["bspline"];
    // The thesis counts phi from its start (2 before its centre), psi likewise (3.5 coarse units before its centre).
    filter("filters.bspline.h", &f.h, 2, &bank["h"], report);
    filter("filters.bspline.g", &f.g, 4, &bank["g"], report);
    filter("filters.bspline.h_dual", &f.h_dual, 2, &bank["h_dual"], report);
    filter("filters.bspline.g_dual", &f.g_dual, 4, &bank["g_dual"], report);
    report.each("filters.bspline.matrices", &bank["matrices"], |name, entry, report| {
        let p = by_name("bspline", whole(entry, "L")?)?;
        for (field, up) in [("W_coef_pyr_up", true), ("Winv_coef_pyr_down", false)] {
            report.check(&format!("{name}.{field}"), &matrix(&p, Kind::Coefficients, up)?, &entry[field], 1e-12);
        }
        Ok(())
    });
    for (name, entry) in section["flatlet"].as_object().into_iter().flatten() {
        let here = format!("filters.flatlet.{name}");
        let order = name[1..].parse().unwrap_or(0);
        let Ok(family) = TreeFamily::flatlet(order) else {
            report.fail(&here, "no such order");
            continue;
        };
        report.check(&format!("{here}.primal"), family.primal(), &entry["primal"], 1e-12);
        report.check(&format!("{here}.dual_inverse_transpose"), family.dual(), &entry["dual_inverse_transpose"], 1e-12);
        let norms: Vec<f64> = family.primal().chunks(2 * order).map(|r| r.iter().map(|x| x * x).sum()).collect();
        report.check(&format!("{here}.row_norms_squared"), &norms, &entry["row_norms_squared"], 1e-12);
    }
    for (name, entry) in section["multiwavelet"].as_object().into_iter().flatten() {
        let here = format!("filters.multiwavelet.{name}");
        let order = name[1..].parse().unwrap_or(0);
        let Ok(family) = TreeFamily::multiwavelet(order) else {
            report.fail(&here, "no such order");
            continue;
        };
        report.check(&format!("{here}.matrix"), family.primal(), &entry["matrix"], 1e-12);
        let squares = tree::multiwavelet_squares(order);
        let flat: Vec<f64> = squares.iter().flatten().flat_map(|(s, q)| [f64::from(*s), to_f64(q)]).collect();
        report.check(&format!("{here}.sign_and_square"), &flat, &entry["sign_and_square"], 1e-12);
    }
    let phi = SplineFamily::CUBIC.scaling_function();
    let segments: Vec<f64> = phi.pieces().iter().flatten().map(to_f64).collect();
    report.check("filters.phi_segments_u_powers", &segments, &section["phi_segments_u_powers"], 1e-12);
    let haar = TreeFamily::haar();
    report.check("filters.haar.basis_up", haar.primal(), &section["haar"]["basis_up"], 1e-12);
    report.check("filters.haar.coef_up", haar.dual(), &section["haar"]["coef_up"], 1e-12);
}

/// A pyramid as a dense matrix, row-major.
fn matrix(p: &Pyramid, kind: Kind, up: bool) -> Result<Vec<f64>, String> {
    let n = p.len();
    let mut out = vec![0.0; n * n];
    for j in 0..n {
        let mut e = vec![0.0; n];
        e[j] = 1.0;
        let column = if up { p.up(kind, &e) } else { p.down(kind, &e) }.map_err(|e| e.to_string())?;
        column.iter().enumerate().for_each(|(i, v)| out[i * n + j] = *v);
    }
    Ok(out)
}

/// The four pyramid procedures of an entry with `x` and `y`.
fn procedures(p: &Pyramid, name: &str, entry: &Value, tol: f64, report: &mut Report) -> Result<(), String> {
    let smooth = p.smooth_len(0);
    for (field_name, kind) in [("coef_up", Kind::Coefficients), ("basis_up", Kind::Basis)] {
        if entry[field_name].is_null() {
            continue;
        }
        let flat = p.up(kind, &field(entry, "x")?).map_err(|e| e.to_string())?;
        let want = &entry[field_name];
        report.check_part(&format!("{name}.{field_name}.b"), &flat[..smooth], &want["b"], want, tol);
        report.check_part(&format!("{name}.{field_name}.w"), &flat[smooth..], &want["w"], want, tol);
    }
    for (field_name, kind) in [("coef_down", Kind::Coefficients), ("basis_down", Kind::Basis)] {
        if entry[field_name].is_null() {
            continue;
        }
        let flat = [field(&entry["y"], "b")?, field(&entry["y"], "w")?].concat();
        report.check_result(&format!("{name}.{field_name}"), p.down(kind, &flat), &entry[field_name], tol);
    }
    Ok(())
}

/// An entry of section `pyramid`.
pub(crate) fn pyramid(name: &str, entry: &Value, report: &mut Report) -> Result<(), String> {
    let p = of_entry(entry)?.with_scaling(sigma(entry)?);
    procedures(&p, name, entry, 1e-12, report)
}

/// Section `hybrid`.
pub(crate) fn hybrid(section: &Value, report: &mut Report) {
    let run = |report: &mut Report| -> Result<(), String> {
        let levels = whole(section, "L")?;
        let p = by_name("bspline", levels)?;
        let fine = crate::report::numbers(&section["b_all"][levels]).ok_or("no b_all[L]")?;
        let mut curve = Hybrid::new(&p, &fine).map_err(|e| e.to_string())?;
        for i in 0..=levels {
            report.check(&format!("hybrid.b_all[{i}]"), curve.smooth(i), &section["b_all"][i], 1e-12);
        }
        for i in 0..levels {
            report.check(&format!("hybrid.w_all[{i}]"), curve.detail(i), &section["w_all"][i], 1e-12);
        }
        let edit = &section["edit"];
        if edit.is_null() {
            return Ok(());
        }
        let (level, at) = (whole(edit, "doLevel")?, edit["array_pos"].as_u64().ok_or("no array_pos")? as usize);
        let add = edit["add"].as_f64().ok_or("no add")?;
        if level > levels {
            return Err(format!("doLevel {level} above L = {levels}"));
        }
        *curve.smooth_mut(level).get_mut(at).ok_or("array_pos outside")? += add;
        curve.finer(level, levels);
        for (i, want) in edit["b_levels_after_down"].as_object().into_iter().flatten() {
            let Some(b) = i.parse().ok().filter(|i| *i <= levels).map(|i: usize| curve.smooth(i)) else { continue };
            report.check(&format!("hybrid.edit.b_levels_after_down[{i}]"), b, want, 1e-12);
        }
        Ok(())
    };
    if let Err(e) = run(report) {
        report.fail("hybrid", e);
    }
}

/// Section `index`.
pub(crate) fn index(section: &Value, report: &mut Report) {
    for (list, procedure) in
        [("bs_index", notation::bs_index as fn(u32, i64) -> i64), ("wave_index", notation::wave_index)]
    {
        report.each(&format!("index.{list}"), &section[list], |name, entry, report| {
            let level = whole(entry, "L")? as u32;
            let got: Vec<f64> = field(entry, "j")?.iter().map(|&j| procedure(level, j as i64) as f64).collect();
            report.check(&format!("{name}.out"), &got, &entry["out"], 0.0);
            Ok(())
        });
    }
}

/// The columns of one level of the open basis: non-zero entries of each.
fn columns(spans: usize) -> Result<(usize, Vec<Vec<f64>>), String> {
    let p = Pyramid::open(spans + 3, 1, OpenColumns::Printed).map_err(|e| e.to_string())?;
    let (rung, n) = (p.rung(0), spans + 3);
    let dense = rung.synthesis().to_dense();
    let all = (0..n).map(|j| (0..n).map(|i| dense[i * n + j]).collect()).collect();
    Ok((rung.smooth(), all))
}

/// Section `semi`.
pub(crate) fn semi(section: &Value, report: &mut Report) {
    const TOL: f64 = 1e-10;
    report.each("semi.pyramid", &section["pyramid"], |name, entry, report| {
        let levels = whole(entry, "L")?;
        let min = whole(entry, "min_level")?;
        let depth = levels.checked_sub(min).ok_or("min_level above L")?;
        let p = Pyramid::open((1 << levels) + 3, depth, OpenColumns::Printed).map_err(|e| e.to_string())?;
        procedures(&p, name, entry, TOL, report)
    });
    let boundary = open::boundary_wavelets();
    let run = |report: &mut Report| -> Result<(), String> {
        let (smooth, c) = columns(32)?;
        let trim = |x: &[f64]| {
            let last = x.iter().rposition(|v| *v != 0.0).unwrap_or(0);
            x[..=last].to_vec()
        };
        let inner: Vec<f64> = c[8].iter().copied().filter(|v| *v != 0.0).collect();
        report.check("semi.h", &inner, &section["h"], TOL);
        for (i, j) in ["-3", "-2", "-1"].iter().enumerate() {
            report.check(&format!("semi.h_boundary[{j}]"), &trim(&c[i]), &section["h_boundary"][j], TOL);
            let g: Vec<f64> = boundary[i].iter().map(|v| to_f64(v) * 40320.0).collect();
            report.check(&format!("semi.g_boundary_times_8fact[{j}]"), &g, &section["g_boundary_times_8fact"][j], TOL);
        }
        let g: Vec<f64> = c[smooth + 5].iter().filter(|v| **v != 0.0).map(|v| v * 40320.0).collect();
        report.check("semi.g_times_8fact", &g, &section["g_times_8fact"], TOL);
        for (level, want) in section["coarse_windows"].as_object().into_iter().flatten() {
            let fine: u32 = level.parse().map_err(|_| "coarse_windows level is not a number")?;
            if fine > 9 {
                return Err(format!("coarse_windows of level {fine}: at most 9"));
            }
            let (smooth, c) = columns(1 << fine)?;
            // Stored as integers; both sides are scaled to a largest coefficient of 1.
            let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, v| if v.abs() > m.abs() { *v } else { m });
            let rows: Option<Vec<Vec<f64>>> =
                want.as_array().and_then(|rows| rows.iter().map(crate::report::numbers).collect());
            let rows = rows.ok_or("coarse_windows is not a list of rows")?;
            let scaled: Vec<f64> = rows.iter().flat_map(|r| r.iter().map(|v| v / largest(r))).collect();
            let name = format!("semi.coarse_windows[{level}]");
            report.check(&name, &c[smooth..].concat(), &Value::from(scaled), TOL);
        }
        Ok(())
    };
    if let Err(e) = run(report) {
        report.fail("semi", e);
    }
    report.each("semi.gram", &section["gram"], |name, entry, report| {
        let (n, a) = (count(entry, "n", 1024)?, count(entry, "a", 3)?);
        if n == 0 {
            return Err("n is 0".to_owned());
        }
        let gram: Vec<f64> = OpenKnots::uniform(n).gram(a).iter().flatten().map(to_f64).collect();
        report.check(&format!("{name}.matrix"), &gram, &entry["matrix"], TOL);
        Ok(())
    });
}
