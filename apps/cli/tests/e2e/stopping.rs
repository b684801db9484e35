//! Ctrl-C.

use crate::program::{Ended, Place};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Starts a run that would take minutes, and lets it get going.
fn long_run(place: &Place, outputs: &str) -> Child {
    let mut command = place.command(&format!("light --error 0.01% {outputs}"));
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    sleep(Duration::from_millis(1500));
    child
}

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

#[test]
fn the_first_writes_the_state_reached_and_ends_with_1() {
    let place = Place::new();
    let child = long_run(&place, "-o a.onl -o a.glb --report a.json");
    interrupt(&child);
    let start = Instant::now();
    let ended = Ended::of(child.wait_with_output().unwrap()).with_code(1);
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
    assert!(ended.err.contains("Ctrl-C") && ended.err.contains("unfinished"), "{}", ended.err);
    assert_eq!(place.names(), ["a.glb", "a.json", "a.onl"]);
    assert!(place.text("a.json").contains("\"stopped_by\": \"ctrl-c\""));
    // the solution is whole, says that it is unfinished, and can be asked
    place.write("points.csv", "0.2,0,0.2,0,1,0\n");
    let probed = place.run("probe a.onl points.csv --gather").with_code(0);
    assert!(probed.err.contains("a.onl is unfinished"), "{}", probed.err);
    assert_eq!(probed.out.lines().count(), 2);
}

#[test]
fn the_second_ends_the_program_at_once_and_leaves_no_half_written_file() {
    let place = Place::new();
    let child = long_run(&place, "-o a.exr");
    interrupt(&child);
    sleep(Duration::from_millis(100));
    interrupt(&child);
    let ended = Ended::of(child.wait_with_output().unwrap()).with_code(130);
    assert!(ended.out.is_empty());
    assert!(place.names().is_empty(), "{:?}", place.names());
}
