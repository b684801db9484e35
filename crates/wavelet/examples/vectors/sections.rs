//! Which section is checked by what.

use crate::report::Report;
use crate::{bases, shapes};

/// Checks every section of a file.
pub(crate) fn run(file: &serde_json::Value, report: &mut Report) {
    let Some(sections) = file.as_object() else {
        return report.fail("file", "is not an object of sections");
    };
    for (name, section) in sections {
        match name.as_str() {
            "meta" => {}
            "filters" => bases::filters(section, report),
            "pyramid" => report.each(name, section, bases::pyramid),
            "hybrid" => bases::hybrid(section, report),
            "index" => bases::index(section, report),
            "semi" => bases::semi(section, report),
            "tensor2d" => report.each(name, section, shapes::tensor2d),
            "tensor4d" => report.each(name, section, shapes::tensor4d),
            "operator1d" => report.each(name, section, shapes::operator1d),
            "bspline_eval" => shapes::bspline_eval(section, report),
            "frames" => shapes::frames(section, report),
            "hessian" => shapes::hessian(section, report),
            "scaling" => shapes::scaling(section, report),
            _ => report.skip(name),
        }
    }
}
