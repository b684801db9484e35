//! `ondelette relight`: read a solution, paint its materials, balance, and spend rays only if asked to.

use super::light::{camera, finish, is_drawn, most_counted};
use super::{Outcome, Refusal};
use crate::interrupt::Stop;
use crate::plan::light::RelightPlan;
use crate::progress::Progress;
use crate::report::Stages;
use ondelette_io::onl::read_solution;
use ondelette_numerics::par;
use ondelette_radiosity::{Event, Solver};

pub(crate) fn run(plan: RelightPlan) -> Result<Outcome, Refusal> {
    let stop = Stop::new(plan.light.max_time, plan.light.folders())?;
    match plan.light.threads {
        Some(n) => par::with_threads(n, || relight(plan, stop))
            .map_err(|e| Refusal::new(format!("--threads {n}: the system gives no such number of threads: {e}")))?,
        None => relight(plan, stop),
    }
}

fn relight(plan: RelightPlan, stop: Stop) -> Result<Outcome, Refusal> {
    let mut stages = Stages::start();
    let solution = read_solution(&plan.light.scene)?;
    stages.end("read");
    let mut solver = Solver::resume(&solution)?;
    let settings = solution.settings();
    drop(solution);
    if let Some(direct) = plan.direct {
        solver.read_direct(direct)?;
    }
    if let Some(error) = plan.error {
        solver.promise(error)?;
    }
    solver.relight(&plan.paints)?;
    stages.end("resume");
    let settings = ondelette_radiosity::Settings { error: plan.error.unwrap_or(settings.error), ..settings };
    let mut light = plan.light;
    light.settings = settings;
    let outputs = light.outputs(&solver.scene().name);
    let camera = outputs.files.iter().any(|o| is_drawn(o.kind)).then(|| camera(solver.scene(), light.camera));
    let camera = camera.transpose()?;
    let mut progress = Progress::new(settings.error);
    let (mut stopped, mut counted) = (None, 0);
    loop {
        stopped = stopped.or(stop.asked());
        if stopped.is_some() {
            break;
        }
        let Some(event) = solver.step() else { break };
        progress.solving(event);
        counted = most_counted(counted, &solver, event);
        if matches!(event, Event::Solved { .. }) && !plan.refine {
            break;
        }
    }
    stages.end("solve");
    finish(&light, solver, counted, stopped, stages, &outputs, camera, stop, progress)
}
