//! Frames get what they lack, on all threads, until they have it or are stopped.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::film::{Frame, PixelFilter, TileRenderer};
use super::integrator::{Prepared, RayCounts};
use super::plan::Plan;
use super::{RenderInput, Status};
use crate::scene::Film;

/// How a run is watched and stopped.
pub struct Control<'a> {
    /// Called once per finished tile and in order, from any thread; no other tile is put into the picture meanwhile.
    pub progress: &'a (dyn Fn(&Status) + Sync),
    /// Called with every tile, finished or stopped, before it is put into the picture, from any thread and in no order.
    pub tile_done: &'a (dyn Fn(&Frame) + Sync),
    /// Asked before every sample, from any thread; what is done stays when it says true.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Called between two passes.
    pub pass: Option<&'a mut dyn FnMut(&Frame)>,
    /// Pixels along a tile's side, instead of what keeps all threads busy; at least 1.
    pub tile: Option<u32>,
}

impl Default for Control<'_> {
    /// Neither watched nor stopped.
    fn default() -> Self {
        Self {
            progress: &|_| (),
            tile_done: &|_| (),
            stop: &|| false,
            pass: None,
            tile: None,
        }
    }
}

/// What became of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Rays traced.
    pub rays: RayCounts,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

/// What is looked up for every sample, and made once for any number of runs.
pub struct Tables {
    integrator: Prepared,
    filter: PixelFilter,
}

impl Tables {
    /// The tables for `input`. They do not depend on its camera, and on nothing of its film but the filter.
    pub fn new(input: &RenderInput) -> Self {
        Self {
            integrator: Prepared::new(input),
            filter: PixelFilter::new(input.film.filter),
        }
    }

    /// Makes again what is of another film.
    pub fn set_film(&mut self, film: &Film) {
        self.filter = PixelFilter::new(film.filter);
    }
}

/// What the threads put together.
struct Assembly<'a> {
    frame: &'a mut Frame,
    rays: &'a mut RayCounts,
    done: &'a mut u64,
}

/// Gives the pixels of `frame` what `plan`, which was made for it, has left for them. `tables` are of `input`. Runs on the current rayon pool.
pub fn run(
    input: &RenderInput,
    tables: &Tables,
    frame: &mut Frame,
    plan: &mut Plan,
    mut control: Control,
) -> Outcome {
    let integrator = tables.integrator.integrator(input);
    let renderer = TileRenderer::new(
        input.camera,
        input.film,
        &tables.filter,
        input.tracer,
        &*integrator,
    );
    let mut outcome = Outcome::default();
    while !plan.is_done() {
        run_pass(&renderer, frame, plan, &control, &mut outcome.rays);
        outcome.stopped = !plan.left.is_empty();
        if outcome.stopped {
            break;
        }
        plan.end_pass();
        if let Some(pass) = control.pass.as_mut().filter(|_| !plan.is_done()) {
            pass(frame);
        }
    }
    outcome
}

/// Leaves the tiles that it was stopped before the end of.
fn run_pass(
    renderer: &TileRenderer,
    frame: &mut Frame,
    plan: &mut Plan,
    control: &Control,
    rays: &mut RayCounts,
) {
    let Some(pass) = plan.pass() else {
        return;
    };
    let (progress, tile_done, stop) = (control.progress, control.tile_done, control.stop);
    let (number, passes, total) = (plan.number(), plan.passes(), plan.total);
    let (grid, tiles) = (plan.grid(), std::mem::take(&mut plan.left));
    let is_stopped = AtomicBool::new(false);
    let assembly = Mutex::new(Assembly {
        frame,
        rays,
        done: &mut plan.done,
    });
    let finish = |index: usize| {
        if is_stopped.load(Ordering::Relaxed) {
            return false;
        }
        // A poisoned lock means that another tile panicked: the panic is on its way to the caller.
        let Ok(mut tile) = assembly.lock().map(|a| a.frame.part(grid.tile(index))) else {
            return false;
        };
        let lacked = tile.lacks(&pass);
        let result = renderer.render(&mut tile, pass.end, stop);
        tile_done(&tile);
        if let Ok(mut assembly) = assembly.lock() {
            let Assembly { frame, rays, done } = &mut *assembly;
            frame.place(&tile);
            **rays += result.rays;
            if result.stopped {
                is_stopped.store(true, Ordering::Relaxed);
                **done += lacked - tile.lacks(&pass);
            } else {
                **done += lacked;
                progress(&Status {
                    frame,
                    done: **done,
                    total,
                    pass: number,
                    passes,
                    rays: **rays,
                });
            }
        }
        !result.stopped
    };
    let left = tiles.into_par_iter().with_max_len(1);
    plan.left = left.filter(|&index| !finish(index)).collect();
}
