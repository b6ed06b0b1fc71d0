//! What tev is to show, and the thread that sends it.
//!
//! Who renders puts values into a copy of the picture and never waits for the network. A thread of its own sends what has changed since it
//! looked last, so a viewer that is slow sees fewer states of the picture, and a quick one no more packets than it can draw.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Write};
use std::net::TcpStream;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use glam::UVec2;

use super::packet;
use crate::scene::Window;

/// Pixels along the side of what one packet updates at most.
const CELL: u32 = 64;
/// Changes are gathered for so long: tiles may be as small as a pixel.
const GATHER: Duration = Duration::from_millis(50);
/// A write that waits for the viewer looks up this often.
const LOOK_UP: Duration = Duration::from_millis(50);

/// How long the end of a run may wait for the viewer.
#[derive(Clone, Copy, Debug)]
struct Patience {
    /// While it takes nothing.
    still: Duration,
    /// In all.
    whole: Duration,
}

const PATIENCE: Patience = Patience {
    still: Duration::from_secs(2),
    whole: Duration::from_secs(10),
};

/// An image of the viewer.
#[derive(Clone, Debug)]
pub struct Image {
    /// What it is called there.
    pub name: String,
    /// Pixels across and down.
    pub size: UVec2,
    /// The part of it that is put in, inside of it and not empty.
    pub window: Window,
    /// The names of its channels, at least one.
    pub channels: Vec<&'static str>,
}

/// An image that is put in by any threads, and sent by one.
pub struct Viewer {
    image: Image,
    patience: Patience,
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    /// The values of the image's window: for each pixel, row by row from the top, those of all channels.
    values: Vec<f32>,
    /// Per cell of the window, row by row, the pixels that the viewer does not have yet.
    news: Vec<Option<Window>>,
    /// The cells that have news, the oldest first.
    queue: VecDeque<usize>,
    ended: Option<Instant>,
    is_lost: bool,
}

impl Viewer {
    /// A black and transparent image.
    pub fn new(image: Image) -> Self {
        Self::with_patience(image, PATIENCE)
    }

    fn with_patience(image: Image, patience: Patience) -> Self {
        let cells = cells(image.window.size());
        let state = State {
            values: vec![0.0; image.window.pixels() * image.channels.len()],
            news: vec![None; cells.x as usize * cells.y as usize],
            queue: VecDeque::new(),
            ended: None,
            is_lost: false,
        };
        Self {
            image,
            patience,
            state: Mutex::new(state),
            changed: Condvar::new(),
        }
    }

    /// Puts `values` into `window`, which is inside of the image's: for each pixel, row by row from the top, those of all channels.
    pub fn put(&self, window: Window, values: &[f32]) {
        let mut state = self.state();
        if state.is_lost {
            return;
        }
        let (channels, whole) = (self.image.channels.len(), self.image.window);
        let width = window.size().x as usize;
        for (y, row) in (window.start.y..).zip(values.chunks_exact(width * channels)) {
            for run in runs(window.start.x..window.end.x, whole.start.x) {
                let Some(place) = whole.index(run.at(y)) else {
                    continue; // outside
                };
                let from = (run.start - window.start.x) as usize * channels;
                let new = &row[from..][..run.len() * channels];
                let old = &mut state.values[place * channels..][..new.len()];
                if bytemuck::cast_slice::<_, u32>(old) != bytemuck::cast_slice::<_, u32>(new) {
                    old.copy_from_slice(new);
                    state.note(self.cell(run.at(y)), run.row(y));
                }
            }
        }
        if !state.queue.is_empty() {
            self.changed.notify_all();
        }
    }

    /// No more will be put in.
    pub fn end(&self) {
        self.state().ended.get_or_insert_with(Instant::now);
        self.changed.notify_all();
    }

    /// Sends all that is put in until [`Viewer::end`], and what is left then as far as the viewer takes it in time.
    ///
    /// # Errors
    ///
    /// That of the connection; the image is not sent any more then.
    pub fn send(&self, stream: &TcpStream) -> io::Result<()> {
        let sent = self.send_all(stream);
        self.state().is_lost = sent.is_err();
        sent
    }

    fn send_all(&self, stream: &TcpStream) -> io::Result<()> {
        let Image {
            name,
            size,
            channels,
            ..
        } = &self.image;
        stream.set_write_timeout(Some(LOOK_UP))?;
        self.write(
            stream,
            &packet::create_image(name, size.to_array(), channels),
        )?;
        while self.wait() {
            while let Some((window, values)) = self.next() {
                self.write(
                    stream,
                    &packet::update_image(name, channels, window, &values),
                )?;
            }
        }
        Ok(())
    }

    /// Waits for news; false if there will be none any more.
    fn wait(&self) -> bool {
        let idle = |state: &mut State| state.queue.is_empty() && state.ended.is_none();
        let state = self.changed.wait_while(self.state(), idle);
        let state = state.unwrap_or_else(PoisonError::into_inner);
        let has_news = !state.queue.is_empty();
        let _ = self
            .changed
            .wait_timeout_while(state, GATHER, |state| state.ended.is_none());
        has_news
    }

    /// The news of one cell.
    fn next(&self) -> Option<(Window, Vec<f32>)> {
        let mut state = self.state();
        let cell = state.queue.pop_front()?;
        let window = state.news[cell].take()?;
        let (channels, whole) = (self.image.channels.len(), self.image.window);
        let width = window.size().x as usize * channels;
        let mut values = Vec::with_capacity(window.pixels() * channels);
        for y in window.start.y..window.end.y {
            let place = whole.index(UVec2::new(window.start.x, y))?;
            values.extend_from_slice(&state.values[place * channels..][..width]);
        }
        Some((window, values))
    }

    /// Writes all of `bytes`: a run that goes on waits for the viewer as long as it takes, one that has ended loses patience.
    fn write(&self, mut stream: &TcpStream, mut bytes: &[u8]) -> io::Result<()> {
        let mut moved = Instant::now();
        while !bytes.is_empty() {
            match stream.write(bytes) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(length) => {
                    bytes = &bytes[length..];
                    moved = Instant::now();
                }
                Err(error) if is_passing(&error) => {}
                Err(error) => return Err(error),
            }
            let ended = self.state().ended;
            let is_late = |ended: Instant| {
                ended.max(moved).elapsed() > self.patience.still
                    || ended.elapsed() > self.patience.whole
            };
            if ended.is_some_and(is_late) && !bytes.is_empty() {
                let late = "it takes the picture too slowly, or not at all";
                return Err(io::Error::new(ErrorKind::TimedOut, late));
            }
        }
        Ok(())
    }

    fn cell(&self, pixel: UVec2) -> usize {
        let Window { start, .. } = self.image.window;
        let cell = (pixel - start) / CELL;
        cell.y as usize * cells(self.image.window.size()).x as usize + cell.x as usize
    }

    /// A panic of another thread is on its way to its caller, and the values are values all the same.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// The viewer lacks these pixels of a cell.
    fn note(&mut self, cell: usize, pixels: Window) {
        let news = &mut self.news[cell];
        if news.is_none() {
            self.queue.push_back(cell);
        }
        *news = Some(news.map_or(pixels, |news| news.union(&pixels)));
    }
}

fn is_passing(error: &io::Error) -> bool {
    use ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), Interrupted | TimedOut | WouldBlock)
}

/// Cells across and down.
fn cells(size: UVec2) -> UVec2 {
    (size + (CELL - 1)) / CELL
}

/// Pixels of a row that lie in one cell.
struct Run {
    start: u32,
    end: u32,
}

/// Cuts `columns` where a cell ends; the first cell begins at `origin`.
fn runs(columns: std::ops::Range<u32>, origin: u32) -> impl Iterator<Item = Run> {
    let mut start = columns.start;
    std::iter::from_fn(move || {
        let cell_end = origin + (start.saturating_sub(origin) / CELL + 1) * CELL;
        let end = cell_end.min(columns.end);
        let run = Run { start, end };
        start = end;
        (run.start < run.end).then_some(run)
    })
}

impl Run {
    fn len(&self) -> usize {
        (self.end - self.start) as usize
    }

    fn at(&self, y: u32) -> UVec2 {
        UVec2::new(self.start, y)
    }

    fn row(&self, y: u32) -> Window {
        Window {
            start: self.at(y),
            end: UVec2::new(self.end, y + 1),
        }
    }
}

#[cfg(test)]
mod tests;
