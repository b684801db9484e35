//! The `ondelette` command: raw arguments ([`args`]), a validated plan ([`plan`]), the run ([`run`]).
//!
//! Data goes to standard output, everything else to standard error. Exit codes: 0 done, 1 a valid result that is
//! unfinished or misses its tolerance, 2 bad input or usage.

mod args;
mod interrupt;
mod plan;
mod progress;
mod report;
mod run;
mod transform;

use args::{Args, Command};
use clap::Parser;
use run::{Outcome, Refusal};
use std::process::ExitCode;

fn main() -> ExitCode {
    // usage errors end here with exit code 2, --help and --version with 0
    match dispatch(Args::parse().command) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Unfinished) => ExitCode::from(1),
        Err(refusal) => {
            run::tell(format_args!("error: {refusal}"));
            ExitCode::from(2)
        }
    }
}

fn dispatch(command: Command) -> Result<Outcome, Refusal> {
    match command {
        Command::Light(args) => run::light::run(plan::light::LightPlan::new(&args)?),
        Command::Relight(args) => run::relight::run(plan::light::RelightPlan::new(&args)?),
        Command::Probe(args) => run::probe::run(&args),
        Command::Verify(args) => run::verify::run(&args),
        Command::Info(args) => run::info::run(&args),
        Command::Curve(args) => run::design::run(&plan::shape::DesignPlan::new(&args.design, 1)?),
        Command::Surface(args) => run::design::run(&plan::shape::DesignPlan::new(&args.design, 2)?),
        Command::Fit(args) => run::fit::run(&plan::shape::FitPlan::new(&args)?),
        Command::Edit(args) => run::edit::run(&plan::shape::EditPlan::new(&args)?),
        Command::Transform(args) => transform::run(&args).map(|()| Outcome::Done).map_err(Refusal::new),
    }
}
