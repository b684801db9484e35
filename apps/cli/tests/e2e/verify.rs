//! `ondelette verify`.

use crate::program::{Place, room};

/// A room of which the solution is checked against its own promise, and against one that it never made.
fn solved(error: &str) -> Place {
    let place = Place::new();
    room(&place);
    place.run(&format!("light room.obj --error {error} -o room.onl")).with_code(0);
    place
}

/// The verdict as JSON; its value under a name, up to the next comma or line end.
fn field<'a>(json: &'a str, name: &str) -> &'a str {
    let at = json.find(&format!("\"{name}\":")).unwrap_or_else(|| panic!("no {name} in {json}"));
    let value = &json[at + name.len() + 3..];
    value[..value.find(['\n', ',']).unwrap()].trim()
}

#[test]
fn a_kept_promise_is_found_kept_and_a_tighter_one_broken() {
    let place = solved("10%");
    let before = place.names();
    let kept = place.run("verify room.onl").with_code(0);
    for said in ["promised   10.000 %", "measured", "95 %:", "points     2000", "floor (side 0)", "\nkept: "] {
        assert!(kept.out.contains(said), "{said}: {}", kept.out);
    }
    assert!(kept.err.is_empty(), "{}", kept.err);
    // nothing is written, and the same is said again, by any number of threads
    assert_eq!(place.names(), before);
    assert_eq!(place.run("verify room.onl --threads 1").with_code(0).out, kept.out);
    let broken = place.run("verify room.onl --error 0.02% --points 400").with_code(1);
    assert!(broken.out.contains("\nbroken: ") && broken.out.contains("promised   0.020 %"), "{}", broken.out);
}

#[test]
fn the_verdict_can_be_had_as_json() {
    let place = solved("1%");
    let honest = place.run("verify room.onl --error 2% --json").with_code(0);
    assert_eq!(field(&honest.out, "verdict"), "\"kept\"");
    let measured: f64 = field(&honest.out, "measured").parse().unwrap();
    let promised: f64 = field(&honest.out, "promised").parse().unwrap();
    assert!(measured < promised && promised == 0.02, "{}", honest.out);
    assert_eq!(field(&honest.out, "points"), "2000");
    assert_eq!(field(&honest.out, "points_that_would_decide"), "null");
}

#[test]
fn a_check_that_cannot_tell_says_how_many_points_could() {
    let place = solved("3%");
    let measured = |error: &str| {
        let ended = place.run(&format!("verify room.onl --error {error} --points 100 --json"));
        let value = field(&ended.out, "measured").parse::<f64>().unwrap();
        (ended, value)
    };
    // promise about what there is: a hundred points cannot tell
    let (_, found) = measured("1%");
    let (ended, _) = measured(&format!("{:.4}%", 100.0 * found));
    let ended = ended.with_code(0);
    assert_eq!(field(&ended.out, "verdict"), "\"inconclusive\"", "{}", ended.out);
    let text = place.run(&format!("verify room.onl --points 100 --error {:.4}%", 100.0 * found)).with_code(0).out;
    assert!(text.contains("\ninconclusive: ") && text.contains("points"), "{text}");
}

#[test]
fn a_check_that_is_stopped_says_what_it_knows() {
    let place = solved("3%");
    let ended = place.run("verify room.onl --error 0.1% --points 1000000 --max-time 300ms").with_code(1);
    assert!(ended.err.contains("stopped by max-time after"), "{}", ended.err);
    assert!(ended.out.contains("measured") && ended.out.contains("at least"), "{}", ended.out);
}

#[test]
fn bad_input_is_refused() {
    let place = solved("10%");
    let bytes = place.read("room.onl");
    place.write("cut.onl", &bytes[..bytes.len() / 2]);
    for (arguments, said) in [
        ("verify missing.onl", "missing.onl"),
        ("verify cut.onl", "cut short"),
        ("verify room.obj", "not an Ondelette solution"),
        ("verify room.onl --points 5", "between 100 and 1000000"),
        ("verify room.onl --points -5", "points"),
        ("verify room.onl --points many", "points"),
        ("verify room.onl --error 0%", "0.01 %"),
        ("verify room.onl --error NaN", "percentage"),
        ("verify room.onl --threads 0", "--threads"),
        ("verify room.onl --max-time 3", "--max-time"),
        ("verify", "SOLUTION"),
    ] {
        let ended = place.run(arguments).with_code(2);
        assert!(ended.err.contains(said) && ended.err.starts_with("error: "), "{arguments}: {}", ended.err);
        assert!(ended.out.is_empty(), "{arguments}: {}", ended.out);
    }
}
