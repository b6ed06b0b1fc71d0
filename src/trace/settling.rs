//! Trees that are made anew behind edits, while rays go on.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::{Edited, Hit, Tracer, World};
use crate::ray::{Aabb, Ray, RayPacket};
use crate::surface::{DisplacementMap, TexelRect};

/// Makes a tracer of a world.
pub type Maker<T, E> = Box<dyn Fn(&World) -> Result<T, E> + Send>;

/// A tracer that can be brought up to date after an edit at once, but then is slower than a new one.
pub trait Follow: Tracer + Send + Sized + 'static {
    /// What goes wrong.
    type Error: Send + 'static;

    /// Brings the tracer up to date with what [has grown](World::growths) of the world that it was built from; whether anything had.
    ///
    /// # Errors
    ///
    /// The backend's; then the tracer may miss what has grown.
    fn follow(&mut self, world: &World) -> Result<bool, Self::Error>;

    /// Makes tracers with the same options.
    fn maker(&self) -> Maker<Self, Self::Error>;
}

/// A tracer for a world that is edited: it follows each edit at once, and when edits pause, or now and then where they do not, a new tracer is made on
/// a thread of its own. Rays take that one as soon as it is there: a stroke leaves no trace in their speed.
///
/// Until the next edit both are kept. Dropping it waits for a tracer that is being made.
///
/// ```no_run
/// # use prismarch::{bvh::BvhTracer, trace::{Settling, Tracer, World}, surface::{DisplacementMap, TexelRect, Texels}, ray::Ray};
/// # use std::sync::Arc;
/// # fn stroke(world: World, map: Arc<DisplacementMap>, dabs: Vec<(TexelRect, Texels)>, ray: Ray) -> Result<(), Box<dyn std::error::Error>> {
/// let mut tracer = Settling::new(BvhTracer::new(&world)?);
/// for (rect, texels) in dabs {
///     map.update(rect, &texels)?;
///     tracer.map_edited(&world, &map, rect)?;
///     tracer.intersect(&ray);
/// }
/// # Ok(()) }
/// ```
pub struct Settling<T: Follow> {
    /// Follows every edit.
    tracer: T,
    /// Where a tracer will be that is made of the world as it is since the last edit.
    settled: Slot<T>,
    /// Where one will be that was begun before that; the next edit takes it.
    late: Option<Slot<T>>,
    shared: Arc<Shared<T>>,
    thread: Option<JoinHandle<()>>,
}

type Slot<T> = Arc<OnceLock<T>>;

struct Shared<T: Follow> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

struct State<T: Follow> {
    wanted: Option<Wanted<T>>,
    /// Where the one will be that is being made.
    making: Option<Slot<T>>,
    error: Option<T::Error>,
    /// Nothing is made any more.
    is_closed: bool,
}

/// A tracer that is to be made.
struct Wanted<T> {
    world: World,
    slot: Slot<T>,
    /// Since when it is wanted, and when to begin.
    since: Instant,
    due: Instant,
}

/// Edits that follow one another faster are one stroke.
const PAUSE: Duration = Duration::from_millis(20);

/// After as long in a stroke a new tracer is made nevertheless.
const MOST_WAIT: Duration = Duration::from_millis(500);

impl<T: Follow> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'s>(&self, state: MutexGuard<'s, State<T>>) -> MutexGuard<'s, State<T>> {
        let waited = self.changed.wait(state);
        waited.unwrap_or_else(PoisonError::into_inner)
    }

    /// What is due, once something is; none when it is closed. From then on it is being made.
    fn next(&self) -> Option<World> {
        let mut state = self.lock();
        while !state.is_closed {
            let Some(wanted) = state.wanted.take() else {
                state = self.wait(state);
                continue;
            };
            let left = wanted.due.saturating_duration_since(Instant::now());
            if left.is_zero() {
                state.making = Some(wanted.slot);
                return Some(wanted.world);
            }
            state.wanted = Some(wanted);
            let waited = self.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        None
    }

    /// Makes what is wanted until it is closed.
    fn run(&self, make: &Maker<T, T::Error>) {
        // Also where making one panics.
        let _closes = Closes(self);
        while let Some(world) = self.next() {
            world.tighten();
            let made = make(&world);
            let mut state = self.lock();
            match (made, state.making.take()) {
                // It is empty: nobody else writes there.
                (Ok(made), Some(slot)) => drop(slot.set(made)),
                (Ok(_), None) => {}
                (Err(error), _) => state.error = Some(error),
            }
            self.changed.notify_all();
        }
    }

    fn close(&self) {
        let mut state = self.lock();
        state.is_closed = true;
        state.wanted = None;
        state.making = None;
        self.changed.notify_all();
    }
}

/// Closes it when it goes.
struct Closes<'s, T: Follow>(&'s Shared<T>);

impl<T: Follow> Drop for Closes<'_, T> {
    fn drop(&mut self) {
        self.0.close();
    }
}

impl<T: Follow> Settling<T> {
    /// `tracer` is of the world that will be edited, as it is now.
    pub fn new(tracer: T) -> Self {
        let shared = Shared {
            state: Mutex::new(State {
                wanted: None,
                making: None,
                error: None,
                is_closed: false,
            }),
            changed: Condvar::new(),
        };
        let (shared, make) = (Arc::new(shared), tracer.maker());
        let run = {
            let shared = shared.clone();
            move || shared.run(&make)
        };
        let thread = thread::Builder::new().spawn(run).ok();
        if thread.is_none() {
            // Then it only follows.
            shared.close();
        }
        Self {
            tracer,
            settled: Slot::default(),
            late: None,
            shared,
            thread,
        }
    }

    /// Brings the tracer up to date after an edit of a map in place ([`DisplacementMap::update`]): `world` is the one it was built from,
    /// and all its objects over `map` follow.
    ///
    /// # Errors
    ///
    /// The backend's, also of a tracer that was made since the last edit. After one of [`Follow::follow`] rays may miss what has grown.
    pub fn map_edited(
        &mut self,
        world: &World,
        map: &Arc<DisplacementMap>,
        rect: TexelRect,
    ) -> Result<Edited, T::Error> {
        let prims_touched = world.map_edited(map, rect);
        // No tracer comes into a slot meanwhile.
        let shared = self.shared.clone();
        let mut state = shared.lock();
        if let Some(late) = self.late.take_if(|late| late.get().is_some()) {
            self.take(late);
        }
        if self.settled.get().is_some() {
            let settled = std::mem::take(&mut self.settled);
            self.take(settled);
        }
        let committed = self.tracer.follow(world)?;
        if committed && !state.is_closed {
            let is_made_there = |slot: &Slot<T>| Arc::ptr_eq(slot, &self.settled);
            if state.making.as_ref().is_some_and(is_made_there) {
                self.late = Some(std::mem::take(&mut self.settled));
            }
            let now = Instant::now();
            let since = state.wanted.take().map_or(now, |wanted| wanted.since);
            state.wanted = Some(Wanted {
                world: world.clone(),
                slot: self.settled.clone(),
                since,
                due: (now + PAUSE).min(since + MOST_WAIT),
            });
            shared.changed.notify_all();
        }
        match state.error.take() {
            Some(error) => Err(error),
            None => Ok(Edited {
                prims_touched,
                committed,
            }),
        }
    }

    fn take(&mut self, slot: Slot<T>) {
        if let Some(tracer) = Arc::into_inner(slot).and_then(OnceLock::into_inner) {
            self.tracer = tracer;
        }
    }

    /// Waits until rays are as fast as those of a new tracer, without waiting for a pause; not at all where no thread could be started, or where it has
    /// panicked.
    pub fn settle(&self) {
        let mut state = self.shared.lock();
        while state.wanted.is_some() || state.making.is_some() {
            if let Some(wanted) = &mut state.wanted {
                wanted.due = wanted.since;
                self.shared.changed.notify_all();
            }
            state = self.shared.wait(state);
        }
    }

    /// The tracer that rays are asked of now.
    pub fn tracer(&self) -> &T {
        self.settled.get().unwrap_or(&self.tracer)
    }
}

impl<T: Follow> Drop for Settling<T> {
    fn drop(&mut self) {
        self.shared.close();
        if let Some(thread) = self.thread.take() {
            // It has nothing to say any more.
            drop(thread.join());
        }
    }
}

impl<T: Follow> Tracer for Settling<T> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.tracer().intersect(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.tracer().occluded(ray)
    }

    fn intersect8(&self, rays: &RayPacket) -> [Option<Hit>; RayPacket::LANES] {
        self.tracer().intersect8(rays)
    }

    fn occluded8(&self, rays: &RayPacket) -> u8 {
        self.tracer().occluded8(rays)
    }

    fn bounds(&self) -> Aabb {
        self.tracer().bounds()
    }

    /// Of the one that rays are asked of; Embree counts all that it holds.
    fn bvh_bytes(&self) -> usize {
        self.tracer().bvh_bytes()
    }

    fn name(&self) -> String {
        self.tracer.name()
    }
}

#[cfg(test)]
mod tests;
