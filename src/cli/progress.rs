//! Progress on stderr: a bar on a terminal, a line every tenth and every minute otherwise, nothing with --quiet.

use std::fmt;
use std::io::{IsTerminal, stderr};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use crate::render::Status;

/// The longest silence in a log.
const SILENCE: Duration = Duration::from_secs(60);

/// A run's progress. It may be told from any thread.
pub struct Progress {
    started: Instant,
    kind: Kind,
}

enum Kind {
    Quiet,
    Bar(ProgressBar),
    Lines(Mutex<Told>),
}

/// What was said last.
struct Told {
    tenths: u64,
    at: Instant,
}

impl Progress {
    /// Starts the clock.
    pub fn new(quiet: bool) -> Self {
        let started = Instant::now();
        let kind = if quiet {
            Kind::Quiet
        } else if stderr().is_terminal() {
            Kind::Bar(bar())
        } else {
            Kind::Lines(Mutex::new(Told {
                tenths: 0,
                at: started,
            }))
        };
        Self { started, kind }
    }

    /// The run is so far.
    pub fn report(&self, status: &Status) {
        let state = || State::new(status, self.started.elapsed());
        match &self.kind {
            Kind::Quiet => {}
            Kind::Bar(bar) => {
                bar.set_length(status.total);
                bar.set_position(status.done);
                bar.set_message(format!(", {}", state()));
            }
            Kind::Lines(told) => {
                let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
                let tenths = 10 * status.done / status.total.max(1);
                if tenths > told.tenths || told.at.elapsed() >= SILENCE {
                    eprintln!("{}", state().line());
                    *told = Told {
                        tenths,
                        at: Instant::now(),
                    };
                }
            }
        }
    }

    /// Says what went wrong and ends nothing.
    pub fn warn(&self, warning: &str) {
        let say = || super::warn(&[warning.to_owned()]);
        match &self.kind {
            Kind::Bar(bar) => bar.suspend(say),
            _ => say(),
        }
    }

    /// Wipes the bar.
    pub fn finish(&self) {
        if let Kind::Bar(bar) = &self.kind {
            bar.finish_and_clear();
        }
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(0);
    // The template is a constant; were it wrong, the default style would do.
    let template = "rendering [{wide_bar}] {percent} %{msg}, {eta} left";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar
}

/// What there is to say of a status.
#[derive(Clone, Copy, Debug)]
struct State {
    percent: u64,
    elapsed: Duration,
    left: Duration,
    /// Mean samples of a pixel, and how many it is to get.
    spp: (f64, usize),
    pass: usize,
    passes: usize,
    mrays_per_second: f64,
}

impl State {
    fn new(status: &Status, elapsed: Duration) -> Self {
        let &Status {
            frame,
            done,
            total,
            pass,
            passes,
            rays,
        } = status;
        let (seconds, spp) = (elapsed.as_secs_f64(), frame.samples().len());
        let left = total.saturating_sub(done) as f64;
        let left_each = left / frame.window().pixels().max(1) as f64;
        Self {
            percent: 100 * done / total.max(1),
            elapsed,
            left: Duration::try_from_secs_f64(seconds * left / done.max(1) as f64)
                .unwrap_or(Duration::MAX),
            spp: (spp as f64 - left_each, spp),
            pass,
            passes,
            mrays_per_second: rays.total() as f64 / seconds.max(1e-9) / 1e6,
        }
    }

    /// The line of a log.
    fn line(&self) -> String {
        let Self {
            percent,
            elapsed,
            left,
            ..
        } = self;
        let seconds = elapsed.as_secs_f64();
        format!(
            "rendering: {percent} % after {seconds:.1} s, {self}, {} left",
            HumanDuration(*left)
        )
    }
}

/// Samples and speed.
impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            spp: (have, spp),
            pass,
            passes,
            mrays_per_second,
            ..
        } = self;
        write!(f, "{have:.1} of {spp} spp, ")?;
        if *passes > 1 {
            write!(f, "pass {pass} of {passes}, ")?;
        }
        write!(f, "{mrays_per_second:.2} Mrays/s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::RayCounts;
    use crate::render::film::{Frame, Objects};
    use crate::scene::Film;

    #[test]
    fn a_line_tells_samples_speed_and_time_left() {
        let film = Film {
            width: 10,
            height: 10,
            ..Film::default()
        };
        let frame = Frame::new(&film, 0..16, Objects::default());
        let rays = RayCounts {
            camera: 1_000_000,
            shadow: 500_000,
            ..RayCounts::default()
        };
        let status = Status {
            frame: &frame,
            done: 400,
            total: 1600,
            pass: 4,
            passes: 5,
            rays,
        };
        let elapsed = Duration::from_secs(2);
        assert_eq!(
            State::new(&status, elapsed).line(),
            "rendering: 25 % after 2.0 s, 4.0 of 16 spp, pass 4 of 5, 0.75 Mrays/s, 6 seconds left"
        );
        // Half was there before.
        let resumed = Status {
            total: 800,
            passes: 1,
            ..status
        };
        let line = State::new(&resumed, elapsed).line();
        assert!(
            line.contains("50 % after 2.0 s, 12.0 of 16 spp, 0.75 Mrays/s"),
            "{line}"
        );
        let nothing = Status {
            done: 0,
            total: 0,
            ..status
        };
        State::new(&nothing, Duration::ZERO).line();
    }
}
