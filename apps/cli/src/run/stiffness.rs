//! The stiffness map of a document: regions to one factor a cell.

use ondelette_io::shape::{Document, Region};
use ondelette_modeling::Axis;
use ondelette_modeling::energy::Stiffness;
use ondelette_modeling::system::Space;
use ondelette_wavelet::Boundary;

/// One factor a cell from the regions of the document; later ones win.
pub(super) fn stiffness(document: &Document, space: &Space) -> Result<Option<Stiffness>, String> {
    if document.stiffness.is_empty() {
        return Ok(None);
    }
    let axes = &document.axes;
    let cells = space.cells();
    let mut factors = vec![1.0; cells];
    for (i, region) in document.stiffness.iter().enumerate() {
        let of = |a: usize| spans(&axes[a], region, a).map_err(|e| format!("stiffness {i}: {e}"));
        let along = (0..axes.len()).map(of).collect::<Result<Vec<_>, String>>()?;
        match along.as_slice() {
            [s, t] => {
                let row = |i: usize| t.iter().map(move |j| i * axes[1].spans() + j);
                s.iter().flat_map(|i| row(*i)).for_each(|cell| factors[cell] = region.factor);
            }
            _ => along[0].iter().for_each(|cell| factors[*cell] = region.factor),
        }
    }
    Stiffness::new(cells, factors).map(Some).map_err(|e| e.to_string())
}

/// The spans of an axis whose middle lies in a region; of a region too thin for that, those that it overlaps: a line on
/// a knot has both neighbours. On a periodic axis a region may run across the seam.
fn spans(axis: &Axis, region: &Region, a: usize) -> Result<Vec<usize>, String> {
    let [low, high] = axis.domain();
    let (from, to) = (region.from[a], region.to[a]);
    let periodic = axis.boundary() == Boundary::Periodic;
    if !(from <= to && from.is_finite() && to.is_finite()) {
        let seam = if periodic { "; a region across the seam ends beyond the domain" } else { "" };
        return Err(format!("from {from} to {to}: give the lower corner first{seam}"));
    }
    // Corners on knots may be rounded.
    let slack = 1e-9 * (high - low) / axis.spans() as f64;
    if !periodic && (to < low - slack || from > high + slack) {
        return Err(format!("from {from} to {to} is outside the domain [{low}, {high}]"));
    }
    let n = axis.spans() as f64;
    let round = |u: f64| if (u - u.round()).abs() <= 1e-9 { u.round() } else { u };
    let (mut first, mut last) = (round(axis.to_knots(from)), round(axis.to_knots(to)));
    if periodic && last - first < n {
        // Into the first turn.
        let turns = (first / n).floor() * n;
        (first, last) = (first - turns, last - turns);
    } else {
        (first, last) = (first.clamp(0.0, n), last.clamp(0.0, n));
        if periodic {
            (first, last) = (0.0, n);
        }
    }
    // Middles are at i + 1/2.
    let (mut begin, mut end) = ((first - 0.5).ceil() as i64, (last - 0.5).floor() as i64 + 1);
    if begin >= end {
        (begin, end) = (first.floor() as i64, last.ceil() as i64);
        if first == last && first.fract() == 0.0 {
            (begin, end) = (begin - 1, end + 1);
        }
    }
    let count = axis.spans() as i64;
    Ok(if periodic {
        (begin..end).map(|i| i.rem_euclid(count) as usize).collect()
    } else {
        (begin.max(0)..end.min(count)).map(|i| i as usize).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(boundary: Boundary, from: f64, to: f64) -> Result<Vec<usize>, String> {
        let axis = Axis::new(boundary, 10, [0.0, 1.0]).unwrap();
        spans(&axis, &Region { from: vec![from], to: vec![to], factor: 0.5 }, 0)
    }

    #[test]
    fn thin_regions_have_the_spans_that_they_overlap_and_others_those_of_their_middles() {
        let open = |from, to| found(Boundary::Open, from, to).unwrap();
        assert_eq!(open(0.21, 0.44), vec![2, 3]);
        assert_eq!(open(0.15, 0.35), vec![1, 2, 3]);
        assert_eq!(open(0.16, 0.24), vec![1, 2]);
        assert_eq!(open(0.31, 0.34), vec![3]);
        assert_eq!(open(0.32, 0.32), vec![3]);
        // A crease on a knot, whose place is rounded.
        assert_eq!(open(0.3, 0.3), vec![2, 3]);
        assert_eq!(open(0.0, 0.0), vec![0]);
        assert_eq!(open(1.0, 1.0), vec![9]);
        assert_eq!(open(-5.0, 0.17), vec![0, 1]);
        assert_eq!(open(0.99, 7.0), vec![9]);
    }

    #[test]
    fn regions_run_across_the_seam_of_periodic_axes_and_never_outside_of_others() {
        let periodic = |from, to| found(Boundary::Periodic, from, to).unwrap();
        assert_eq!(periodic(0.85, 1.15), vec![8, 9, 0, 1]);
        assert_eq!(periodic(-0.15, 0.05), vec![8, 9, 0]);
        assert_eq!(periodic(1.0, 1.0), vec![9, 0]);
        assert_eq!(periodic(-3.0, 3.0).len(), 10);
        assert!(found(Boundary::Periodic, 0.9, 0.1).unwrap_err().contains("seam"));
        for boundary in [Boundary::Open, Boundary::Mirrored] {
            for (from, to) in [(1.1, 1.2), (-0.4, -0.1), (0.6, 0.5), (f64::NAN, 0.5)] {
                assert!(found(boundary, from, to).is_err(), "{from} {to}");
            }
        }
    }
}
