//! Every reference vector that concerns this crate, through the checker of `examples/vectors`.

#[path = "../examples/vectors/bases.rs"]
mod bases;
#[path = "../examples/vectors/report.rs"]
mod report;
#[path = "../examples/vectors/sections.rs"]
mod sections;
#[path = "../examples/vectors/shapes.rs"]
mod shapes;

use report::Report;

fn run(file: &serde_json::Value) -> Report {
    let mut report = Report::default();
    sections::run(file, &mut report);
    report
}

fn vectors() -> serde_json::Value {
    serde_json::from_str(include_str!("data/vectors.json")).expect("the vectors are JSON")
}

#[test]
fn all_vectors_of_this_crate_hold() {
    let report = run(&vectors());
    let failed: Vec<_> = report.lines.iter().filter(|l| l.contains(" FAIL ")).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(report.passed > 900, "only {} fields were compared", report.passed);
    assert_eq!(report.skipped, 3);
}

#[test]
fn a_wrong_number_and_a_broken_entry_are_reported() {
    let mut file = vectors();
    let w = &mut file["pyramid"][3]["coef_up"]["w"][0][0];
    *w = serde_json::json!(w.as_f64().expect("a number") + 1e-9);
    file["tensor2d"][0]["family"] = serde_json::json!("nonsense");
    file["semi"]["pyramid"][0]["x"] = serde_json::json!([1.0, 2.0]);
    let report = run(&file);
    assert_eq!(report.failed, 3, "{:#?}", report.lines.iter().filter(|l| l.contains(" FAIL ")).collect::<Vec<_>>());
}

#[test]
fn missing_sections_are_fine() {
    let report = run(&serde_json::json!({ "meta": {}, "flatland": {}, "hessian": { "stencils": {} } }));
    assert_eq!((report.passed, report.failed, report.skipped), (0, 0, 1));
}
