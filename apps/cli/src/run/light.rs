//! `ondelette light`: read, solve, draw, write, report.

use super::{Outcome, Refusal, tell};
use crate::interrupt::{Reason, Stop};
use crate::plan::light::{DEFAULT_FOLDER, Kind, LightPlan, Outputs};
use crate::plan::values::CameraRequest;
use crate::progress::Progress;
use crate::report::{Memory, Record, Stages};
use ondelette_io::onl::write_solution;
use ondelette_io::write::{
    LitModel, ModelPainter, ToneMap, create_folder, elements_path, scene_tone, write_bytes, write_exr, write_glb,
    write_png, write_tables,
};
use ondelette_io::{ReadOptions, read_scene};
use ondelette_numerics::par;
use ondelette_radiosity::ledger::Ledger;
use ondelette_radiosity::scene::{Camera, Shape};
use ondelette_radiosity::view::{Renderer, frame_from_inside};
use ondelette_radiosity::{DirectLight, Event, Scene, Solver};
use ondelette_wavelet::cell::CellFamily;

/// Pixels of a picture.
const PICTURE: [usize; 2] = [960, 720];
/// Rays of the ledger for a promised error of 1 %: they close it to about 0.05 %.
const LEDGER_RAYS: f64 = 65_536.0;
/// Fewest and most of them.
const LEDGER_LIMITS: [f64; 2] = [16_384.0, 1_048_576.0];
/// Warnings of the scene that are shown; `info` lists them all.
const SHOWN_WARNINGS: usize = 5;

pub(crate) fn run(plan: LightPlan) -> Result<Outcome, Refusal> {
    let stop = Stop::new(plan.max_time, plan.folders())?;
    match plan.threads {
        Some(n) => par::with_threads(n, || light(&plan, stop))
            .map_err(|e| Refusal::new(format!("--threads {n}: the system gives no such number of threads: {e}")))?,
        None => light(&plan, stop),
    }
}

fn light(plan: &LightPlan, stop: Stop) -> Result<Outcome, Refusal> {
    let mut stages = Stages::start();
    let mut progress = Progress::new(plan.settings.error);
    let scene = read_scene(&plan.scene, &ReadOptions { two_sided: plan.two_sided, panels: plan.panels.clone() })?;
    stages.end("read");
    if stop.signalled() {
        tell("stopped by Ctrl-C before anything was computed: nothing was written");
        return Ok(Outcome::Unfinished);
    }
    remark(&scene, plan);
    let outputs = plan.outputs(&scene.name);
    let camera = outputs.files.iter().any(|o| is_drawn(o.kind)).then(|| camera(&scene, plan.camera));
    let camera = camera.transpose()?;

    let mut solver = Solver::within(scene, plan.settings, plan.memory)?;
    if plan.uses_default_folder() {
        create_folder(DEFAULT_FOLDER.as_ref())?;
    }
    outputs.check(&plan.scene)?;
    let (mut stopped, mut counted) = (None, 0);
    loop {
        stopped = stopped.or(stop.asked());
        if stopped.is_some() {
            break;
        }
        let Some(event) = solver.step() else { break };
        progress.solving(event);
        counted = most_counted(counted, &solver, event);
    }
    stages.end("solve");
    let record = finish(plan, solver, counted, stopped, stages, &outputs, camera, stop, progress)?;
    Ok(record)
}

/// The most bytes counted so far. Looked at once a balance: memory changes little in between.
pub(super) fn most_counted(until_now: u64, solver: &Solver, event: Event) -> u64 {
    if matches!(event, Event::Solved { .. }) { until_now.max(solver.counted_bytes()) } else { until_now }
}

/// Everything after the solver's last step, of which `counted` bytes are the most that were held until then: files,
/// ledger, picture, report, summary.
pub(super) fn finish(
    plan: &LightPlan,
    solver: Solver,
    counted: u64,
    stopped: Option<Reason>,
    stages: Stages,
    outputs: &Outputs,
    camera: Option<Camera>,
    stop: Stop,
    mut progress: Progress,
) -> Result<Outcome, Refusal> {
    let memory = Memory { counted: counted.max(solver.counted_bytes()), scene: solver.scene_bytes() };
    let solution = if plan.keep { solver.into_kept() } else { solver.into_solution() };
    let is_sampled = !solution.settings().method.has_links();
    let is_gathered = solution.settings().direct == DirectLight::Gathered;
    if (plan.keep || is_gathered) && is_sampled && solution.kept().is_none() {
        let what = if is_gathered { "direct light is read as fitted" } else { "the samples are not kept" };
        tell(format_args!("note: stopped in the middle of a refinement: {what}"));
    }
    if plan.keep && !is_sampled && solution.links().is_empty() {
        tell("note: --memory has no room for all links: they are not kept");
    }
    let mut record = Record { plan, solution: &solution, memory, ledger: None, stopped, stages, written: Vec::new() };
    write_outputs(&mut record, outputs, camera, stop, &mut progress)?;
    progress.finish();
    if let Some(path) = &outputs.report {
        record.written.push(path.clone());
        let mut text = format!("{:#}", record.json());
        text.push('\n');
        write_bytes(path, text.as_bytes())?;
    }
    tell(record.summary().trim_end());
    let complete = record.stopped.is_none() && record.keeps_promise();
    Ok(if complete { Outcome::Done } else { Outcome::Unfinished })
}

/// Writes the files, the most valuable first. A Ctrl-C that comes during this stage leaves out what takes long.
fn write_outputs(
    record: &mut Record<'_>,
    outputs: &Outputs,
    camera: Option<Camera>,
    stop: Stop,
    progress: &mut Progress,
) -> Result<(), Refusal> {
    let solution = record.solution;
    let quick = outputs.files.iter().filter(|o| !is_drawn(o.kind));
    for output in quick {
        progress.stage(&format!("writing {}", output.path.display()), 0.0);
        match output.kind {
            Kind::Solution => write_solution(&output.path, solution)?,
            Kind::Tables => {
                write_tables(&output.path, solution)?;
                record.written.push(elements_path(&output.path));
            }
            _ => {
                let Some(model) = paint(record, camera, stop, progress) else {
                    record.stopped = Some(Reason::Signal);
                    tell("stopped by Ctrl-C while gathering shadows: the model and the picture are left out");
                    return Ok(());
                };
                progress.stage(&format!("writing {}", output.path.display()), 0.0);
                write_glb(&output.path, &model)?;
            }
        }
        record.written.push(output.path.clone());
        record.stages.end(stage_of(output.kind));
    }
    if record.stopped.is_none() && !stop.signalled() {
        progress.stage("counting the energy", 0.0);
        let finer = (0.01 / solution.settings().error).powi(2);
        let rays = (LEDGER_RAYS * finer).clamp(LEDGER_LIMITS[0], LEDGER_LIMITS[1]);
        record.ledger = Some(Ledger::count(solution, rays as u64));
        record.stages.end("ledger");
    }
    let Some(camera) = camera else { return Ok(()) };
    let Some(pixels) = draw(record, &camera, stop, progress) else {
        record.stopped = Some(Reason::Signal);
        tell("stopped by Ctrl-C while drawing: the picture is left out");
        return Ok(());
    };
    record.stages.end("draw");
    let size = PICTURE.map(|n| n as u32);
    for output in outputs.files.iter().filter(|o| is_drawn(o.kind)) {
        if output.kind == Kind::Picture {
            let tone = ToneMap::auto(&pixels);
            let pixels: Vec<[u8; 3]> = pixels.iter().map(|p| tone.encode(*p)).collect();
            write_png(&output.path, size[0], size[1], &pixels)?;
        } else {
            let quantity = solution.scene().quantity;
            let notes = [("quantity", quantity.radiance_name()), ("unit", quantity.radiance_unit())];
            write_exr(&output.path, size[0], size[1], &pixels, &notes)?;
        }
        record.written.push(output.path.clone());
        record.stages.end(stage_of(output.kind));
    }
    Ok(())
}

/// The lit model, or nothing if a Ctrl-C came that had not come before.
fn paint(record: &Record<'_>, camera: Option<Camera>, stop: Stop, progress: &mut Progress) -> Option<LitModel> {
    let solution = record.solution;
    let mut painter = ModelPainter::new(solution, scene_tone(solution), camera_of_model(record, camera));
    loop {
        if stop.signalled() && record.stopped != Some(Reason::Signal) {
            return None;
        }
        if painter.step() {
            return Some(painter.into_model());
        }
        progress.stage("painting the model", painter.progress());
    }
}

/// The picture, or nothing if a Ctrl-C came that had not come before.
fn draw(record: &Record<'_>, camera: &Camera, stop: Stop, progress: &mut Progress) -> Option<Vec<[f32; 3]>> {
    let mut renderer = Renderer::new(record.solution, camera, PICTURE[0], PICTURE[1]);
    loop {
        if stop.signalled() && record.stopped != Some(Reason::Signal) {
            return None;
        }
        if renderer.step() {
            return Some(renderer.into_pixels());
        }
        progress.stage("drawing", renderer.progress());
    }
}

pub(super) fn is_drawn(kind: Kind) -> bool {
    matches!(kind, Kind::Picture | Kind::LinearPicture)
}

fn stage_of(kind: Kind) -> &'static str {
    match kind {
        Kind::Solution => "write_onl",
        Kind::Tables => "write_csv",
        Kind::Model => "write_glb",
        Kind::Picture => "write_png",
        Kind::LinearPicture => "write_exr",
    }
}

/// What a user should know before the wait.
fn remark(scene: &Scene, plan: &LightPlan) {
    for warning in scene.warnings.iter().take(SHOWN_WARNINGS) {
        tell(format_args!("warning: {warning}"));
    }
    if scene.warnings.len() > SHOWN_WARNINGS {
        let more = scene.warnings.len() - SHOWN_WARNINGS;
        tell(format_args!("warning: and {more} more; `ondelette info {}` lists them", plan.scene.display()));
    }
    let basis = plan.settings.basis;
    let triangles = scene.patches.iter().filter(|p| p.shape == Shape::Triangle).count();
    if basis.family() == CellFamily::Flatlet && basis.order > 1 && triangles > 0 {
        tell(format_args!(
            "note: there are no flatlets on triangles: on {triangles} of them m{} stands in",
            basis.order
        ));
    }
}

/// The camera asked for, else the file's, else one inside the scene.
pub(super) fn camera(scene: &Scene, asked: Option<CameraRequest>) -> Result<Camera, Refusal> {
    let Some(CameraRequest { eye, at, up, fov }) = asked else {
        return Ok(scene.camera.unwrap_or_else(|| frame_from_inside(scene)));
    };
    let up = up.unwrap_or_else(|| {
        let up = scene.camera.map_or_else(|| frame_from_inside(scene).up, |c| c.up);
        // straight up or down: any direction across the view will do
        let view = (at - eye).normalize();
        if up.cross(view).length() > 1e-6 * up.length() { up } else { view.any_orthogonal_vector() }
    });
    let camera = Camera { eye, at, up, fov };
    if !camera.is_usable() {
        return Err(Refusal::new("--camera: it looks nowhere; write eye=x,y,z:at=x,y,z:fov=40"));
    }
    Ok(camera)
}

/// The camera that a lit model carries: that of the picture, else the file's.
fn camera_of_model(record: &Record<'_>, camera: Option<Camera>) -> Option<Camera> {
    camera.or(record.solution.scene().camera)
}
