//! The checks that CI and contributors run.

fn main() {}
