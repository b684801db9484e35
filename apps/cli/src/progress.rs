//! What a person sees while waiting: a bar on a terminal after the first second, nothing anywhere else.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ondelette_radiosity::Event;
use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

/// Short runs show nothing.
const QUIET: Duration = Duration::from_secs(1);
/// Drawings a second.
const RATE: u8 = 8;
/// Length of the bar in steps.
const STEPS: f64 = 1000.0;

/// A bar for the stages of one run.
pub(crate) struct Progress {
    bar: ProgressBar,
    start: Instant,
    shown: bool,
    /// Promised error.
    target: f64,
    /// Error and seconds at each balance so far.
    history: Vec<(f64, f64)>,
    error: String,
}

impl Progress {
    pub(crate) fn new(target: f64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(STEPS as u64), ProgressDrawTarget::hidden());
        // a template that does not parse would only cost the bar's looks
        if let Ok(style) = ProgressStyle::with_template("{spinner} {bar:24} {wide_msg}") {
            bar.set_style(style);
        }
        Progress { bar, start: Instant::now(), shown: false, target, history: Vec::new(), error: String::new() }
    }

    /// Shows a stage, `share` of which is done.
    pub(crate) fn stage(&mut self, name: &str, share: f64) {
        if !self.is_due() {
            return;
        }
        self.bar.set_position((share.clamp(0.0, 1.0) * STEPS) as u64);
        self.bar.set_message(name.to_owned());
        self.bar.tick();
    }

    /// Shows what the solver did.
    pub(crate) fn solving(&mut self, event: Event) {
        let now = self.start.elapsed().as_secs_f64();
        if let Event::Solved { error, links, .. } = event
            && error.is_finite()
            && error > 0.0
        {
            self.history.push((error, now));
            self.error = format!("error {:.3} % of {:.3} %, {links} links", 100.0 * error, 100.0 * self.target);
        }
        if !self.is_due() {
            return;
        }
        let what = match event {
            Event::Linking { done, total } => format!("linking, {done} of {total} pairs"),
            Event::Gathering { done, total } => format!("gathering, {done} of {total} elements"),
            Event::Refining { done, total } => format!("refining, {done} of {total} pairs"),
            Event::Iterated { iterations, residual, .. } => {
                format!("balancing, sweep {iterations}, rest {residual:.1e}")
            }
            Event::Solved { .. } => "judging".into(),
        };
        let left = self.seconds_left(now).map_or(String::new(), |s| format!("about {s:.0} s left; "));
        let error = if self.error.is_empty() { String::new() } else { format!("{}; ", self.error) };
        let share = match event {
            Event::Linking { done, total } if self.history.is_empty() => 0.1 * done as f64 / total.max(1) as f64,
            _ => 0.1 + 0.9 * self.descent(),
        };
        self.stage(&format!("{left}{error}{what}"), share);
    }

    /// How far the error has come down, on its logarithm.
    fn descent(&self) -> f64 {
        match self.history[..] {
            [(first, _), .., (last, _)] if first > self.target => {
                ((first / last).ln() / (first / self.target).ln()).clamp(0.0, 1.0)
            }
            _ => 0.0,
        }
    }

    /// Seconds left, if the time to an error goes on growing as a power of it.
    fn seconds_left(&self, now: f64) -> Option<f64> {
        let [.., (e1, t1), (e2, t2)] = self.history[..] else { return None };
        if e2 <= self.target || e2 >= e1 || t1 <= 0.0 {
            return None;
        }
        let power = (t2 / t1).ln() / (e1 / e2).ln();
        let left = t2 * (e2 / self.target).powf(power) - now;
        (left.is_finite() && left > 0.0).then_some(left)
    }

    fn is_due(&mut self) -> bool {
        if !self.shown && self.start.elapsed() >= QUIET && stderr().is_terminal() {
            self.bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(RATE));
            self.shown = true;
        }
        self.shown
    }

    /// Removes the bar.
    pub(crate) fn finish(self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_the_descent_of_the_error() {
        let mut progress = Progress::new(0.01);
        assert_eq!(progress.seconds_left(1.0), None);
        // halving the error takes twice the time
        progress.history = vec![(0.08, 1.0), (0.04, 2.0)];
        let left = progress.seconds_left(2.0).unwrap();
        assert!((left - 6.0).abs() < 1e-9, "{left}");
        assert!((progress.descent() - 1.0 / 3.0).abs() < 1e-9);
        // an error that rises promises nothing
        progress.history.push((0.05, 3.0));
        assert_eq!(progress.seconds_left(3.0), None);
        progress.history.push((0.005, 4.0));
        assert_eq!(progress.seconds_left(4.0), None);
        assert_eq!(progress.descent(), 1.0);
    }
}
