//! Draws the pictures of docs/guide/wavelets.md: the thesis's figures 1 to 12 anew, and some more.
//!
//! `cargo run --release -p ondelette-wavelet --example figures -- docs/guide/pictures`

mod draw;

use std::path::Path;

use draw::{Curve, Panel, svg};
use ondelette_wavelet::exact::{ratio, to_f64};
use ondelette_wavelet::{
    Boundary, Family, Kind, Layout, OpenColumns, Piecewise, Pyramid, SplineFamily, SplineSpace, Tensor, cascade,
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const CUBIC: SplineFamily = SplineFamily::CUBIC;
/// Coefficients of the functions that the first figures draw.
const HEIGHTS: [f64; 8] = [0.5, 0.9, 0.7, 1.2, 1.5, 1.1, 0.6, 0.8];

fn sampled(f: impl Fn(f64) -> f64, from: f64, to: f64) -> Curve {
    let n = 480;
    (0..=n).map(|i| from + (to - from) * f64::from(i) / f64::from(n)).map(|t| (t, f(t))).collect()
}

fn of(f: &Piecewise) -> Curve {
    let (a, b) = f.support().unwrap_or((0.0, 1.0));
    sampled(|t| f.eval(t), a, b)
}

/// Constant on unit cells.
fn steps(values: &[f64]) -> Curve {
    values.iter().enumerate().flat_map(|(i, &v)| [(i as f64, v), (i as f64 + 1.0, v)]).collect()
}

/// A box of the given height on `from..to`.
fn block(from: f64, to: f64, height: f64) -> Curve {
    vec![(from, 0.0), (from, height), (to, height), (to, 0.0)]
}

/// Figures 1 to 3: functions with coefficients, and what they add up to.
fn bases() -> Vec<Panel> {
    let hat = |k: usize, h: f64| vec![(k as f64 - 1.0, 0.0), (k as f64, h), (k as f64 + 1.0, 0.0)];
    let weighted =
        |f: &dyn Fn(usize, f64) -> Curve| HEIGHTS.iter().enumerate().map(|(k, &h)| f(k, h)).collect::<Vec<_>>();
    let ends = [(-1.0, 0.0), (HEIGHTS.len() as f64, 0.0)];
    let mut hats: Curve = HEIGHTS.iter().enumerate().map(|(k, &h)| (k as f64, h)).chain(ends).collect();
    hats.sort_by(|a, b| a.0.total_cmp(&b.0));
    let phi = Piecewise::bspline(&[0, 1, 2, 3, 4]);
    vec![
        Panel::new("Hats add up to a piecewise linear function (figure 1)").thin(weighted(&hat)).bold(hats),
        Panel::new("Boxes add up to a piecewise constant function (figure 2)")
            .thin(weighted(&|k, h| block(k as f64, k as f64 + 1.0, h)))
            .bold(steps(&HEIGHTS)),
        Panel::new("Uniform cubic B-splines (figure 3)")
            .thin((0..7).map(|k| of(&phi.transformed(&ratio(1, 1), &ratio(k, 1))))),
    ]
}

/// Figure 4: two boxes, or a wider box and a Haar function.
fn haar_step() -> Vec<Panel> {
    let (a, b) = (0.5, 1.5);
    let (mean, half) = ((a + b) / 2.0, (a - b) / 2.0);
    let sum = || vec![(0.0, a), (1.0, a), (1.0, b), (2.0, b)];
    let haar = vec![(0.0, 0.0), (0.0, half), (1.0, half), (1.0, -half), (2.0, -half), (2.0, 0.0)];
    vec![
        Panel::new("Two boxes ... (figure 4)").thin([block(0.0, 1.0, a), block(1.0, 2.0, b)]).bold(sum()),
        Panel::new("... or a wider box and a Haar function").thin([block(0.0, 2.0, mean), haar]).bold(sum()),
    ]
}

/// Figure 5: all boxes replaced, level by level.
fn haar() -> Result<Vec<Panel>> {
    let functions = |levels: usize| -> Result<Vec<Curve>> {
        let p = Pyramid::new(Family::Haar, Boundary::Periodic, 8, levels)?;
        (0..8)
            .map(|at| {
                let mut flat = vec![0.0; 8];
                flat[at] = 1.0;
                let offset = at as f64 * 2.4;
                Ok(steps(&p.synthesize(&flat)?).into_iter().map(|(t, v)| (t, v - offset)).collect())
            })
            .collect()
    };
    (0..=3)
        .map(|levels| {
            let title = ["The boxes", "one step", "two steps", "three: Haar"][levels];
            Ok(Panel::new(title).thin(functions(levels)?))
        })
        .collect()
}

/// The function of one wavelet coefficient, `at` in flat order, times `by`, on `range`.
fn function(p: &Pyramid, boundary: Boundary, at: usize, by: f64, range: (f64, f64)) -> Result<Curve> {
    let space = SplineSpace::new(CUBIC, boundary, p.len())?;
    let mut flat = vec![0.0; p.len()];
    flat[at] = by;
    let c = p.synthesize(&flat)?;
    Ok(sampled(|t| space.eval(&c, t, 0), range.0, range.1))
}

/// Figures 6 to 8: two-scale relations of (4, 4).
fn two_scale() -> Result<Vec<Panel>> {
    let (phi, psi) = (CUBIC.scaling_function(), CUBIC.wavelet());
    let parts = |s: &ondelette_wavelet::exact::Sequence| {
        let (first, taps) = (s.first, s.coef.iter().map(to_f64).collect::<Vec<_>>());
        let phi = phi.clone();
        taps.into_iter().enumerate().map(move |(k, c)| {
            let start = (first + k as isize) as f64;
            sampled(|t| c * phi.eval(t - start), start, start + 4.0)
        })
    };
    let aligned = |f: Curve, parts: Vec<Curve>| {
        // The sum of the parts, sampled like the function.
        let (a, b) = (parts[0][0].0, parts[parts.len() - 1][480].0);
        let shift = a - f[0].0;
        let f: Curve = f.into_iter().map(|(t, v)| (t + shift, v)).collect();
        debug_assert!((f[480].0 - b).abs() < 1e-9);
        (f, parts)
    };
    let filters = CUBIC.filters();
    let wide = of(&phi.transformed(&ratio(1, 2), &ratio(0, 1)));
    let (wide, five) = aligned(wide, parts(&filters.h).collect());
    let (wave, eleven) = aligned(of(&psi), parts(&filters.g).collect());
    let p = Pyramid::new(Family::Spline(CUBIC), Boundary::Mirrored, 65, 1)?;
    let space = SplineSpace::new(CUBIC, Boundary::Mirrored, 65)?;
    let mut panels = vec![
        Panel::new("Five B-splines, with the weights h, make one of twice the width (figure 6)").thin(five).bold(wide),
        Panel::new("Eleven B-splines, with the weights g, make the wavelet (figure 7)").thin(eleven).bold(wave),
    ];
    for at in [32, 33] {
        let mut fine = vec![0.0_f64; 65];
        fine[at] = 1.0;
        let flat = p.analyze(&fine)?;
        let range = (at as f64 - 12.0, at as f64 + 12.0);
        let (mut splines, mut waves) = (Vec::new(), Vec::new());
        for (i, &c) in flat.iter().enumerate().filter(|(_, c)| c.abs() > 1e-12) {
            let part = function(&p, Boundary::Mirrored, i, c, range)?;
            if i < p.smooth_len(0) { splines.push(part) } else { waves.push(part) }
        }
        let title =
            format!("A B-spline from {} wide ones (grey) and {} wavelets (figure 8)", splines.len(), waves.len());
        let own = sampled(|t| space.eval(&fine, t, 0), range.0, range.1);
        panels.push(Panel::new(title).faint(splines).thin(waves).bold(own));
    }
    Ok(panels)
}

/// A dual wavelet as its values on the finest level: column `at` of W^T, in the density of the finest functions.
fn dual(family: SplineFamily, levels: usize) -> Result<Curve> {
    let len = 16 << levels;
    let pyramid = Pyramid::new(Family::Spline(family), Boundary::Periodic, len, levels)?;
    let mut flat = vec![0.0; len];
    // The wavelets of level 0 follow the 16 smooth coefficients.
    flat[16 + 8] = 1.0;
    let c = pyramid.down(Kind::Basis, &flat)?;
    let per_unit = (1 << levels) as f64;
    let curve = c.iter().enumerate().map(|(i, v)| (i as f64 / per_unit, v * per_unit));
    Ok(curve.filter(|(t, _)| (5.5..=11.5).contains(t)).collect())
}

fn duals() -> Result<Vec<Panel>> {
    Ok(vec![
        Panel::new("Dual wavelet of (4, 6): converges").thin([dual(SplineFamily::CUBIC6, 6)?]),
        Panel::new("Dual wavelet of (4, 4) after 4 levels ...").thin([dual(CUBIC, 4)?]),
        Panel::new("... and after 7: no square-integrable limit").thin([dual(CUBIC, 7)?]),
    ])
}

/// Figures 9 and 10: what mirroring means.
fn mirrors() -> Result<Vec<Panel>> {
    let n = 9;
    let space = SplineSpace::new(CUBIC, Boundary::Mirrored, n)?;
    let fold = |t: f64| {
        let m = t.rem_euclid(16.0);
        if m > 8.0 { 16.0 - m } else { m }
    };
    let c = [1.0, 0.4, 0.7, 1.3, 1.6, 0.9, 0.5, 0.8, 1.4];
    let all = sampled(|t| space.eval(&c, fold(t), 0), -8.0, 16.0);
    let dots = (-8..=16).map(|k| (f64::from(k), c[fold(f64::from(k)) as usize])).collect();
    let mut panels = vec![
        Panel::new("A function on an interval, mirrored at both ends; so are its coefficients (figure 9)")
            .faint([all])
            .bold(sampled(|t| space.eval(&c, t, 0), 0.0, 8.0))
            .dots(dots)
            .marks(&[0.0, 8.0]),
    ];
    for (i, title) in [
        (4, "A basis function is one B-spline with all its mirror images (figure 10)"),
        (1, "Near an end the copies overlap and are added"),
        (0, "On the end both are the same: it counts once"),
    ] {
        let f = space.function(i);
        panels.push(
            Panel::new(title)
                .faint([sampled(|t| f.eval(fold(t)), -8.0, 16.0)])
                .bold(sampled(|t| f.eval(t), 0.0, 8.0))
                .marks(&[0.0, 8.0]),
        );
    }
    Ok(panels)
}

/// Functions at the left end, mirrored and open.
fn ends() -> Result<Vec<Panel>> {
    let splines = |boundary, len| -> Result<Vec<Curve>> {
        let space = SplineSpace::new(CUBIC, boundary, len)?;
        Ok((0..5).map(|i| sampled(|t| space.function(i).eval(t), 0.0, 7.0)).collect())
    };
    let mirrored = Pyramid::new(Family::Spline(CUBIC), Boundary::Mirrored, 33, 1)?;
    let open = Pyramid::open(35, 1, OpenColumns::Unit)?;
    let waves = |p: &Pyramid, boundary| -> Result<Vec<Curve>> {
        (0..4).map(|j| function(p, boundary, p.smooth_len(0) + j, 1.0, (0.0, 14.0))).collect()
    };
    Ok(vec![
        Panel::new("Mirrored B-splines: slope zero").thin(splines(Boundary::Mirrored, 9)?),
        Panel::new("Open B-splines: quadruple knots").thin(splines(Boundary::Open, 11)?),
        Panel::new("Mirrored wavelets: 1 vanishing moment here").thin(waves(&mirrored, Boundary::Mirrored)?),
        Panel::new("Open wavelets: 4 vanishing moments").thin(waves(&open, Boundary::Open)?),
    ])
}

/// Figure 11: the complete wavelet basis.
fn basis() -> Result<Vec<Panel>> {
    let p = Pyramid::new(Family::Spline(CUBIC), Boundary::Mirrored, 17, 4)?;
    let draw = |at| function(&p, Boundary::Mirrored, at, 1.0, (0.0, 16.0));
    let mut panels = vec![Panel::new("Two B-splines on level 0 (figure 11) ...").thin([draw(0)?, draw(1)?])];
    for level in 0..4 {
        let curves = p.detail_range(level).map(draw).collect::<Result<Vec<_>>>()?;
        let title = match level {
            0 => "... one wavelet on level 0".to_owned(),
            _ => format!("{} wavelets on level {level}", curves.len()),
        };
        panels.push(Panel::new(title).thin(curves));
    }
    Ok(panels)
}

/// Functions without formula, by the cascade.
fn daubechies() -> Result<Vec<Panel>> {
    let curve = |values: &[f64]| values.iter().enumerate().map(|(i, v)| (i as f64 / 64.0, *v)).collect::<Curve>();
    [Family::Daubechies(4), Family::Daubechies(8), Family::Daubechies(20), Family::Cdf97]
        .into_iter()
        .map(|family| {
            let (phi, psi) = cascade(family, 6).ok_or("no cascade")?;
            Ok(Panel::new(format!("{family}: phi (blue), psi")).thin([curve(&phi), curve(&psi)]))
        })
        .collect()
}

/// Figure 12: the non-standard pyramid of a picture.
fn pyramid() -> Result<image::GrayImage> {
    let n = 384;
    let scene = |x: f64, y: f64| {
        let disc = f64::from(u8::from((x - 0.35).hypot(y - 0.4) < 0.22));
        let stripes = 0.5 + 0.5 * (40.0 * (x + 0.6 * y) * (0.3 + y)).sin();
        0.25 + 0.45 * disc + if x > 0.62 { 0.3 * stripes } else { 0.15 * y }
    };
    let unit = |i: usize| i as f64 / (n - 1) as f64;
    let grid: Vec<f64> = (0..n * n).map(|i| scene(unit(i % n), unit(i / n))).collect();
    let axis = Pyramid::new(Family::Spline(CUBIC), Boundary::Mirrored, n, 3)?;
    let tensor = Tensor::new(vec![axis.clone(), axis], Layout::NonStandard)?;
    let wavelets = tensor.analyze(&grid)?;
    let corner = tensor.axes()[0].smooth_len(0);
    Ok(image::GrayImage::from_fn(2 * n as u32 + 12, n as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let v = if x < n {
            grid[y * n + x]
        } else if x < n + 12 {
            1.0
        } else {
            let (x, v) = (x - n - 12, wavelets.values()[y * n + x - n - 12]);
            if x < corner && y < corner { v } else { 0.5 + 2.0 * v }
        };
        image::Luma([(v.clamp(0.0, 1.0) * 255.0).round() as u8])
    }))
}

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).ok_or("usage: figures FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    for (name, panels, columns) in [
        ("bases.svg", bases(), 1),
        ("haar-step.svg", haar_step(), 2),
        ("haar.svg", haar()?, 4),
        ("two-scale.svg", two_scale()?, 1),
        ("duals.svg", duals()?, 1),
        ("mirrors.svg", mirrors()?, 1),
        ("ends.svg", ends()?, 2),
        ("basis.svg", basis()?, 1),
        ("daubechies.svg", daubechies()?, 2),
    ] {
        std::fs::write(folder.join(name), svg(&panels, columns)?)?;
    }
    pyramid()?.save(folder.join("pyramid.png"))?;
    Ok(())
}
