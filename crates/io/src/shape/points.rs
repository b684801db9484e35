//! Points as text: comma-separated tables and airfoil outlines (.dat).

/// Points of a text file.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// Number of coordinates, 1 to 3.
    pub dim: usize,
    /// The points; coordinates past `dim` are 0.
    pub points: Vec<[f64; 3]>,
}

/// Most points of a file.
const MOST: usize = 50_000_000;

/// Reads `x`, `x,y` or `x,y,z` a line (comma, semicolon, tab or blanks between). A first line of names is skipped, as
/// are empty lines and those that start with `#`.
///
/// ```
/// let read = ondelette_io::shape::points::read_csv("x,y\n0,0\n1.5,2e-3\n")?;
/// assert_eq!((read.dim, read.points[1]), (2, [1.5, 2e-3, 0.0]));
/// # Ok::<(), String>(())
/// ```
///
/// # Errors
/// A sentence with the line: a number that is none or not finite, a line of another length, no points.
pub fn read_csv(text: &str) -> Result<Points, String> {
    let mut out = Points { dim: 0, points: Vec::new() };
    let mut names_allowed = true;
    for (i, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = if line.contains([',', ';']) {
            line.split([',', ';']).map(str::trim).collect()
        } else {
            line.split_whitespace().collect()
        };
        let numbers: Result<Vec<f64>, _> = cells.iter().map(|c| c.parse::<f64>()).collect();
        let Ok(numbers) = numbers else {
            if std::mem::take(&mut names_allowed) && out.points.is_empty() {
                continue;
            }
            return Err(format!("line {}: {line:?} holds something that is no number", i + 1));
        };
        names_allowed = false;
        if !(1..=3).contains(&numbers.len()) {
            return Err(format!("line {}: {} numbers; points have 1 to 3 coordinates", i + 1, numbers.len()));
        }
        if out.dim != 0 && out.dim != numbers.len() {
            return Err(format!("line {}: {} numbers where the lines before have {}", i + 1, numbers.len(), out.dim));
        }
        if let Some(x) = numbers.iter().find(|x| !x.is_finite()) {
            return Err(format!("line {}: {x} is not a finite number", i + 1));
        }
        if out.points.len() == MOST {
            return Err(format!("more than {MOST} points: thin them out first"));
        }
        out.dim = numbers.len();
        let mut p = [0.0; 3];
        p[..out.dim].copy_from_slice(&numbers);
        out.points.push(p);
    }
    if out.points.is_empty() { Err("the file holds no points".to_owned()) } else { Ok(out) }
}

/// Reads an airfoil outline: a title, then `x y` a line. Both orders are known: Selig's (from the trailing edge over
/// the top round the nose and back), and Lednicer's (counts of both sides, then top and bottom from the nose), which is
/// brought into Selig's.
///
/// # Errors
/// A sentence with the line, as [`read_csv`]; fewer than 3 points.
pub fn read_dat(text: &str) -> Result<Points, String> {
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    let mut blanks = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let numbers: Result<Vec<f64>, _> =
            line.split([' ', '\t', ',']).filter(|c| !c.is_empty()).map(str::parse::<f64>).collect();
        match numbers {
            Ok(n) if n.is_empty() => blanks.push(rows.len()),
            Ok(n) if n.len() == 2 => {
                if let Some(x) = n.iter().find(|x| !x.is_finite()) {
                    return Err(format!("line {}: {x} is not a finite number", i + 1));
                }
                rows.push((i + 1, n));
            }
            // titles, possibly of several lines, come before the numbers
            _ if rows.is_empty() => {}
            Ok(n) => return Err(format!("line {}: {} numbers where x and y are expected", i + 1, n.len())),
            Err(_) => return Err(format!("line {}: {:?} holds something that is no number", i + 1, line.trim())),
        }
    }
    let mut points: Vec<[f64; 3]> = rows.iter().map(|(_, n)| [n[0], n[1], 0.0]).collect();
    let counts = points.first().copied().unwrap_or_default();
    if counts[0] >= 2.0 && counts[1] >= 2.0 && (counts[0] + counts[1]) as usize == points.len() - 1 {
        let top = counts[0] as usize;
        let bottom = points.split_off(1 + top);
        points.remove(0);
        points.reverse();
        let same = points.last() == bottom.first();
        points.extend_from_slice(&bottom[usize::from(same)..]);
    }
    if points.len() < 3 {
        return Err(format!("{} points: an outline needs at least 3", points.len()));
    }
    Ok(Points { dim: 2, points })
}

/// The points as a table, `names` first.
///
/// # Panics
/// If `dim` is more than 3.
pub fn write_csv(points: &[[f64; 3]], dim: usize) -> String {
    let mut out = ["x", "y", "z"][..dim].join(",");
    out.push('\n');
    for p in points {
        crate::write::push_row(&mut out, &p[..dim], 0);
    }
    out
}
