//! `ondelette relight`, and what `ondelette light` keeps for it; added lamps; memory.

use crate::program::{Place, room};
use serde_json::Value;

fn report(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).unwrap()
}

#[test]
fn another_lamp_and_another_wall_without_a_ray() {
    let place = Place::new();
    room(&place);
    place.run("light room.obj --error 2% --keep-links -o room.onl --report first.json").with_code(0);
    place.run("relight room.onl --emission lamp=6,4,2 -o twice.onl --report twice.json").with_code(0);
    let [first, twice] = ["first.json", "twice.json"].map(|name| report(&place, name));
    assert_eq!(first["rays"], twice["rays"]);
    let absorbed = |r: &Value| r["ledger"]["absorbed"][1].as_f64().unwrap();
    assert!((absorbed(&twice) / absorbed(&first) - 2.0).abs() < 0.02);
    // finer, with the rays that are missing
    let outputs = "-o finer.onl -o finer.png --report finer.json";
    place.run(&format!("relight room.onl --reflectance grey=0.3,0.4,0.5 --refine --error 1% {outputs}")).with_code(0);
    let finer = report(&place, "finer.json");
    assert!(finer["estimated_error"].as_f64().unwrap() <= 0.01);
    assert_eq!(finer["settings"]["error"], 0.01);
    let surfaces = finer["surfaces"].as_array().unwrap();
    assert!(
        !surfaces.is_empty()
            && surfaces
                .iter()
                .all(|s| s["name"].is_string() && s["estimated_error"].is_number() || s["estimated_error"].is_null())
    );
}

#[test]
fn what_cannot_be_lit_anew_is_refused() {
    let place = Place::new();
    room(&place);
    place.run("light room.obj --error 5% -o bare.onl").with_code(0);
    place.run("light room.obj --error 5% --keep-links -o room.onl").with_code(0);
    place.run("light room.obj --error 5% --method wavelet -o linked.onl").with_code(0);
    let before = place.names();
    for (arguments, said) in [
        ("relight bare.onl --emission lamp=1 -o x.onl", "--keep-links"),
        ("relight room.onl --emission lamb=1 -o x.onl", "'lamp'"),
        ("relight room.onl --reflectance grey=1 -o x.onl", "[0, 1)"),
        ("relight room.onl --emission lamp=-1 -o x.onl", "'lamp' cannot emit -1"),
        ("relight room.onl --emission lamp=NaN -o x.onl", "MATERIAL=r,g,b"),
        ("relight room.onl -o x.onl", "nothing to change"),
        ("relight room.onl --emission lamp=1 -o room.onl", "would be overwritten"),
        ("relight room.obj --emission lamp=1 -o x.onl", "not an Ondelette solution"),
        ("relight room.onl --emission lamp=1 --keep-links -o x.png", "add -o NAME.onl"),
        ("light room.obj --keep-links -o x.png", "add -o NAME.onl"),
        ("light room.obj --memory 1 -o x.png", "512MB"),
        ("light room.obj --method wavelet --keep-links -o x.png", "add -o NAME.onl"),
        ("light room.obj --method classical --subdivision 9 --solver southwell --memory 1MB -o x.png", "gmres"),
        ("relight linked.onl --emission lamp=1 --direct gather -o x.png", "--method sampled"),
        ("light room.obj --method wavelet --direct gather -o x.png", "--method sampled"),
        ("light room.obj --light at=0,0 -o x.png", "three numbers"),
    ] {
        let ended = place.run(arguments).with_code(2);
        assert!(ended.err.contains(said), "{arguments}: no '{said}' in {}", ended.err);
        assert_eq!(place.names(), before, "{arguments}");
    }
}

#[test]
fn gathered_direct_light_is_read_wherever_the_solution_is() {
    let place = Place::new();
    room(&place);
    // something that casts a shadow
    let shade = "v 0.7 0.7 0.4\nv 1.2 0.7 0.4\nv 1.2 1.2 0.4\nv 0.7 1.2 0.4\no shade\nusemtl grey\nf 9 10 11 12\n";
    place.write("room.obj", format!("{}{shade}", crate::program::ROOM));
    place.run("light room.obj --error 5% --direct gather -o g.onl -o g.png -o g.glb --report g.json").with_code(0);
    let gathered = report(&place, "g.json");
    assert_eq!(gathered["settings"]["direct"], "gather");
    place.run("verify g.onl --points 500").with_code(0);
    let points: String = (0..40).map(|k| format!("{},0.71,0,0,0,1\n", 0.02 + 0.048 * f64::from(k))).collect();
    place.write("p.csv", points);
    let read = |how: &str| place.run(&format!("probe g.onl p.csv {how}")).with_code(0).out;
    assert_eq!(read(""), read("--direct gather"));
    assert_ne!(read(""), read("--direct fitted"));
    // no samples to go on from, unless they are kept
    place.run("relight g.onl --emission lamp=1 -o x.onl").with_code(2);
    place.run("light room.obj --error 5% --direct gather --keep-links -o k.onl").with_code(0);
    place.run("relight k.onl --emission lamp=6,4,2 -o x.onl --report x.json").with_code(0);
    assert_eq!(report(&place, "x.json")["settings"]["direct"], "gather");
    place.run("relight k.onl --direct fitted --refine -o x.onl --report x.json").with_code(0);
    let fitted = report(&place, "x.json");
    assert_eq!(fitted["settings"]["direct"], "fitted");
    assert!(fitted["elements"].as_u64() >= gathered["elements"].as_u64());
    // a solution that kept nothing
    place.run("light room.obj --error 5% -o bare.onl").with_code(0);
    let refused = place.run("probe bare.onl p.csv --direct gather").with_code(2);
    assert!(refused.err.contains("--direct gather"), "{}", refused.err);
}

#[test]
fn a_dark_scene_gets_a_lamp() {
    let place = Place::new();
    room(&place);
    place.write("dark.obj", crate::program::ROOM.replace("usemtl lamp", "usemtl grey"));
    place.run("light dark.obj -o x.onl").with_code(2);
    let lamp = "--light at=1,1,1.5:size=0.4:radiance=10:facing=0,0,-1";
    place.run(&format!("light dark.obj --error 5% {lamp} -o x.onl --report x.json")).with_code(0);
    let emitted = report(&place, "x.json")["ledger"]["emitted"][0].as_f64().unwrap();
    assert!((emitted - 1.6 * std::f64::consts::PI).abs() < 1e-9, "{emitted}");
}

#[test]
fn links_are_kept_and_lit_anew() {
    let place = Place::new();
    room(&place);
    for method in ["wavelet", "galerkin"] {
        place.run(&format!("light room.obj --error 5% --method {method} -o a.onl --report a.json")).with_code(0);
        place.run("relight a.onl --emission lamp=6,4,2 -o b.onl -o b.png -o b.glb --report b.json").with_code(0);
        let [first, twice] = ["a.json", "b.json"].map(|name| report(&place, name));
        assert_eq!(first["rays"], twice["rays"], "{method}");
        let absorbed = |r: &Value| r["ledger"]["absorbed"][1].as_f64().unwrap();
        assert!((absorbed(&twice) / absorbed(&first) - 2.0).abs() < 0.02, "{method}");
        // what was lit anew can be lit anew
        let outputs = "-o c.onl --report c.json";
        place.run(&format!("relight b.onl --reflectance grey=0.3 --refine --error 3% {outputs}")).with_code(0);
        assert!(report(&place, "c.json")["estimated_error"].as_f64().unwrap() <= 0.03, "{method}");
    }
    // a matrix that memory has no room for is solved all the same, but not kept
    let capped = "light room.obj --error 3% --method classical --subdivision 4 --memory 1.5MB";
    let ended = place.run(&format!("{capped} --keep-links -o d.onl --report d.json"));
    let d = report(&place, "d.json");
    let counted = d["memory"]["counted_bytes"].as_u64().unwrap();
    assert!(counted <= 1_500_000 && ended.err.contains("no room for all links"), "{counted} {}", ended.err);
    assert!(place.run("relight d.onl --emission lamp=1 -o x.onl").with_code(2).err.contains("--memory"));
}

/// The most memory that this process of Linux may be said to use beside what the solver counts: the program itself.
#[cfg(target_os = "linux")]
const PROGRAM: u64 = 12_000_000;

#[test]
#[cfg(target_os = "linux")]
fn memory_stays_below_the_cap_and_what_the_scene_takes() {
    let place = Place::new();
    let mut most_free = 0;
    for (cap, error) in [(None, "0.6%"), (Some(16), "0.6%"), (Some(8), "0.6%")] {
        let flag = cap.map_or(String::new(), |cap| format!("--memory {cap}MB"));
        place.run(&format!("light builtin:cornell --error {error} {flag} -o a.onl --report a.json"));
        let r = report(&place, "a.json");
        let bytes = |path: &str| r.pointer(path).and_then(Value::as_u64).unwrap();
        let (peak, counted, scene) =
            (bytes("/peak_memory_bytes"), bytes("/memory/counted_bytes"), bytes("/memory/scene_bytes"));
        assert!(scene > 1000);
        match cap {
            None => most_free = counted,
            Some(cap) => {
                let cap = cap * 1_000_000;
                assert!(counted <= cap * 11 / 10 && cap < most_free, "{counted} of {cap}, {most_free} if free");
                let allowed = (cap + scene) * 11 / 10 + PROGRAM;
                assert!(peak <= allowed, "peak {peak}, allowed {allowed}");
            }
        }
    }
}
