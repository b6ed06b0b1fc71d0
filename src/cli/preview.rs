//! The picture written again and again while it renders, by a thread of its own.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::render::Status;
use crate::render::film::Frame;

/// Takes a copy of the picture now and then. One copy at a time: while it is written no other is taken.
pub struct Preview {
    every: Duration,
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    /// When the next copy is taken; `None` as long as there is one.
    due: Option<Instant>,
    /// Still to be written.
    copy: Option<Frame>,
    /// Rays behind the last copy: without new ones nothing has changed.
    rays: u64,
    ended: bool,
}

impl Preview {
    /// Copies the picture `every` so long, counted from the end of the last writing.
    pub fn new(every: Duration) -> Self {
        let state = State {
            due: Some(Instant::now() + every),
            copy: None,
            rays: 0,
            ended: false,
        };
        Self {
            every,
            state: Mutex::new(state),
            changed: Condvar::new(),
        }
    }

    /// Takes a copy if it is time and there is anything new.
    pub fn offer(&self, status: &Status) {
        let mut state = self.state();
        let rays = status.rays.total();
        let is_due = state.due.is_some_and(|due| Instant::now() >= due);
        if is_due && rays > state.rays {
            state.copy = Some(status.frame.clone());
            (state.due, state.rays) = (None, rays);
            self.changed.notify_all();
        }
    }

    /// Writes every copy by `write`, until [`Preview::end`].
    pub fn write_all(&self, write: impl Fn(&Frame)) {
        loop {
            let idle = |state: &mut State| state.copy.is_none() && !state.ended;
            let state = self.changed.wait_while(self.state(), idle);
            let mut state = state.unwrap_or_else(PoisonError::into_inner);
            let Some(copy) = state.copy.take().filter(|_| !state.ended) else {
                return;
            };
            drop(state);
            write(&copy);
            drop(copy);
            self.state().due = Some(Instant::now() + self.every);
        }
    }

    /// The picture is finished: a copy that waits is written no more.
    pub fn end(&self) {
        self.state().ended = true;
        self.changed.notify_all();
    }

    /// A panic of another thread is on its way to its caller.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::thread;

    use super::*;
    use crate::render::RayCounts;
    use crate::render::film::Objects;
    use crate::scene::Film;

    fn offer(preview: &Preview, camera: u64) {
        let film = Film {
            width: 2,
            height: 2,
            ..Film::default()
        };
        preview.offer(&Status {
            frame: &Frame::new(&film, 0..1, Objects::default()),
            done: 0,
            total: 4,
            pass: 1,
            passes: 1,
            rays: RayCounts {
                camera,
                ..RayCounts::default()
            },
        });
    }

    #[test]
    fn a_copy_is_written_when_there_is_news_and_never_two_at_once() {
        let preview = Preview::new(Duration::ZERO);
        let ((begun, begins), (goes_on, go_on)) = (mpsc::channel(), mpsc::channel());
        thread::scope(|scope| {
            let preview = &preview;
            scope.spawn(move || {
                preview.write_all(|_| {
                    begun.send(()).unwrap();
                    go_on.recv().unwrap();
                });
            });
            offer(preview, 1);
            begins.recv().unwrap();
            offer(preview, 2);
            assert!(preview.state().copy.is_none(), "one is being written");
            goes_on.send(()).unwrap();
            while preview.state().due.is_none() {
                thread::yield_now();
            }
            offer(preview, 1);
            assert!(preview.state().copy.is_none(), "nothing has changed");
            offer(preview, 2);
            begins.recv().unwrap();
            goes_on.send(()).unwrap();
            preview.end();
        });
        assert!(begins.try_recv().is_err());
    }

    #[test]
    fn nothing_is_written_before_its_time_or_after_the_end() {
        let preview = Preview::new(Duration::from_secs(1000));
        offer(&preview, 1);
        assert!(preview.state().copy.is_none());
        preview.state().due = Some(Instant::now());
        offer(&preview, 2);
        assert!(preview.state().copy.is_some());
        preview.end();
        preview.write_all(|_| panic!("written after the end"));
    }
}
