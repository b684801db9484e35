//! `ondelette info`.

use super::{Outcome, Refusal, print};
use crate::args::InfoArgs;
use ondelette_io::{ReadOptions, read_scene};
use ondelette_radiosity::scene::describe;

pub(crate) fn run(args: &InfoArgs) -> Result<Outcome, Refusal> {
    let scene = read_scene(&args.scene, &ReadOptions::default())?;
    print(&describe(&scene))?;
    Ok(Outcome::Done)
}
