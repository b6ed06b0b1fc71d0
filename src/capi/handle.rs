//! Handles of counted objects, as C has them: numbers that are looked up in a table, and never read through.
//!
//! A handle is the place of its entry in the table, with how often that place was used before, so that none comes back while the process
//! lives: stale, wild and foreign pointers are told without a look at what they point to. The highest bit is set, which is that of no address of a
//! program's on machines of 64 bits.
//!
//! A look-up takes no lock and writes to no shared memory, for interpolation is called per hit: it pins the handle (`pins`), then compares it
//! with the entry. The last release empties the entry and waits until nobody pins the handle; pins are held by short calls alone, that call
//! nobody. Others count the object itself.

use std::cell::UnsafeCell;
use std::ops::Deref;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::declarations::{prismarch_status, prismarch_status_PRISMARCH_OK};
use super::error::{Failure, answer};
use super::map::Map;
use super::pins::{self, Pin, Word};
use super::surface::Surface;

/// What C can hold.
pub enum Held {
    Map(Arc<Map>),
    Surface(Arc<Surface>),
}

impl Held {
    fn name(&self) -> &'static str {
        match self {
            Self::Map(_) => Map::NAME,
            Self::Surface(_) => Surface::NAME,
        }
    }
}

pub trait Kind: Sized + 'static {
    /// For messages.
    const NAME: &'static str;

    fn hold(this: Arc<Self>) -> Held;
    fn of(held: &Held) -> Option<&Arc<Self>>;
}

impl Kind for Map {
    const NAME: &'static str = "map";

    fn hold(this: Arc<Self>) -> Held {
        Held::Map(this)
    }

    fn of(held: &Held) -> Option<&Arc<Self>> {
        match held {
            Held::Map(map) => Some(map),
            Held::Surface(_) => None,
        }
    }
}

impl Kind for Surface {
    const NAME: &'static str = "surface";

    fn hold(this: Arc<Self>) -> Held {
        Held::Surface(this)
    }

    fn of(held: &Held) -> Option<&Arc<Self>> {
        match held {
            Held::Surface(surface) => Some(surface),
            Held::Map(_) => None,
        }
    }
}

// A handle: the highest bit, how often its place was used before, the place, four zeros.
const TAG: usize = 1 << (usize::BITS - 1);
const PLACE_SHIFT: u32 = 4;
const PLACE_BITS: u32 = if usize::BITS == 64 { 28 } else { 16 };
const USE_SHIFT: u32 = PLACE_SHIFT + PLACE_BITS;
const USE_COUNT: usize = 1 << (usize::BITS - 1 - USE_SHIFT);

/// Entries of the table's first part; every other part is twice as long as the one before.
const FIRST_PART: usize = 64;
const PARTS: usize = (PLACE_BITS - FIRST_PART.ilog2()) as usize;

/// A place of the table.
struct Entry {
    /// The live handle; 0: none.
    handle: AtomicUsize,
    /// Written under the lock, while `handle` is 0 and nobody pins the last one.
    held: UnsafeCell<Option<Held>>,
}

// SAFETY: `held` is shared as the field says, and what it holds is Send + Sync.
unsafe impl Sync for Entry {}

/// What is known of places under the lock.
struct Books {
    /// By place: C's references to its object, and how often it was used before.
    places: Vec<(usize, usize)>,
    free: Vec<usize>,
}

/// Entries stay where they are.
static TABLE: [OnceLock<Box<[Entry]>>; PARTS] = [const { OnceLock::new() }; PARTS];
static BOOKS: Mutex<Books> = Mutex::new(Books {
    places: Vec::new(),
    free: Vec::new(),
});

fn books() -> MutexGuard<'static, Books> {
    BOOKS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The part of the table that has a place, and the number there.
fn part_of(place: usize) -> (usize, usize) {
    let part = (place / FIRST_PART + 1).ilog2() as usize;
    (part, place - FIRST_PART * ((1 << part) - 1))
}

fn place_of(handle: usize) -> usize {
    handle >> PLACE_SHIFT & ((1 << PLACE_BITS) - 1)
}

/// Where a handle would be.
fn entry_of(handle: usize) -> Option<&'static Entry> {
    if handle & TAG == 0 {
        return None;
    }
    let (part, number) = part_of(place_of(handle));
    TABLE.get(part)?.get()?.get(number)
}

/// Gives C one reference: the handle.
pub fn give<T: Kind, C>(object: Arc<T>) -> Result<*mut C, Failure> {
    pins::prepare();
    let mut books = books();
    let place = match books.free.pop() {
        Some(place) => place,
        None => books.places.len(),
    };
    let (part, number) = part_of(place);
    let Some(part_entries) = TABLE.get(part) else {
        return Err(Failure::argument(format!(
            "{place} handles are live; there cannot be more"
        )));
    };
    let empty = |_| Entry {
        handle: AtomicUsize::new(0),
        held: UnsafeCell::new(None),
    };
    let entry = &part_entries.get_or_init(|| (0..FIRST_PART << part).map(empty).collect())[number];
    if place == books.places.len() {
        books.places.push((0, 0));
    }
    let (count, uses) = &mut books.places[place];
    *count = 1;
    let handle = TAG | *uses << USE_SHIFT | place << PLACE_SHIFT;
    // SAFETY: the place is free, so that its entry has no live handle and nobody pins the last one; the lock is held.
    unsafe { *entry.held.get() = Some(T::hold(object)) };
    entry.handle.store(handle, Ordering::Release);
    Ok(std::ptr::without_provenance_mut(handle))
}

/// An object that a call uses.
pub struct Used<T: 'static>(Use<T>);

enum Use<T: 'static> {
    Pinned(&'static Arc<T>, #[allow(dead_code)] Pin), // kept for its end
    Counted(Arc<T>),
}

impl<T> Deref for Used<T> {
    type Target = Arc<T>;

    #[inline(always)]
    fn deref(&self) -> &Arc<T> {
        match &self.0 {
            Use::Pinned(object, _) => object,
            Use::Counted(object) => object,
        }
    }
}

/// Looks a handle up, for a call that takes no time and calls nobody.
#[inline]
pub fn used<T: Kind, C>(handle: *const C) -> Result<Used<T>, Failure> {
    let handle = handle.addr();
    if handle == 0 {
        return Err(Failure::null(T::NAME));
    }
    let entry = entry_of(handle).ok_or_else(|| Failure::handle(T::NAME))?;
    let Some(pin) = Pin::new(Word::Handle, handle) else {
        return counted(&books(), handle).map(|object| Used(Use::Counted(object)));
    };
    if entry.handle.load(Ordering::Acquire) != handle {
        return Err(Failure::handle(T::NAME));
    }
    // SAFETY: live after it was pinned: whoever takes it away waits for the pin, and nobody else writes the entry.
    let held = unsafe { &*entry.held.get() };
    let object = held.as_ref().and_then(T::of);
    match object {
        Some(object) => Ok(Used(Use::Pinned(object, pin))),
        None => Err(of_another_kind::<T>(held.as_ref())),
    }
}

/// Looks a handle up, for a call that may take its time: the object lives on, whatever is released meanwhile.
pub fn kept<T: Kind, C>(handle: *const C) -> Result<Arc<T>, Failure> {
    used::<T, C>(handle).map(|object| Arc::clone(&object))
}

fn of_another_kind<T: Kind>(held: Option<&Held>) -> Failure {
    Failure::other_kind(T::NAME, held.map_or("none", Held::name))
}

/// The object of a live handle, which none can take away while the books are held.
fn counted<T: Kind>(_: &Books, handle: usize) -> Result<Arc<T>, Failure> {
    let entry = entry_of(handle).ok_or_else(|| Failure::handle(T::NAME))?;
    if entry.handle.load(Ordering::Acquire) != handle {
        return Err(Failure::handle(T::NAME));
    }
    // SAFETY: the lock is held, and the handle is live.
    let held = unsafe { (*entry.held.get()).as_ref() };
    held.and_then(T::of)
        .cloned()
        .ok_or_else(|| of_another_kind::<T>(held))
}

/// One more reference for C, which must hold one.
pub fn retain<T: Kind, C>(handle: *const C) -> prismarch_status {
    let handle = handle.addr();
    // SAFETY: null is no place for an error's text.
    unsafe {
        answer(std::ptr::null_mut(), || {
            if handle == 0 {
                return Err(Failure::null(T::NAME));
            }
            let mut books = books();
            counted::<T>(&books, handle)?;
            books.places[place_of(handle)].0 += 1;
            Ok(())
        })
    }
}

/// One reference of C's less; null is nothing, and one that C does not hold is an error.
pub fn release<T: Kind, C>(handle: *const C) -> prismarch_status {
    let handle = handle.addr();
    if handle == 0 {
        return prismarch_status_PRISMARCH_OK;
    }
    // SAFETY: null is no place for an error's text; what is taken out of the table is said below.
    unsafe {
        answer(std::ptr::null_mut(), || {
            let mut books = books();
            // Kept beyond the lock: what it may take with it takes time.
            let _object = counted::<T>(&books, handle)?;
            let place = place_of(handle);
            books.places[place].0 -= 1;
            if books.places[place].0 > 0 {
                return Ok(());
            }
            let Some(entry) = entry_of(handle) else {
                return Ok(()); // `counted` has found it
            };
            entry.handle.store(0, Ordering::SeqCst);
            drop(books);
            while pins::is_pinned(Word::Handle, handle) {
                std::thread::yield_now();
            }
            let mut books = self::books();
            // No live handle leads here, and nobody has pinned the last one; the lock is held.
            let held = (*entry.held.get()).take();
            let uses = &mut books.places[place].1;
            *uses += 1;
            // Places that have been used as often as can be counted are not used again.
            if *uses < USE_COUNT {
                books.free.push(place);
            }
            drop(books);
            drop(held);
            Ok(())
        })
    }
}

/// Where a result goes.
///
/// # Safety
///
/// `out` is null or valid for a write, if it is aligned.
pub unsafe fn output<'a, T>(out: *mut T, what: &str) -> Result<&'a mut T, Failure> {
    if !out.is_aligned() {
        return Err(Failure::argument(format!(
            "{what} is {out:p}; expected a multiple of {}",
            align_of::<T>()
        )));
    }
    // SAFETY: the caller's promise.
    unsafe { out.as_mut() }.ok_or_else(|| Failure::null(what))
}

/// What is read where it may not be aligned.
///
/// # Safety
///
/// `from` is null or readable.
pub unsafe fn input<T: Copy>(from: *const T, what: &str) -> Result<T, Failure> {
    if from.is_null() {
        return Err(Failure::null(what));
    }
    // SAFETY: the caller's promise.
    Ok(unsafe { from.read_unaligned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lie_in_parts_one_after_another() {
        let mut next = (0, 0);
        for place in 0..100_000 {
            assert_eq!(part_of(place), next);
            next.1 += 1;
            if next.1 == FIRST_PART << next.0 {
                next = (next.0 + 1, 0);
            }
        }
        // The last place there can be is in the last part.
        let (part, number) = part_of((1 << PLACE_BITS) - FIRST_PART - 1);
        assert!(part == PARTS - 1 && number == (FIRST_PART << part) - 1);
    }
}
