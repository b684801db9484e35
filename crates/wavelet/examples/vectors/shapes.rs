//! Tensors, operators, evaluation, frames, energies and scalings.

use ondelette_wavelet::exact::to_f64;
use ondelette_wavelet::{
    Block, Boundary, Expansion, Frame, Kind, Layout, NonStandardOperator, Pyramid, Scaling, SplineFamily, SplineSpace,
    Tensor, energy_diagonals, gram,
};
use serde_json::Value;

use crate::bases::{by_name, of_entry, sigma};
use crate::report::{Report, count, field, whole};

const TOL: f64 = 1e-12;
/// Levels of the largest dense matrix: files that claim more fail by their size.
const DENSE: usize = 10;

/// The type string of a block: s for phi, d for psi.
fn type_of(block: &Block) -> String {
    block.parts.iter().map(|p| if p.is_detail() { 'd' } else { 's' }).collect()
}

/// Compares the blocks of a non-standard decomposition.
fn nonstandard(tensor: &Tensor, kind: Kind, x: &[f64], name: &str, want: &Value, report: &mut Report) {
    if want.is_null() {
        return;
    }
    let d = match tensor.up(kind, x) {
        Ok(d) => d,
        Err(e) => return report.fail(name, e),
    };
    for block in d.blocks() {
        let (at, place) = if block.is_smooth() {
            (&want["coarse"], "coarse".to_owned())
        } else {
            let (level, kind) = (block.parts[0].level(), type_of(&block));
            (&want["levels"][level][&kind], format!("levels[{level}].{kind}"))
        };
        report.check_part(&format!("{name}.{place}"), &d.block(&block), at, want, TOL);
    }
}

/// An entry of section `tensor2d`.
pub(crate) fn tensor2d(name: &str, entry: &Value, report: &mut Report) -> Result<(), String> {
    let p = of_entry(entry)?;
    let x = field(entry, "x")?;
    let tensor = |layout| Tensor::new(vec![p.clone(), p.clone()], layout).map_err(|e| e.to_string());
    let (standard, non) = (tensor(Layout::Standard)?, tensor(Layout::NonStandard)?);
    for (short, kind) in [("coef_up", Kind::Coefficients), ("basis_up", Kind::Basis)] {
        let field = format!("standard_{short}");
        let flat = standard.up(kind, &x).map(ondelette_wavelet::Decomposition::into_values);
        report.check_result(&format!("{name}.{field}"), flat, &entry[&field], TOL);
        let field = format!("nonstandard_{short}");
        nonstandard(&non, kind, &x, &format!("{name}.{field}"), &entry[&field], report);
    }
    Ok(())
}

/// An entry of section `tensor4d`.
pub(crate) fn tensor4d(name: &str, entry: &Value, report: &mut Report) -> Result<(), String> {
    let p = of_entry(entry)?;
    let x = field(entry, "x")?;
    let four = Tensor::new(vec![p.clone(); 4], Layout::NonStandard).map_err(|e| e.to_string())?;
    let here = format!("{name}.nonstandard_basis_up");
    nonstandard(&four, Kind::Basis, &x, &here, &entry["nonstandard_basis_up"], report);
    if !entry["B"].is_null() {
        let two = Tensor::new(vec![p.clone(); 2], Layout::NonStandard).map_err(|e| e.to_string())?;
        let operator = NonStandardOperator::new(&two, &x, Expansion::Symmetric).map_err(|e| e.to_string())?;
        report.check_result(&format!("{name}.KB"), operator.apply(&field(entry, "B")?), &entry["KB"], TOL);
    }
    Ok(())
}

/// An entry of section `operator1d`.
pub(crate) fn operator1d(name: &str, entry: &Value, report: &mut Report) -> Result<(), String> {
    let p = of_entry(entry)?;
    let domain = Tensor::new(vec![p.clone()], Layout::NonStandard).map_err(|e| e.to_string())?;
    let (matrix, b) = (field(entry, "K")?, field(entry, "b")?);
    for (form, expansion) in [("symmetric", Expansion::Symmetric), ("galerkin", Expansion::Galerkin)] {
        let want = &entry[form];
        if want.is_null() {
            continue;
        }
        let operator = NonStandardOperator::new(&domain, &matrix, expansion).map_err(|e| e.to_string())?;
        let pulled = operator.pull(&b).map_err(|e| e.to_string())?;
        let gathered = operator.gather(&pulled);
        for i in 0..p.levels() {
            let (s, n) = (p.smooth_len(i), p.smooth_len(i + 1));
            let mut blocks =
                [vec![0.0; s * s], vec![0.0; s * (n - s)], vec![0.0; (n - s) * s], vec![0.0; (n - s) * (n - s)]];
            for &(r, c, v) in operator.entries(i) {
                let (r, c) = (r as usize, c as usize);
                match (r < s, c < s) {
                    (true, true) => blocks[0][r * s + c] = v,
                    (true, false) => blocks[1][r * (n - s) + c - s] = v,
                    (false, true) => blocks[2][(r - s) * s + c] = v,
                    (false, false) => blocks[3][(r - s) * (n - s) + c - s] = v,
                }
            }
            let here = format!("{name}.{form}");
            let all = Value::Array(vec![want["coarse"].clone(), want["levels"].clone()]);
            if i == 0 {
                report.check_part(&format!("{here}.coarse"), &blocks[0], &want["coarse"], &all, TOL);
            }
            for (kind, block) in ["beta", "gamma", "alpha"].iter().zip(&blocks[1..]) {
                let at = &want["levels"][i][kind];
                report.check_part(&format!("{here}.levels[{i}].{kind}"), block, at, &all, TOL);
            }
            for (kind, values) in [("b", &gathered[i][..s]), ("w", &gathered[i][s..])] {
                let at = &want["gathered"][kind][i];
                report.check_part(&format!("{here}.gathered.{kind}[{i}]"), values, at, &want["gathered"], TOL);
            }
            if form == "symmetric" {
                for (kind, values) in [("b", &pulled[i][..s]), ("w", &pulled[i][s..])] {
                    let at = &entry["pull"][kind][i];
                    report.check_part(&format!("{name}.pull.{kind}[{i}]"), values, at, &entry["pull"], TOL);
                }
            }
        }
        report.check(&format!("{name}.{form}.result"), &operator.push(&gathered), &entry["result"], TOL);
    }
    Ok(())
}

fn mirrored(len: usize) -> Result<SplineSpace, String> {
    SplineSpace::new(SplineFamily::CUBIC, Boundary::Mirrored, len).map_err(|e| e.to_string())
}

/// Section `bspline_eval`.
pub(crate) fn bspline_eval(section: &Value, report: &mut Report) {
    const TOL: f64 = 1e-11;
    report.each("bspline_eval.curves", &section["curves"], |name, entry, report| {
        let b = field(entry, "b")?;
        let space = mirrored(b.len())?;
        let t = field(entry, "t")?;
        for (derivative, want) in ["value", "d1", "d2"].iter().enumerate() {
            let got: Vec<f64> = t.iter().map(|&t| space.eval(&b, t, derivative)).collect();
            report.check(&format!("{name}.{want}"), &got, &entry[want], TOL);
        }
        Ok(())
    });
    let cubic = SplineFamily::CUBIC;
    for (name, f) in [("psi", cubic.wavelet()), ("phi", cubic.scaling_function())] {
        let entry = &section[name];
        if let Ok(t) = field(entry, "t") {
            let got: Vec<f64> = t.iter().map(|&t| f.eval(t)).collect();
            report.check(&format!("bspline_eval.{name}.value"), &got, &entry["value"], TOL);
        }
    }
}

/// Section `frames`.
pub(crate) fn frames(section: &Value, report: &mut Report) {
    const TOL: f64 = 1e-11;
    let run = |report: &mut Report| -> Result<(), String> {
        let levels = whole(section, "L")?;
        let p = by_name("bspline", levels)?;
        let flat = field(section, "b_xyz")?;
        let n = p.len();
        if flat.len() != 3 * n || levels == 0 {
            return Err(format!("b_xyz has {} numbers, L = {levels} needs {}", flat.len(), 3 * n));
        }
        let points: Vec<[f64; 3]> = (0..n).map(|i| std::array::from_fn(|a| flat[a * n + i])).collect();
        let rung = p.rung(levels - 1);
        let (mut coarse, mut detail) = (vec![[0.0; 3]; rung.smooth()], vec![[0.0; 3]; rung.detail()]);
        rung.up(Kind::Coefficients, &points, &mut coarse, &mut detail);
        let by_axis: Vec<f64> = (0..3).flat_map(|a| coarse.iter().map(move |c| c[a])).collect();
        report.check("frames.coarse_b_xyz", &by_axis, &section["coarse_b_xyz"], TOL);
        let space = mirrored(coarse.len())?;
        report.each("frames.frames", &section["frames"], |name, entry, report| {
            let j = entry["j"].as_i64().ok_or("no j")?;
            let at = usize::try_from(j + 3).ok().filter(|i| *i < detail.len()).ok_or("j outside")?;
            // The centre of psi_{L-1,j} in level L units is 2 j + 7; the curve lives on level L - 1.
            let t = (2 * j + 7) as f64;
            report.check(&format!("{name}.t_level_L_units"), &[t], &entry["t_level_L_units"], TOL);
            let frame = Frame::new(space.eval(&coarse, t / 2.0, 1), space.eval(&coarse, t / 2.0, 2));
            let frame = frame.ok_or("the frame does not exist here")?;
            report.check(&format!("{name}.tangent"), &frame.tangent, &entry["tangent"], TOL);
            report.check(&format!("{name}.binormal"), &frame.binormal, &entry["binormal"], TOL);
            report.check(&format!("{name}.normal"), &frame.normal, &entry["normal_as_printed_TxB"], TOL);
            report.check(&format!("{name}.xyz"), &detail[at], &entry["xyz"], TOL);
            report.check(&format!("{name}.tnb"), &frame.to_frame(detail[at]), &entry["tnb"], TOL);
            Ok(())
        });
        Ok(())
    };
    if let Err(e) = run(report) {
        report.fail("frames", e);
    }
}

/// The mirrored energy matrix on level `level`, dense.
fn energy(level: usize, derivative: usize) -> Vec<f64> {
    let n = (1 << level) + 1;
    let mut out = vec![0.0; n * n];
    for (i, j, v) in gram::exact_energy(SplineFamily::CUBIC, Boundary::Mirrored, n, derivative) {
        out[i * n + j] = to_f64(&v);
    }
    out
}

/// `W^-T H W^-1`: both sides transformed as basis functions, flat order.
fn in_wavelets(p: &Pyramid, h: &[f64]) -> Result<Vec<f64>, String> {
    let tensor = Tensor::new(vec![p.clone(), p.clone()], Layout::Standard).map_err(|e| e.to_string())?;
    tensor.up(Kind::Basis, h).map(ondelette_wavelet::Decomposition::into_values).map_err(|e| e.to_string())
}

/// Section `hessian`.
pub(crate) fn hessian(section: &Value, report: &mut Report) {
    report.each("hessian.mirror_1d", &section["mirror_1d"], |name, entry, report| {
        let h = energy(count(entry, "L", DENSE)?, whole(entry, "a")?);
        report.check(&format!("{name}.matrix"), &h, &entry["matrix"], TOL);
        Ok(())
    });
    for (a, want) in section["stencils"].as_object().into_iter().flatten() {
        let got: Vec<f64> = gram::stencil(4, a.parse().unwrap_or(0)).iter().map(to_f64).collect();
        report.check(&format!("hessian.stencils[{a}]"), &got, want, TOL);
    }
    let two = &section["mirror_2d"];
    let run = |report: &mut Report| -> Result<(), String> {
        let level = count(two, "L", DENSE / 2)?;
        let n = (1 << level) + 1;
        let weight = |name: &str| two[name].as_f64().ok_or_else(|| format!("no {name}"));
        let (thin, stretch) = (weight("thin_plate_weight")?, weight("stretch_weight")?);
        let g: Vec<Vec<f64>> = (0..3).map(|a| energy(level, a)).collect();
        let mut out = vec![0.0; n * n * n * n];
        for (at, v) in out.iter_mut().enumerate() {
            let (i, j, k, l) = (at / (n * n * n), at / (n * n) % n, at / n % n, at % n);
            let (s, t) = (i * n + k, j * n + l);
            *v = thin * (g[2][s] * g[0][t] + 2.0 * g[1][s] * g[1][t] + g[0][s] * g[2][t])
                + stretch * (g[1][s] * g[0][t] + g[0][s] * g[1][t]);
        }
        report.check("hessian.mirror_2d.matrix", &out, &two["matrix"], TOL);
        Ok(())
    };
    if !two.is_null()
        && let Err(e) = run(report)
    {
        report.fail("hessian.mirror_2d", e);
    }
    report.each("hessian.wavelet_1d", &section["wavelet_1d"], |name, entry, report| {
        let level = count(entry, "L", DENSE)?;
        let p = by_name("bspline", level)?.with_scaling(sigma(entry)?);
        let h = in_wavelets(&p, &energy(level, whole(entry, "a")?))?;
        report.check(&format!("{name}.matrix"), &h, &entry["matrix"], TOL);
        Ok(())
    });
}

/// Energies of single functions of a pyramid, scaled.
fn diagonals(p: &Pyramid, derivative: usize) -> Result<(Vec<Vec<f64>>, Vec<Vec<f64>>), String> {
    let d = energy_diagonals(p, &gram::energy(p, derivative).ok_or("no energy")?);
    let times = |rows: Vec<Vec<f64>>, h: &dyn Fn(usize) -> f64| {
        let scale = |(i, row): (usize, Vec<f64>)| row.into_iter().map(|e| e * h(i) * h(i)).collect::<Vec<_>>();
        rows.into_iter().enumerate().map(scale).collect::<Vec<_>>()
    };
    Ok((times(d.smooth, &|i| p.heights().smooth(i)), times(d.detail, &|i| p.heights().detail(i))))
}

fn middle(x: &[f64]) -> f64 {
    x[x.len() / 2]
}

/// Section `scaling`.
pub(crate) fn scaling(section: &Value, report: &mut Report) {
    const TOL: f64 = 1e-9;
    report.each("scaling.diag_1d", &section["diag_1d"], |name, entry, report| {
        let p = by_name("bspline", whole(entry, "L")?)?.with_scaling(sigma(entry)?);
        let (smooth, detail) = diagonals(&p, whole(entry, "a")?)?;
        report.check(&format!("{name}.phi0"), &smooth[0], &entry["phi0"], TOL);
        for want in entry["levels"].as_array().into_iter().flatten() {
            let i = whole(want, "level")?;
            let Some(d) = detail.get(i) else { return Err(format!("no level {i}")) };
            report.check(&format!("{name}.levels[{i}].first"), &d[..1], &want["first"], TOL);
            report.check(&format!("{name}.levels[{i}].middle"), &[middle(d)], &want["middle"], TOL);
        }
        Ok(())
    });
    report.each("scaling.diag_2d", &section["diag_2d"], |name, entry, report| {
        let p = by_name("bspline", whole(entry, "L")?)?.with_scaling(sigma(entry)?);
        let d: Vec<_> = (0..3).map(|a| diagonals(&p, a)).collect::<Result<_, _>>()?;
        for want in entry["levels"].as_array().into_iter().flatten() {
            let i = whole(want, "level")?;
            if i >= p.levels() {
                return Err(format!("no level {i}"));
            }
            let energies = |c: char| [0, 1, 2].map(|a: usize| middle(if c == 'd' { &d[a].1[i] } else { &d[a].0[i] }));
            for kind in ["dd", "sd", "ds"] {
                let (f, g) = (energies(kind.as_bytes()[0] as char), energies(kind.as_bytes()[1] as char));
                let e = f[2] * g[0] + 2.0 * f[1] * g[1] + f[0] * g[2];
                report.check(&format!("{name}.levels[{i}].{kind}"), &[e], &want[kind], TOL);
            }
        }
        Ok(())
    });
    report.each("scaling.kappa_1d", &section["kappa_1d"], |name, entry, report| {
        let scaling: Scaling = sigma(entry)?;
        for (at, want) in entry["values"].as_array().into_iter().flatten().enumerate() {
            let level = whole(want, "L")?;
            if level > 9 {
                return Err(format!("L = {level} is too large for a dense eigenvalue problem"));
            }
            let p = by_name("bspline", level)?.with_scaling(scaling);
            let values = eigenvalues(in_wavelets(&p, &energy(level, 2))?, p.len());
            let kappa = values[values.len() - 1] / values[1];
            report.check(&format!("{name}.values[{at}].kappa"), &[kappa], &want["kappa"], 1e-4);
        }
        Ok(())
    });
}

/// Eigenvalues of a symmetric matrix in order, by Jacobi's rotations.
fn eigenvalues(mut a: Vec<f64>, n: usize) -> Vec<f64> {
    for _ in 0..60 {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i * n + j].powi(2)).sum();
        let all: f64 = (0..n).map(|i| a[i * n + i].powi(2)).sum();
        if off <= 1e-34 * all {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                let apq = a[p * n + q];
                if apq == 0.0 {
                    continue;
                }
                let theta = (a[q * n + q] - a[p * n + p]) / (2.0 * apq);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..n {
                    let (x, y) = (a[k * n + p], a[k * n + q]);
                    a[k * n + p] = c * x - s * y;
                    a[k * n + q] = s * x + c * y;
                }
                for k in 0..n {
                    let (x, y) = (a[p * n + k], a[q * n + k]);
                    a[p * n + k] = c * x - s * y;
                    a[q * n + k] = s * x + c * y;
                }
            }
        }
    }
    let mut out: Vec<f64> = (0..n).map(|i| a[i * n + i]).collect();
    out.sort_by(f64::total_cmp);
    out
}
