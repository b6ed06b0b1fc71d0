//! What is seen of a render while it runs: its progress, its file, a viewer.

use std::net::TcpStream;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use glam::UVec2;

use super::error::CliError;
use super::interrupt::Interrupt;
use super::parse;
use super::preview::Preview;
use super::progress::Progress;
use super::tev::{Address, Image, Viewer};
use crate::render::film::Frame;
use crate::render::{Control, Outcome, RenderInput, Status, render_frame};

/// How a render is watched.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct WatchArgs {
    /// Write the picture while it renders, every so many seconds (3 without a value); samples are taken in passes over all of it
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, default_missing_value = "3", value_parser = parse::seconds)]
    pub preview: Option<Duration>,
    /// Show the picture in the viewer tev while it renders (127.0.0.1:14158, where tev listens, without a value)
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = Address::USUAL)]
    pub tev: Option<Address>,
}

impl WatchArgs {
    /// Connects to the viewer, if there is to be one.
    pub fn connect(&self) -> Result<Option<TcpStream>, CliError> {
        let connect = |address: &Address| {
            address.connect().map_err(|source| CliError::Viewer {
                address: address.clone(),
                source,
            })
        };
        self.tev.as_ref().map(connect).transpose()
    }
}

/// A render and who watches it.
pub struct Watched<'a> {
    /// What is rendered.
    pub input: RenderInput<'a>,
    /// What ends it early.
    pub interrupt: &'a Interrupt,
    /// Say nothing but warnings.
    pub quiet: bool,
    /// Writes the picture as it is.
    pub write: &'a (dyn Fn(&Frame) -> Result<(), CliError> + Sync),
    /// How often it is written meanwhile; `None` for after every pass.
    pub preview: Option<Duration>,
    /// A viewer that it is sent to.
    pub viewer: Option<TcpStream>,
    /// What it is called there.
    pub name: &'a Path,
}

impl Watched<'_> {
    /// Gives `frame` what it lacks. Fails where the picture could not be written on the way; a viewer that goes away is a warning.
    pub fn render(self, frame: &mut Frame) -> Result<Outcome, CliError> {
        let progress = Progress::new(self.quiet);
        let written = Written::new(self.write);
        let preview = self.preview.map(Preview::new);
        let viewer = self.viewer.is_some().then(|| self.viewer_of(frame));
        let outcome = thread::scope(|scope| {
            // Also when a panic passes by: the scope waits for its threads.
            let _end = Finally(|| {
                preview.iter().for_each(Preview::end);
                viewer.iter().for_each(Viewer::end);
            });
            if let Some(preview) = &preview {
                scope.spawn(|| preview.write_all(|frame| written.write(frame)));
            }
            if let (Some(viewer), Some(stream)) = (&viewer, &self.viewer) {
                scope.spawn(|| {
                    if let Err(lost) = viewer.send(stream) {
                        progress.warn(&format!(
                            "the viewer gets no more of the picture (--tev): {lost}"
                        ));
                    }
                });
            }
            let mut pass = |frame: &Frame| written.write(frame);
            let control = Control {
                progress: &|status: &Status| {
                    progress.report(status);
                    preview.iter().for_each(|preview| preview.offer(status));
                },
                tile_done: &|tile: &Frame| {
                    if let Some(viewer) = &viewer {
                        viewer.put(tile.window(), &tile.shown_values());
                    }
                },
                stop: &|| self.interrupt.signal().is_some() || written.has_failed(),
                pass: preview.is_none().then_some(&mut pass),
                tile: None,
            };
            render_frame(&self.input, frame, control)
        });
        progress.finish();
        written.error().map_or(Ok(outcome), Err)
    }

    /// A viewer's image of `frame`, with what it has already.
    fn viewer_of(&self, frame: &Frame) -> Viewer {
        let film = self.input.film;
        let viewer = Viewer::new(Image {
            name: self.name.to_string_lossy().into_owned(),
            size: UVec2::new(film.width, film.height),
            window: frame.window(),
            channels: frame.shown_channels(),
        });
        viewer.put(frame.window(), &frame.shown_values());
        viewer
    }
}

/// Writes pictures until one cannot be written.
struct Written<'a> {
    write: &'a (dyn Fn(&Frame) -> Result<(), CliError> + Sync),
    has_failed: AtomicBool,
    error: Mutex<Option<CliError>>,
}

impl<'a> Written<'a> {
    fn new(write: &'a (dyn Fn(&Frame) -> Result<(), CliError> + Sync)) -> Self {
        Self {
            write,
            has_failed: AtomicBool::new(false),
            error: Mutex::new(None),
        }
    }

    fn write(&self, frame: &Frame) {
        if let Err(failed) = (self.write)(frame) {
            if let Ok(mut error) = self.error.lock() {
                error.get_or_insert(failed);
            }
            self.has_failed.store(true, Ordering::Relaxed);
        }
    }

    fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Relaxed)
    }

    fn error(self) -> Option<CliError> {
        // Nothing panics while it holds the lock.
        self.error.into_inner().ok().flatten()
    }
}

/// Does something at the end of a scope, however it is left.
struct Finally<F: Fn()>(F);

impl<F: Fn()> Drop for Finally<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}
