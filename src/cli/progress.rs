//! Progress on stderr: a bar on a terminal, a line every tenth otherwise, nothing with --quiet.

use std::io::{IsTerminal, stderr};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

/// A run's progress. `report` may be called from any thread.
pub struct Progress(Kind);

enum Kind {
    Quiet,
    Bar(ProgressBar),
    Lines {
        started: Instant,
        /// Tenths already told.
        told: AtomicUsize,
    },
}

impl Progress {
    /// Starts the clock.
    pub fn new(quiet: bool) -> Self {
        Self(if quiet {
            Kind::Quiet
        } else if stderr().is_terminal() {
            Kind::Bar(bar())
        } else {
            Kind::Lines {
                started: Instant::now(),
                told: AtomicUsize::new(0),
            }
        })
    }

    /// `done` of `total` steps are done.
    pub fn report(&self, done: usize, total: usize) {
        match &self.0 {
            Kind::Quiet => {}
            Kind::Bar(bar) => {
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            }
            Kind::Lines { started, told } => {
                let tenths = 10 * done / total.max(1);
                if told.fetch_max(tenths, Ordering::Relaxed) < tenths {
                    let seconds = started.elapsed().as_secs_f64();
                    eprintln!("rendering: {} % after {seconds:.1} s", 10 * tenths);
                }
            }
        }
    }

    /// Wipes the bar.
    pub fn finish(&self) {
        if let Kind::Bar(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(0);
    // The template is a constant; were it wrong, the default style would do.
    if let Ok(style) = ProgressStyle::with_template("rendering [{wide_bar}] {percent} % {eta} left")
    {
        bar.set_style(style.progress_chars("=> "));
    }
    bar
}
