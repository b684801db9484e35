//! Multiresolution editing: the thesis's numbers, and laws that every shape keeps.

use ondelette_modeling::Axis;
use ondelette_modeling::edit::{
    CurveLadder, EditError, Editor, Hierarchy, Ladder, Orientation, Pull, SurfaceLadder, delta_curve, delta_surface,
    least_squares, pentland,
};
use ondelette_modeling::shape::{Curve, Surface};
use ondelette_wavelet::Boundary::{self, Mirrored, Open, Periodic};
use serde_json::Value;

fn noise(count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| [next(), next(), next()]).collect()
}

fn curve(boundary: Boundary, spans: usize, seed: u64) -> Curve {
    let axis = Axis::new(boundary, spans, [0.0, 2.0]).unwrap();
    Curve::new(axis, 3, noise(axis.len(), seed)).unwrap()
}

fn surface(boundaries: [Boundary; 2], spans: [usize; 2], seed: u64) -> Surface {
    let axes = [0, 1].map(|a| Axis::new(boundaries[a], spans[a], [0.0, 1.0 + a as f64]).unwrap());
    Surface::new(axes, 3, noise(axes[0].len() * axes[1].len(), seed)).unwrap()
}

fn worst(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.as_flattened().iter().zip(b.as_flattened()).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
}

fn vectors() -> Value {
    serde_json::from_str(include_str!("data/editing.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn heights(values: &[f64]) -> Vec<[f64; 3]> {
    values.iter().map(|&x| [x, 0.0, 0.0]).collect()
}

#[test]
fn a_handle_of_a_coarse_level_moves_the_curve_as_the_reference_says() {
    let hybrid = &vectors()["hybrid"];
    let levels: Vec<Vec<f64>> = hybrid["b_all"].as_array().unwrap().iter().map(numbers).collect();
    let axis = Axis::new(Mirrored, 16, [0.0, 16.0]).unwrap();
    let curve = Curve::new(axis, 1, heights(&levels[4])).unwrap();
    let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
    for (level, b) in levels.iter().enumerate() {
        assert!(worst(editor.control(level).unwrap(), &heights(b)) < 1e-13, "level {level}");
    }
    for (level, w) in hybrid["w_all"].as_array().unwrap().iter().map(numbers).enumerate() {
        assert!(worst(editor.ladder().detail(level), &heights(&w)) < 1e-13, "wavelets of level {level}");
    }
    let edit = &hybrid["edit"];
    editor.set_do_level(2).unwrap();
    let by = edit["add"].as_f64().unwrap();
    editor.drag([edit["array_pos"].as_u64().unwrap() as usize, 0], [by, 0.0, 0.0], Orientation::Fixed).unwrap();
    for level in [2, 3, 4] {
        let want = heights(&numbers(&edit["b_levels_after_down"][level.to_string()]));
        assert!(worst(editor.control(level).unwrap(), &want) < 1e-13, "level {level}");
    }
}

#[test]
fn frames_lie_where_the_thesis_puts_them() {
    let frames = &vectors()["frames"];
    let xyz: Vec<Vec<f64>> = frames["b_xyz"].as_array().unwrap().iter().map(numbers).collect();
    let points = (0..9).map(|i| [xyz[0][i], xyz[1][i], xyz[2][i]]).collect();
    let axis = Axis::new(Mirrored, 8, [0.0, 8.0]).unwrap();
    let ladder = CurveLadder::new(&Curve::new(axis, 3, points).unwrap()).unwrap();
    let sites = ladder.wavelet_sites(2);
    let found = ladder.frames(2, ladder.smooth(2));
    for (k, want) in frames["frames"].as_array().unwrap().iter().enumerate() {
        assert!((sites[k] - want["t_level_L_units"].as_f64().unwrap()).abs() < 1e-13);
        let frame = found[k].unwrap();
        let tnb = frame.to_frame(ladder.detail(2)[k]);
        assert!(worst(&[tnb], &[numbers(&want["tnb"]).try_into().unwrap()]) < 1e-11, "frame {k}");
    }
}

#[test]
fn every_smooth_version_is_on_the_shape_and_all_levels_come_back() {
    for (boundary, spans) in [(Open, 16), (Open, 13), (Mirrored, 16), (Mirrored, 11), (Periodic, 16), (Periodic, 12)] {
        let curve = curve(boundary, spans, 3);
        let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
        let levels = editor.levels();
        for level in 0..=levels {
            editor.set_see_level(level).unwrap();
            let smooth = editor.seen().unwrap();
            // A smooth version is its own smooth version.
            let mut again = Editor::new(CurveLadder::new(&smooth).unwrap());
            let (a, b) = (again.control(level).unwrap(), editor.control(level).unwrap());
            assert!(worst(a, b) < 1e-12, "{boundary} {spans} level {level}");
            assert_eq!(editor.ladder().sites(level)[0].len(), editor.control(level).unwrap().len());
        }
        assert!(worst(editor.seen().unwrap().points(), curve.points()) < 1e-13);
    }
}

#[test]
fn every_bicubic_survives_every_see_level_of_the_open_basis() {
    // Blossoms of a cubic at the knot triples of the axis are its control points.
    let axis = |n| Axis::new(Open, n, [0.0, 1.0]).unwrap();
    let axes = [axis(16), axis(8)];
    let triple = |n: usize, j: usize| {
        let knot = |i: usize| (i as f64 - 2.0).clamp(0.0, n as f64) / n as f64;
        [knot(j), knot(j + 1), knot(j + 2)]
    };
    let blossom = |[a, b, c]: [f64; 3]| 1.0 - 2.0 * (a + b + c) / 3.0 + (a * b + b * c + a * c) / 3.0 + 4.0 * a * b * c;
    let cubic = |t: f64| 1.0 - 2.0 * t + t * t + 4.0 * t * t * t;
    let points: Vec<[f64; 3]> = (0..19 * 11)
        .map(|k| {
            let (p, q) = (blossom(triple(16, k / 11)), blossom(triple(8, k % 11)));
            [p, q, p * q]
        })
        .collect();
    let surface = Surface::new(axes, 3, points).unwrap();
    let mut editor = Editor::new(SurfaceLadder::new(&surface).unwrap());
    for level in 0..=editor.levels() {
        editor.set_see_level(level).unwrap();
        let seen = editor.seen().unwrap();
        for (s, t) in [(0.0, 0.0), (0.3, 0.9), (1.0, 0.21), (0.77, 1.0)] {
            let want = [cubic(s), cubic(t), cubic(s) * cubic(t)];
            assert!(worst(&[seen.point(s, t)], &[want]) < 1e-12, "level {level}");
        }
    }
}

#[test]
fn surfaces_of_unequal_sides_have_levels_and_come_back() {
    for (boundaries, spans) in [
        ([Open, Open], [16, 5]),
        ([Periodic, Open], [8, 12]),
        ([Mirrored, Periodic], [9, 16]),
        ([Open, Mirrored], [1, 8]),
    ] {
        let surface = surface(boundaries, spans, 7);
        let mut editor = Editor::new(SurfaceLadder::new(&surface).unwrap());
        for level in (0..=editor.levels()).rev() {
            let [n, m] = editor.ladder().shape(level);
            assert_eq!(editor.control(level).unwrap().len(), n * m);
            assert_eq!(editor.ladder().sites(level).map(|s| s.len()), [n, m]);
        }
        // Down from the coarsest level: only smooth and detail know the surface now.
        let coarsest = editor.control(0).unwrap().to_vec();
        editor.set_smooth(0, &coarsest, Orientation::Fixed).unwrap();
        assert!(worst(editor.shape().unwrap().points(), surface.points()) < 1e-12, "{boundaries:?} {spans:?}");
    }
}

#[test]
fn a_drag_is_a_hump_and_changes_nothing_outside_it() {
    for (boundary, spans) in [(Open, 32), (Mirrored, 32), (Periodic, 32)] {
        let curve = curve(boundary, spans, 5);
        for orientation in [Orientation::Fixed, Orientation::Turning] {
            let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
            editor.set_do_level(4).unwrap();
            editor.drag([8, 0], [0.1, 0.4, -0.2], orientation).unwrap();
            let after = editor.shape().unwrap();
            let changed: Vec<bool> = curve
                .points()
                .iter()
                .zip(after.points())
                .map(|(a, b)| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-12))
                .collect();
            let count = changed.iter().filter(|c| **c).count();
            // One function of the next coarser level is five of this one; turned humps reach as far as its support.
            let most = if orientation == Orientation::Fixed { 5 } else { 9 };
            assert!((3..=most).contains(&count), "{boundary} {orientation:?}: {count} control points changed");
        }
    }
}

#[test]
fn fractional_levels_go_over_into_whole_ones() {
    let curve = curve(Open, 32, 9);
    let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
    let whole = |level: usize| {
        let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
        editor.set_see_level(level).unwrap();
        editor.seen().unwrap()
    };
    assert!(worst(editor.seen_at(3.0).unwrap().points(), whole(3).points()) < 1e-14);
    let (a, b) = (whole(3), whole(4));
    let half = editor.seen_at(3.5).unwrap();
    let mean: Vec<[f64; 3]> =
        a.points().iter().zip(b.points()).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
    assert!(worst(half.points(), &mean) < 1e-13);
    // The handle that is dragged goes where it is dragged, at every fraction; just below a whole level the edit is
    // nearly that of the whole level.
    let by = [0.0, 1.0, 0.0];
    for level in [3.25, 3.5, 3.999_999] {
        let mut edited = editor.clone();
        let before = edited.fractional(level).unwrap().1[7];
        edited.drag_at(level, [7, 0], by, Orientation::Fixed).unwrap();
        let after = edited.fractional(level).unwrap().1[7];
        assert!((after[1] - before[1] - 1.0).abs() < 0.2, "{level}: {}", after[1] - before[1]);
    }
    let mut near = editor.clone();
    near.drag_at(3.999_999, [7, 0], by, Orientation::Fixed).unwrap();
    editor.drag_at(4.0, [7, 0], by, Orientation::Fixed).unwrap();
    assert!(worst(near.shape().unwrap().points(), editor.shape().unwrap().points()) < 1e-5);
    assert!(editor.seen_at(f64::NAN).is_err() && editor.seen_at(-0.1).is_err() && editor.seen_at(5.1).is_err());
}

/// A line along x with ripples across, and what became of them after the line was bent by a quarter turn.
fn bent(orientation: Orientation) -> (Curve, Curve, Vec<[f64; 3]>) {
    let axis = Axis::new(Open, 128, [0.0, 1.0]).unwrap();
    let greville =
        |j: usize| [j as f64 - 2.0, j as f64 - 1.0, j as f64].map(|k| k.clamp(0.0, 128.0)).iter().sum::<f64>() / 384.0;
    let ripple = |j: usize| if j.is_multiple_of(2) { 0.004 } else { -0.004 };
    let points = (0..131).map(|j| [greville(j), ripple(j), 0.0]).collect();
    let curve = Curve::new(axis, 2, points).unwrap();
    let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
    let sites = editor.ladder().sites(3)[0].clone();
    // A quarter of a circle of the same length.
    let radius = 2.0 / std::f64::consts::PI;
    let sweep: Vec<[f64; 3]> = sites
        .iter()
        .map(|t| {
            let angle = t / radius;
            [radius * angle.sin(), radius * (1.0 - angle.cos()), 0.0]
        })
        .collect();
    editor.set_smooth(3, &sweep, orientation).unwrap();
    let smooth = {
        let ladder = editor.ladder();
        ladder.build(ladder.prolong(3, 7, &sweep)).unwrap()
    };
    (curve, smooth, editor.shape().unwrap().points().to_vec())
}

#[test]
fn turning_detail_keeps_its_angle_to_the_sweep_and_thesis_frames_do_not() {
    let deviation = |orientation| {
        let (_, smooth, points) = bent(orientation);
        let mut angle: f64 = 0.0;
        let mut size: f64 = 0.0;
        for j in 8..123 {
            let t = [j as f64 - 2.0, j as f64 - 1.0, j as f64].iter().sum::<f64>() / 384.0;
            let d: [f64; 3] = std::array::from_fn(|c| points[j][c] - smooth.points()[j][c]);
            let tangent = smooth.derivative(t, 1);
            let along = (d[0] * tangent[0] + d[1] * tangent[1]) / tangent[0].hypot(tangent[1]);
            let length = d[0].hypot(d[1]);
            angle = angle.max((along / length).abs().asin().to_degrees());
            size = size.max((length / 0.004 - 1.0).abs());
        }
        (angle, size)
    };
    let (angle, size) = deviation(Orientation::Turning);
    assert!(angle < 1.0 && size < 0.02, "turning: {angle} degrees, size off by {size}");
    // xyz: by the whole quarter turn at its end.
    assert!(deviation(Orientation::Fixed).0 > 60.0);
}

#[test]
fn pulls_hold_and_the_delta_method_agrees() {
    let pulls = [
        Pull { at: [0.61, 0.0], orders: [0, 0], target: [Some(1.0), Some(2.0), None] },
        Pull { at: [1.3, 0.0], orders: [0, 0], target: [Some(-1.0), None, Some(0.5)] },
        Pull { at: [1.3, 0.0], orders: [1, 0], target: [Some(0.0), Some(3.0), None] },
    ];
    for boundary in [Open, Mirrored, Periodic] {
        let curve = curve(boundary, 32, 11);
        for times in 0..3 {
            let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
            let level = editor.levels() - times;
            let pulled = least_squares(&mut editor, level, &pulls).unwrap();
            assert!(pulled.redundant.is_empty() && pulled.residual < 1e-12);
            let a = editor.shape().unwrap();
            for pull in &pulls {
                let value = a.derivative(pull.at[0], pull.orders[0]);
                for (value, target) in value.iter().zip(pull.target) {
                    assert!(target.is_none_or(|t| (t - value).abs() < 1e-10), "{boundary} {times}");
                }
            }
            let (b, _) = delta_curve(&curve, times, &pulls).unwrap();
            assert!(worst(a.points(), b.points()) < 1e-11, "{boundary} {times}: {}", worst(a.points(), b.points()));
        }
    }
    let surface = surface([Open, Periodic], [16, 8], 13);
    let pulls = [
        Pull { at: [0.3, 0.7], orders: [0, 0], target: [None, None, Some(2.0)] },
        Pull { at: [0.8, 1.7], orders: [1, 0], target: [Some(1.0), None, Some(0.0)] },
    ];
    let mut editor = Editor::new(SurfaceLadder::new(&surface).unwrap());
    let level = editor.levels() - 1;
    least_squares(&mut editor, level, &pulls).unwrap();
    let (b, _) = delta_surface(&surface, [1, 1], &pulls).unwrap();
    let a = editor.shape().unwrap();
    assert!(worst(a.points(), b.points()) < 1e-11);
    assert!((a.point(0.3, 0.7)[2] - 2.0).abs() < 1e-12);
}

#[test]
fn a_coarser_level_moves_the_same_point_by_a_broader_change() {
    let curve = curve(Open, 64, 17);
    let pull = [Pull { at: [1.0, 0.0], orders: [0, 0], target: [None, Some(9.0), None] }];
    let reach: Vec<usize> = [6, 4, 2]
        .map(|level| {
            let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
            least_squares(&mut editor, level, &pull).unwrap();
            let after = editor.shape().unwrap();
            curve.points().iter().zip(after.points()).filter(|(a, b)| (a[1] - b[1]).abs() > 1e-9).count()
        })
        .into();
    assert!(reach[0] <= 4 && reach[0] < reach[1] && reach[1] < reach[2], "{reach:?}");
}

#[test]
fn redundant_and_contradictory_pulls_are_named() {
    let curve = curve(Open, 32, 19);
    let at = |t: f64, y: f64| Pull { at: [t, 0.0], orders: [0, 0], target: [None, Some(y), None] };
    let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
    let pulled = least_squares(&mut editor, 5, &[at(0.5, 1.0), at(1.5, 2.0), at(0.5, 1.0)]).unwrap();
    assert_eq!(pulled.redundant, [2]);
    let before = editor.shape().unwrap();
    let error = least_squares(&mut editor, 5, &[at(0.5, 1.0), at(1.5, 2.0), at(0.5, 1.1)]).unwrap_err();
    assert!(matches!(error, EditError::Conflict { pull: 2, .. }), "{error}");
    assert_eq!(editor.shape().unwrap(), before, "a refused edit changes nothing");
    // Six conditions on the coarsest level, which has four functions.
    let many: Vec<Pull> = (0..6).map(|k| at(f64::from(k) * 0.39, f64::from(k * k * k % 5))).collect();
    let error = least_squares(&mut editor, 0, &many).unwrap_err();
    assert!(matches!(error, EditError::Conflict { pull, .. } if pull > 0), "nothing is before the first: {error}");
    assert!(least_squares(&mut editor, 9, &many).is_err());
    assert!(least_squares(&mut editor, 5, &[at(f64::NAN, 1.0)]).is_err());
}

#[test]
fn pentlands_shortcut_meets_its_pulls_and_bends_more_than_it_says() {
    let axis = Axis::new(Open, 32, [0.0, 1.0]).unwrap();
    let flat = Curve::new(axis, 2, (0..35).map(|i| [f64::from(i), 0.0, 0.0]).collect()).unwrap();
    let pull = [Pull { at: [0.47, 0.0], orders: [0, 0], target: [None, Some(1.0), None] }];
    let (bent, _) = pentland(&flat, &pull).unwrap();
    assert!((bent.point(0.47)[1] - 1.0).abs() < 1e-12);
    // The true answer is a straight lift at no energy; the shortcut bends.
    let bend = |c: &Curve| (0..200).map(|k| c.derivative((f64::from(k) + 0.5) / 200.0, 2)[1].powi(2)).sum::<f64>();
    assert!(bend(&bent) > 1e-6);
    let mut editor = Editor::new(CurveLadder::new(&flat).unwrap());
    least_squares(&mut editor, 5, &pull).unwrap();
    assert!(bend(&bent) < 0.1 * bend(&editor.shape().unwrap()), "smoother than least squares on the finest level");
}

#[test]
fn fine_edits_mean_nothing_to_coarse_levels_of_hierarchical_splines() {
    let curve = curve(Open, 16, 23);
    let mut ladder = CurveLadder::new(&curve).unwrap();
    ladder.coarser(4, 0);
    let mut hierarchy = Hierarchy::new(ladder);
    let mut editor = Editor::new(CurveLadder::new(&curve).unwrap());
    assert!(worst(hierarchy.shape().unwrap().points(), curve.points()) < 1e-13);
    let by = [0.0, 1.0, 0.0];
    hierarchy.drag(4, [9, 0], by, Orientation::Fixed).unwrap();
    editor.set_do_level(4).unwrap();
    editor.drag([9, 0], by, Orientation::Fixed).unwrap();
    assert!(worst(hierarchy.shape().unwrap().points(), editor.shape().unwrap().points()) < 1e-13);
    let coarse = hierarchy.control(2).unwrap();
    let before = Editor::new(CurveLadder::new(&curve).unwrap()).control(2).unwrap().to_vec();
    assert!(worst(&coarse, &before) < 1e-13, "no notion of the coarser level");
    assert!(worst(editor.control(2).unwrap(), &before) > 1e-2, "wavelets have one");
    // Coarse edits agree: both refine.
    hierarchy.drag(2, [3, 0], by, Orientation::Fixed).unwrap();
    editor.set_do_level(2).unwrap();
    editor.drag([3, 0], by, Orientation::Fixed).unwrap();
    assert!(worst(hierarchy.shape().unwrap().points(), editor.shape().unwrap().points()) < 1e-12);
    assert!(hierarchy.drag(2, [3, 0], by, Orientation::Turning).is_ok());
}

#[test]
fn wrong_handles_are_refused_with_their_limits() {
    let mut editor = Editor::new(CurveLadder::new(&curve(Open, 16, 29)).unwrap());
    assert!(editor.set_do_level(5).unwrap_err().to_string().contains("levels 0 to 4"));
    editor.set_do_level(2).unwrap();
    let error = editor.drag([7, 0], [0.0; 3], Orientation::Fixed).unwrap_err();
    assert!(error.to_string().contains("[7, 1]"), "{error}");
    assert!(editor.drag([0, 0], [f64::INFINITY, 0.0, 0.0], Orientation::Fixed).is_err());
    let mut editor = Editor::new(SurfaceLadder::new(&surface([Open, Open], [8, 8], 1)).unwrap());
    assert_eq!(editor.drag([0, 0], [1.0; 3], Orientation::Frenet), Err(EditError::FrenetSurface));
}

#[test]
fn pulls_outside_the_domain_are_refused_and_not_moved_to_its_end() {
    let pull = |s: f64, t: f64| [Pull { at: [s, t], orders: [0, 0], target: [Some(1.0), None, None] }];
    let open = curve(Open, 8, 1);
    let mut editor = Editor::new(CurveLadder::new(&open).unwrap());
    for at in [-0.01, 2.1, 1e300] {
        let outside = |r: Result<(), EditError>| assert!(matches!(r, Err(EditError::Outside { pull: 0, .. })), "{r:?}");
        outside(least_squares(&mut editor, 1, &pull(at, 0.0)).map(|_| ()));
        outside(delta_curve(&open, 1, &pull(at, 0.0)).map(|_| ()));
        outside(pentland(&open, &pull(at, 0.0)).map(|_| ()));
    }
    assert_eq!(editor.shape().unwrap(), open);
    least_squares(&mut editor, 1, &pull(2.0, 0.0)).unwrap();
    // Parameters of periodic axes go round; those of the other axis do not.
    let tube = surface([Periodic, Open], [8, 8], 2);
    let mut editor = Editor::new(SurfaceLadder::new(&tube).unwrap());
    least_squares(&mut editor, 1, &pull(1.25, 0.5)).unwrap();
    assert!((editor.shape().unwrap().derivative([0.25, 0.5], [0, 0])[0] - 1.0).abs() < 1e-9);
    assert!(matches!(least_squares(&mut editor, 1, &pull(0.5, 2.5)), Err(EditError::Outside { .. })));
    assert!(matches!(delta_surface(&tube, [1, 1], &pull(0.5, -0.5)), Err(EditError::Outside { .. })));
}
