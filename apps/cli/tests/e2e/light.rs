//! `ondelette light` and `ondelette info` on good input.

use crate::program::{Place, names_in, room};
use serde_json::Value;

#[test]
fn without_outputs_a_picture_a_model_and_a_report_go_to_out() {
    let place = Place::new();
    let ended = place.run("light --error 10%").with_code(0);
    assert!(ended.out.is_empty(), "data goes to files: {}", ended.out);
    for said in ["elements", "% of the mean", "emitted", "out/cornell.png"] {
        assert!(ended.err.contains(said), "no '{said}' in:\n{}", ended.err);
    }
    assert_eq!(place.names(), ["out/"]);
    assert_eq!(names_in(&place.path("out")), ["cornell.glb", "cornell.json", "cornell.png"]);
    assert!(place.read("out/cornell.png").starts_with(b"\x89PNG"));
    assert!(place.read("out/cornell.glb").starts_with(b"glTF"));
    let glb = String::from_utf8_lossy(&place.read("out/cornell.glb")).into_owned();
    // a lit model is a result, not a scene
    assert!(place.run("info out/cornell.glb").with_code(2).err.contains("out/cornell.glb: all of it is unlit"));
    assert!(glb.contains("KHR_materials_unlit") && glb.contains("exposure") && glb.contains("COLOR_0"));
}

#[test]
fn the_report_tells_what_the_guide_promises() {
    let place = Place::new();
    room(&place);
    place.run("light room.obj --error 2% -o room.onl --report room.json").with_code(0);
    let report: Value = serde_json::from_slice(&place.read("room.json")).unwrap();
    let number = |pointer: &str| report.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer}"));
    for pointer in ["/seconds/read", "/seconds/solve", "/seconds/total", "/seconds/ledger", "/seconds/write_onl"] {
        assert!(number(pointer) >= 0.0);
    }
    assert!(number("/elements") >= 2.0 && number("/kernel_samples") > 0.0 && number("/iterations") >= 1.0);
    let levels = report["links"]["by_level"].as_array().unwrap();
    assert_eq!(levels.iter().map(|n| n.as_f64().unwrap()).sum::<f64>(), number("/links/total"));
    assert!(number("/estimated_error") <= 0.02 && number("/residual") < 0.02 && number("/rays") >= 0.0);
    // a lamp of 1 m^2 with radiance (3, 2, 1)
    for (channel, radiance) in [(0, 3.0), (1, 2.0), (2, 1.0)] {
        let emitted = number(&format!("/ledger/emitted/{channel}"));
        assert!((emitted - radiance * std::f64::consts::PI).abs() < 1e-9, "{emitted}");
    }
    assert!(number("/ledger/closure").abs() < 0.01);
    assert_eq!((report["ledger"]["unit"].as_str(), report["settings"]["basis"].as_str()), (Some("W"), Some("m2")));
    assert_eq!(report["finished"], true);
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    assert!(report["stopped_by"].is_null());
    if cfg!(target_os = "linux") {
        assert!(number("/peak_memory_bytes") > 1e6);
    }
}

#[test]
fn the_report_names_method_and_solver_and_counts_their_work() {
    let place = Place::new();
    room(&place);
    let report = |flags: &str| -> Value {
        place.run(&format!("light room.obj {flags} -o a.onl --report a.json")).with_code(0);
        serde_json::from_slice(&place.read("a.json")).unwrap()
    };
    for (method, solver, basis) in [
        ("classical", "shooting", "haar"),
        ("galerkin", "gauss-seidel", "m2"),
        ("hierarchical", "southwell", "haar"),
        ("wavelet", "jacobi", "m2"),
    ] {
        let told = report(&format!("--method {method} --solver {solver} --error 20%"));
        let said = |name: &str| told["settings"][name].as_str().map(str::to_owned);
        assert_eq!([said("method"), said("solver"), said("basis")], [method, solver, basis].map(|s| Some(s.into())));
        let shoots = matches!(solver, "shooting" | "southwell");
        assert_eq!(told["shots"].as_u64().unwrap() > 0, shoots, "{method} {solver}");
        assert!(told["iterations"].as_u64().unwrap() > 0);
    }
    assert!(report("--error 5%")["settings"]["solver"].is_null());
    let told = report("--error 5% --method wavelet --basis auto --oracle fit");
    let said = |name: &str| told["settings"][name].as_str().map(str::to_owned);
    assert_eq!(["basis", "oracle", "weight"].map(said), ["auto", "fit", "brightness"].map(|s| Some(s.into())));
    let told = report("--error 10% --method wavelet --decomposition standard");
    let terms = |name: &str| told["terms"][name].as_u64().unwrap();
    assert!(terms("standard") < terms("full") && terms("nonstandard") < terms("full"), "{}", told["terms"]);
    assert!(told["settings"]["oracle"].is_null() && told["settings"]["decomposition"] == "standard");
    // a subdivision that is too coarse is a result that misses its tolerance
    let ended = place.run("light room.obj --method classical --subdivision 1 --error 1% -o a.onl").with_code(1);
    assert!(ended.err.contains("subdivision of 1 is too coarse"), "{}", ended.err);
}

#[test]
fn every_ending_is_written_and_nothing_else() {
    let place = Place::new();
    room(&place);
    let outputs = "-o a.png -o a.EXR -o a.glb -o a.csv -o a.onl";
    place.run(&format!("light room.obj --error 5% {outputs} --camera eye=1,-4,1:at=1,1,0:fov=50")).with_code(0);
    let names = ["a.EXR", "a.csv", "a.elements.csv", "a.glb", "a.onl", "a.png", "room.mtl", "room.obj"];
    assert_eq!(place.names(), names);
    assert!(place.read("a.EXR").starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    assert!(place.text("a.csv").starts_with("receiver,receiver_side,receiver_object,"));
    let elements = place.text("a.elements.csv");
    assert!(elements.contains(",floor,") && elements.contains(",lamp,"), "{elements}");
}

#[test]
fn the_solution_is_the_same_to_the_byte_for_any_number_of_threads() {
    let place = Place::new();
    for threads in [1, 2, 5] {
        place.run(&format!("light --error 4% -o {threads}.onl --threads {threads}")).with_code(0);
    }
    let one = place.read("1.onl");
    assert!(one == place.read("2.onl") && one == place.read("5.onl"));
}

#[test]
fn both_sides_of_an_obj_can_be_asked_for() {
    let place = Place::new();
    room(&place);
    place.run("light room.obj --error 5% -o one.onl --report one.json").with_code(0);
    place.run("light room.obj --error 5% -o two.onl --report two.json --two-sided").with_code(0);
    let emitted = |name: &str| -> f64 {
        let report: Value = serde_json::from_slice(&place.read(name)).unwrap();
        report["ledger"]["emitted"][0].as_f64().unwrap()
    };
    assert!((emitted("two.json") / emitted("one.json") - 2.0).abs() < 1e-9);
}

#[test]
fn flatlets_on_triangles_say_what_stands_in_for_them() {
    let place = Place::new();
    room(&place);
    let cut = crate::program::ROOM.replace("f 1 2 3 4", "f 1 2 3");
    place.write("room.obj", cut);
    let ended = place.run("light room.obj --basis f2 --error 10% -o room.onl").with_code(0);
    assert!(ended.err.contains("no flatlets on triangles") && ended.err.contains("m2 stands in"), "{}", ended.err);
}

#[test]
fn a_time_limit_gives_an_unfinished_result_and_says_so() {
    let place = Place::new();
    let start = std::time::Instant::now();
    let ended = place.run("light --error 0.02% --max-time 300ms -o a.onl --report a.json").with_code(1);
    assert!(start.elapsed().as_secs_f64() < 5.0, "{:?}", start.elapsed());
    assert!(ended.err.contains("--max-time") && ended.err.contains("unfinished"), "{}", ended.err);
    let report: Value = serde_json::from_slice(&place.read("a.json")).unwrap();
    assert_eq!((&report["finished"], report["stopped_by"].as_str()), (&Value::Bool(false), Some("max-time")));
    assert!(report["ledger"].is_null());
    assert_eq!(place.names(), ["a.json", "a.onl"]);
}

#[test]
fn info_tells_what_is_in_a_scene() {
    let place = Place::new();
    room(&place);
    let ended = place.run("info room.obj").with_code(0);
    for said in ["2 parallelograms", "lamp: reflectance 0 0 0", "bounds", "W", "warnings   none"] {
        assert!(ended.out.contains(said), "no '{said}' in:\n{}", ended.out);
    }
    assert!(ended.err.is_empty(), "{}", ended.err);
    assert!(place.run("info builtin:cornell").with_code(0).out.contains("cornell"));
    // zero-area and repeated faces are dropped with a count
    place.write("room.obj", format!("{}f 1 1 2\nf 5 6 7 8\n", crate::program::ROOM));
    let ended = place.run("info room.obj").with_code(0);
    assert!(ended.out.contains("1 zero-area face dropped") && ended.out.contains("1 duplicate face"), "{}", ended.out);
}

#[test]
fn help_mentions_every_flag_and_ends_with_0() {
    let place = Place::new();
    // words, however they are wrapped
    let help = |arguments: &str| -> String {
        place.run(arguments).with_code(0).out.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let light = help("light --help");
    let flags = ["-o", "--basis", "--error", "--max-time", "--threads", "--two-sided", "--camera", "--report"];
    let links = [
        "--method",
        "--solver",
        "--subdivision",
        "--oracle",
        "--weight",
        "auto",
        "gauss-seidel",
        "progressive",
        "galerkin",
    ];
    let values =
        [".glb", ".png", ".exr", ".csv", ".onl", "out/NAME", "haar", "f1 to f4", "eye=x,y,z", "builtin:cornell"];
    for said in flags.into_iter().chain(values).chain(links) {
        assert!(light.contains(said), "no '{said}' in:\n{light}");
    }
    assert!(light.contains("Examples:"));
    let probe = help("probe --help");
    for said in ["-o", "--gather", "x,y,z,nx,ny,nz", "SOLUTION.onl", "POINTS.csv", "Examples:"] {
        assert!(probe.contains(said), "no '{said}' in:\n{probe}");
    }
    let all = help("--help");
    for said in ["light", "probe", "info", "Exit codes: 0 done"] {
        assert!(all.contains(said), "no '{said}' in:\n{all}");
    }
    assert!(place.run("--version").with_code(0).out.contains(env!("CARGO_PKG_VERSION")));
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_reason_to_panic() {
    let place = Place::new();
    room(&place);
    for arguments in ["info room.obj", "light room.obj --error 5% -o room.onl", "light missing.obj"] {
        let mut command = place.command(arguments);
        // readers that are gone before the program writes
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let status = command.stdout(writer.try_clone().unwrap()).stderr(writer).status().unwrap();
        let expected = if arguments.ends_with("missing.obj") { 2 } else { 0 };
        assert_eq!(status.code(), Some(expected), "{arguments}");
    }
    assert!(place.read("room.onl").starts_with(b"ONDELETTE"));
}
