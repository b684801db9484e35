//! `ondelette probe`: points in, values out.

use super::{Outcome, Refusal, print, tell};
use crate::args::ProbeArgs;
use crate::plan::check_distinct;
use glam::DVec3;
use ondelette_io::onl::read_solution;
use ondelette_io::write::{AtomicFile, check_writable, push_row};
use ondelette_numerics::par;
use ondelette_radiosity::probe::{Prober, REACH};
use ondelette_radiosity::{DirectLight, Solution};
use std::io::Write;
use std::path::Path;

const COLUMNS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];
const VALUES: &str = "irradiance_r,irradiance_g,irradiance_b,radiosity_r,radiosity_g,radiosity_b";
/// Points that one thread answers at a time.
const CHUNK: usize = 2048;
/// Rows printed before they are written.
const BATCH: usize = 64 * CHUNK;
/// Offending lines that are listed.
const LISTED: usize = 10;

/// A point with a normal, and where it was written.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    line: u32,
    numbers: [f64; 6],
}

impl Point {
    fn position(&self) -> DVec3 {
        DVec3::new(self.numbers[0], self.numbers[1], self.numbers[2])
    }

    fn normal(&self) -> DVec3 {
        DVec3::new(self.numbers[3], self.numbers[4], self.numbers[5])
    }
}

/// What was found at a point: irradiance, and radiosity if it is on a surface.
type Answer = ([f64; 3], Option<[f64; 3]>);

pub(crate) fn run(args: &ProbeArgs) -> Result<Outcome, Refusal> {
    if let Some(path) = &args.output {
        check_distinct(&[&args.solution, &args.points], &[path])?;
        check_writable(path)?;
    }
    let points = read_points(&args.points)?;
    let solution = read_solution(&args.solution)?;
    if !solution.is_finished() {
        let percent = 100.0 * solution.statistics().estimated_error;
        tell(format_args!("note: {} is unfinished; its estimated error is {percent:.3} %", args.solution.display()));
    }
    let answers = answer(&solution, &points, args)?;
    refuse_points_off_surfaces(&args.points, &solution, &points, &answers)?;

    let header = format!("{},{VALUES}\n", COLUMNS.join(","));
    match &args.output {
        Some(path) => {
            let mut file = AtomicFile::create(path)?;
            let refused = |e| Refusal::new(format!("cannot write {}: {e}", path.display()));
            file.write_all(header.as_bytes()).map_err(refused)?;
            for batch in (0..points.len()).step_by(BATCH) {
                file.write_all(rows(&points, &answers, batch).as_bytes()).map_err(refused)?;
            }
            file.commit()?;
        }
        None => {
            print(&header)?;
            for batch in (0..points.len()).step_by(BATCH) {
                print(&rows(&points, &answers, batch))?;
            }
        }
    }
    Ok(Outcome::Done)
}

fn answer(solution: &Solution, points: &[Point], args: &ProbeArgs) -> Result<Vec<Option<Answer>>, Refusal> {
    let prober = match args.direct {
        None => Prober::new(solution),
        Some(direct) => Prober::reading(solution, direct.into()).ok_or_else(|| {
            let why = if solution.settings().direct == DirectLight::Gathered {
                "it was stopped before all of its direct light was known: solve it for longer"
            } else {
                "it did not keep what --direct gather needs: solve it again with --direct gather"
            };
            Refusal::new(format!("{}: {why}", args.solution.display()))
        })?,
    };
    let chunks = par::map(points.len().div_ceil(CHUNK), |chunk| {
        let own = &points[chunk * CHUNK..points.len().min((chunk + 1) * CHUNK)];
        let one = |p: &Point| -> Option<Answer> {
            let (position, normal) = (p.position(), p.normal().normalize());
            if args.gather {
                return Some((prober.gather(position, normal).0, None));
            }
            let (side, at) = prober.find(position, normal)?;
            let irradiance = prober.irradiance(side, at);
            let material = solution.scene().material(solution.scene().sides[side]);
            let radiosity = material.radiance * std::f64::consts::PI + material.reflectance * irradiance;
            Some((irradiance.0, Some(radiosity.0)))
        };
        own.iter().map(one).collect::<Vec<_>>()
    });
    Ok(chunks.into_iter().flatten().collect())
}

fn refuse_points_off_surfaces(
    path: &Path,
    solution: &Solution,
    points: &[Point],
    answers: &[Option<Answer>],
) -> Result<(), Refusal> {
    let off: Vec<&Point> = points.iter().zip(answers).filter(|(_, a)| a.is_none()).map(|(p, _)| p).collect();
    if off.is_empty() {
        return Ok(());
    }
    let reach = REACH * solution.scene().diagonal();
    let (n, of) = (off.len(), points.len());
    let mut message = format!(
        "{}: on no surface that faces the normal (within {reach:.2e} units): {n} of {of} points; nothing was written; \
         for free points use --gather",
        path.display(),
    );
    for p in off.iter().take(LISTED) {
        let [x, y, z, nx, ny, nz] = p.numbers;
        message += &format!("\n  line {}: point {x},{y},{z} normal {nx},{ny},{nz}", p.line);
    }
    if n > LISTED {
        message += &format!("\n  and {} more", n - LISTED);
    }
    Err(Refusal::new(message))
}

/// The rows of one batch, printed in parallel.
fn rows(points: &[Point], answers: &[Option<Answer>], batch: usize) -> String {
    let end = points.len().min(batch + BATCH);
    let chunks = par::map((end - batch).div_ceil(CHUNK), |chunk| {
        let mut text = String::new();
        let from = batch + chunk * CHUNK;
        for k in from..end.min(from + CHUNK) {
            let Some((irradiance, radiosity)) = answers[k] else { continue };
            let mut row = [0.0; 12];
            row[..6].copy_from_slice(&points[k].numbers);
            row[6..9].copy_from_slice(&irradiance);
            match radiosity {
                Some(radiosity) => {
                    row[9..].copy_from_slice(&radiosity);
                    push_row(&mut text, &row, 0);
                }
                None => push_row(&mut text, &row[..9], 3),
            }
        }
        text
    });
    chunks.concat()
}

fn read_points(path: &Path) -> Result<Vec<Point>, Refusal> {
    let bytes = std::fs::read(path).map_err(|e| Refusal::new(format!("{}: cannot be read: {e}", path.display())))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
        Refusal::new(format!("{}:{line}: not a text file (no UTF-8)", path.display()))
    })?;
    parse_points(&text).map_err(|(line, what)| Refusal::new(format!("{}:{line}: {what}", path.display())))
}

/// Points with the number of their line, or the line and what is wrong with it.
fn parse_points(text: &str) -> Result<Vec<Point>, (u32, String)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut points = Vec::new();
    let mut first = true;
    for (line, row) in (1u32..).zip(text.lines()) {
        let row = row.trim();
        if row.is_empty() {
            continue;
        }
        let is_first = std::mem::replace(&mut first, false);
        if is_first && row.split(',').map(|name| name.trim().trim_matches('"')).eq(COLUMNS) {
            continue;
        }
        let count = row.split(',').count();
        if count != 6 {
            return Err((line, format!("{count} columns where x,y,z,nx,ny,nz are wanted")));
        }
        let mut numbers = [0.0; 6];
        for (k, field) in row.split(',').enumerate() {
            numbers[k] = match field.trim().parse::<f64>() {
                Ok(number) if number.is_finite() => number,
                Ok(number) => return Err((line, format!("{} is {number}: give a finite number", COLUMNS[k]))),
                Err(_) if is_first => {
                    return Err((
                        line,
                        format!("'{}' is no number, and the header would be x,y,z,nx,ny,nz", field.trim()),
                    ));
                }
                Err(_) => return Err((line, format!("{}: '{}' is no number", COLUMNS[k], field.trim()))),
            };
        }
        let point = Point { line, numbers };
        if point.normal().try_normalize().is_none() {
            return Err((line, "the normal is zero: it must say which side is meant".into()));
        }
        points.push(point);
    }
    if points.is_empty() {
        return Err((1, "there are no points in it".into()));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_blank_lines_and_foreign_line_ends_are_no_points() {
        let rows = "1,2,3,0,0,1\r\n\r\n -1e-3 , 0.1,+4,0,2,0\n";
        for text in
            [rows.to_owned(), format!("x,y,z,nx,ny,nz\n{rows}"), format!("\u{feff}x, y, z, nx, ny, nz\r\n{rows}")]
        {
            let points = parse_points(&text).unwrap();
            assert_eq!(points.len(), 2);
            assert_eq!(points[1].numbers, [-1e-3, 0.1, 4.0, 0.0, 2.0, 0.0]);
        }
        assert_eq!(parse_points(rows).unwrap()[1].line, 3);
    }

    #[test]
    fn every_bad_line_is_named_with_its_number() {
        for (text, line, said) in [
            ("x,y,z,nx,ny,nz\n1,2,3,0,0,1\n1,2,3,0,0\n", 3, "5 columns"),
            ("1,2,3,0,0,1,7\n", 1, "7 columns"),
            ("1,2,3,0,0,1\n1,NaN,3,0,0,1\n", 2, "y is NaN"),
            ("1,2,3,0,0,1\n1,2,inf,0,0,1\n", 2, "z is inf"),
            ("1,2,3,0,0,1\n1,2,3,0,0,0\n", 2, "normal is zero"),
            ("1,2,3,0,0,1\n1,2,3,0,up,0\n", 2, "ny: 'up'"),
            ("nx,ny,nz,x,y,z\n1,2,3,0,0,1\n", 1, "header would be"),
            ("x,y,z,nx,ny,nz\nx,y,z,nx,ny,nz\n", 2, "no number"),
            ("x,y,z,nx,ny,nz\n", 1, "no points"),
            ("", 1, "no points"),
        ] {
            let (at, what) = parse_points(text).unwrap_err();
            assert!(at == line && what.contains(said), "{text:?}: line {at}: {what}");
        }
    }
}
