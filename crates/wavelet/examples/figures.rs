//! Draws the pictures of docs/guide/wavelets.md: the thesis's figures 1 to 11 anew, and the pyramid of a picture.
//!
//! `cargo run --release -p ondelette-wavelet --example figures -- docs/guide/pictures`

use std::fmt::Write as _;
use std::path::Path;

use ondelette_wavelet::exact::{ratio, to_f64};
use ondelette_wavelet::{
    Boundary, Family, Kind, Layout, OpenColumns, Piecewise, Pyramid, SplineFamily, SplineSpace, Tensor, cascade,
};

type Curve = Vec<(f64, f64)>;

/// One panel: a title and curves.
struct Panel {
    title: String,
    curves: Vec<Curve>,
}

const COLOURS: [&str; 6] = ["#0b6e99", "#c8553d", "#588157", "#7b4b94", "#b08900", "#444444"];

/// Panels under each other, each scaled to its own curves.
fn svg(panels: &[Panel]) -> String {
    let (width, height, gap) = (640.0, 110.0, 34.0);
    let total = panels.len() as f64 * (height + gap) + 10.0;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {total}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (i, panel) in panels.iter().enumerate() {
        let top = 24.0 + i as f64 * (height + gap);
        let points = || panel.curves.iter().flatten();
        let range = |f: fn(&(f64, f64)) -> f64| {
            points().map(f).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
        };
        let ((x0, x1), (y0, y1)) = (range(|p| p.0), range(|p| p.1));
        let (y0, y1) = (y0.min(0.0), y1.max(y0 + 1e-9));
        let place = |p: &(f64, f64)| {
            (10.0 + (p.0 - x0) / (x1 - x0) * (width - 20.0), top + height - (p.1 - y0) / (y1 - y0) * height)
        };
        let axis = place(&(x0, 0.0)).1;
        // Writing to a String cannot fail.
        let _ = writeln!(out, "<text x=\"10\" y=\"{:.0}\" fill=\"#333\">{}</text>", top - 8.0, panel.title);
        let _ = writeln!(out, "<path d=\"M10 {axis:.1}H{}\" stroke=\"#bbb\"/>", width - 10.0);
        for (k, curve) in panel.curves.iter().enumerate() {
            let mut d = String::new();
            for (j, p) in curve.iter().enumerate() {
                let (x, y) = place(p);
                let _ = write!(d, "{}{x:.1} {y:.1}", if j == 0 { "M" } else { "L" });
            }
            let colour = COLOURS[k % COLOURS.len()];
            let _ = writeln!(out, "<path d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"/>");
        }
    }
    out + "</svg>\n"
}

fn sampled(f: impl Fn(f64) -> f64, from: f64, to: f64) -> Curve {
    let n = 480;
    (0..=n).map(|i| from + (to - from) * f64::from(i) / f64::from(n)).map(|t| (t, f(t))).collect()
}

fn panel(title: &str, curves: Vec<Curve>) -> Panel {
    Panel { title: title.to_owned(), curves }
}

fn of(f: &Piecewise) -> Curve {
    let (a, b) = f.support().unwrap_or((0.0, 1.0));
    sampled(|t| f.eval(t), a, b)
}

/// Uniform B-splines of an order, translated.
fn splines(order: i64, count: i64) -> Vec<Curve> {
    let phi = Piecewise::bspline(&(0..=order).collect::<Vec<_>>());
    (0..count).map(|k| of(&phi.transformed(&ratio(1, 1), &ratio(k, 1)))).collect()
}

/// A wavelet-basis function of a pyramid as a function, given its place in flat order.
fn function(pyramid: &Pyramid, space: &SplineSpace, at: usize) -> Result<Curve, Box<dyn std::error::Error>> {
    let mut flat = vec![0.0; pyramid.len()];
    flat[at] = 1.0;
    let c = pyramid.synthesize(&flat)?;
    Ok(sampled(|t| space.eval(&c, t, 0), 0.0, space.spans() as f64))
}

/// A dual wavelet as its values on the finest level: column `at` of W^T, in the density of the finest functions.
fn dual(family: SplineFamily, levels: usize) -> Result<Curve, Box<dyn std::error::Error>> {
    let len = 16 << levels;
    let pyramid = Pyramid::new(Family::Spline(family), Boundary::Periodic, len, levels)?;
    let mut flat = vec![0.0; len];
    flat[16 + 8] = 1.0;
    let c = pyramid.down(Kind::Basis, &{
        // The wavelet of level 0 follows the 16 smooth coefficients.
        flat
    })?;
    let per_unit = (1 << levels) as f64;
    Ok(c.iter().enumerate().map(|(i, v)| (i as f64 / per_unit, v * per_unit)).collect())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: figures FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let write = |name: &str, panels: &[Panel]| std::fs::write(folder.join(name), svg(panels));

    // Figures 1 to 3.
    write(
        "bases.svg",
        &[
            panel(
                "Boxes (figure 2)",
                (0..8)
                    .map(|k| vec![(k as f64, 0.0), (k as f64, 1.0), (k as f64 + 1.0, 1.0), (k as f64 + 1.0, 0.0)])
                    .collect(),
            ),
            panel("Hats (figure 1)", splines(2, 7)),
            panel("Uniform cubic B-splines (figure 3)", splines(4, 7)),
        ],
    )?;

    // Figures 4 and 5: boxes replaced by wider boxes and Haar functions, level by level.
    let step = |values: &[f64]| {
        values.iter().enumerate().flat_map(|(i, &v)| [(i as f64, v), (i as f64 + 1.0, v)]).collect::<Curve>()
    };
    let haar = |levels: usize| -> Result<Vec<Curve>, Box<dyn std::error::Error>> {
        let p = Pyramid::new(Family::Haar, Boundary::Periodic, 8, levels)?;
        (0..8)
            .map(|at| {
                let mut flat = vec![0.0; 8];
                flat[at] = 1.0;
                let offset = at as f64 * 2.4;
                Ok(step(&p.synthesize(&flat)?).into_iter().map(|(t, v)| (t, v - offset)).collect())
            })
            .collect()
    };
    let mut panels = Vec::new();
    for levels in 0..=3 {
        panels.push(panel(&format!("Eight functions after {levels} steps (figure 5)"), haar(levels)?));
    }
    write("haar.svg", &panels)?;

    // Figures 6 to 8: phi, psi and duals.
    let cubic = SplineFamily::CUBIC;
    let (phi, psi) = (cubic.scaling_function(), cubic.wavelet());
    let wide = phi.transformed(&ratio(1, 2), &ratio(0, 1));
    let h = cubic.filters().h;
    let parts = h
        .coef
        .iter()
        .enumerate()
        .map(|(k, c)| sampled(|t| to_f64(c) * phi.eval(t - k as f64), k as f64, k as f64 + 4.0));
    write(
        "phi-psi.svg",
        &[
            panel(
                "The wide B-spline is a sum of five narrow ones (figure 6)",
                std::iter::once(of(&wide)).chain(parts).collect(),
            ),
            panel("The wavelet psi on [0, 14] (figure 7)", vec![of(&psi)]),
            panel("Dual wavelet of (4, 6): converges", vec![dual(SplineFamily::CUBIC6, 7)?]),
            panel(
                "Dual wavelet of (4, 4) after 4 and 7 levels: no square-integrable limit (figure 8)",
                vec![dual(cubic, 7)?, dual(cubic, 4)?],
            ),
        ],
    )?;

    // Figures 9 and 10: boundary functions, mirrored and open.
    let ends = |boundary, len| -> Result<Vec<Curve>, Box<dyn std::error::Error>> {
        let space = SplineSpace::new(cubic, boundary, len)?;
        Ok((0..5).map(|i| sampled(|t| space.function(i).eval(t), 0.0, 8.0)).collect())
    };
    let mirrored = Pyramid::new(Family::Spline(cubic), Boundary::Mirrored, 33, 1)?;
    let open = Pyramid::open(35, 1, OpenColumns::Unit)?;
    let wavelets = |p: &Pyramid, boundary| -> Result<Vec<Curve>, Box<dyn std::error::Error>> {
        let space = SplineSpace::new(cubic, boundary, p.len())?;
        (0..4).map(|j| function(p, &space, p.smooth_len(0) + j)).collect()
    };
    write(
        "ends.svg",
        &[
            panel("Mirrored B-splines at the left end (figures 9, 10)", ends(Boundary::Mirrored, 9)?),
            panel("Open B-splines at the left end: quadruple knots", ends(Boundary::Open, 11)?),
            panel(
                "Mirrored wavelets: zero slope at the end, one vanishing moment there",
                wavelets(&mirrored, Boundary::Mirrored)?,
            ),
            panel("Open semi-orthogonal wavelets: four vanishing moments", wavelets(&open, Boundary::Open)?),
        ],
    )?;

    // Figure 11: the complete wavelet basis.
    let p = Pyramid::new(Family::Spline(cubic), Boundary::Mirrored, 17, 4)?;
    let space = SplineSpace::new(cubic, Boundary::Mirrored, 17)?;
    let mut panels = vec![panel(
        "The two B-splines of level 0 (figure 11)",
        vec![function(&p, &space, 0)?, function(&p, &space, 1)?],
    )];
    for level in 0..4 {
        let curves = p.detail_range(level).map(|at| function(&p, &space, at)).collect::<Result<_, _>>()?;
        panels.push(panel(&format!("Wavelets of level {level}"), curves));
    }
    write("basis.svg", &panels)?;

    // Daubechies by the cascade.
    let curve = |values: &[f64]| values.iter().enumerate().map(|(i, v)| (i as f64 / 64.0, *v)).collect::<Curve>();
    let mut panels = Vec::new();
    for family in [Family::Daubechies(4), Family::Daubechies(8), Family::Cdf97] {
        let (phi, psi) = cascade(family, 6).ok_or("no cascade")?;
        panels.push(panel(&format!("{family}: phi and psi"), vec![curve(&phi), curve(&psi)]));
    }
    write("daubechies.svg", &panels)?;

    // Figure 12: the non-standard pyramid of a picture.
    let n = 256;
    let scene = |x: f64, y: f64| {
        let disc = f64::from(u8::from((x - 0.35).hypot(y - 0.4) < 0.22));
        let stripes = 0.5 + 0.5 * (40.0 * (x + 0.6 * y) * (0.3 + y)).sin();
        0.25 + 0.45 * disc + if x > 0.62 { 0.3 * stripes } else { 0.15 * y }
    };
    let grid: Vec<f64> = (0..n * n).map(|i| scene((i % n) as f64 / 255.0, (i / n) as f64 / 255.0)).collect();
    let axis = Pyramid::new(Family::Spline(cubic), Boundary::Mirrored, n, 3)?;
    let tensor = Tensor::new(vec![axis.clone(), axis], Layout::NonStandard)?;
    let wavelets = tensor.analyze(&grid)?;
    let corner = tensor.axes()[0].smooth_len(0);
    let picture = image::GrayImage::from_fn(2 * n as u32 + 8, n as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let v = if x < n {
            grid[y * n + x]
        } else if x < n + 8 {
            1.0
        } else {
            let (x, v) = (x - n - 8, wavelets.values()[y * n + x - n - 8]);
            if x < corner && y < corner { v } else { 0.5 + 2.0 * v }
        };
        image::Luma([(v.clamp(0.0, 1.0) * 255.0).round() as u8])
    });
    picture.save(folder.join("pyramid.png"))?;
    Ok(())
}
