//! What each thread uses at this moment, for others to see: readers write to memory of their own thread alone, and whoever wants to take
//! something away looks at all threads.
//!
//! The protocol is Dekker's. A reader pins, then looks whether what it pinned may be used; a writer forbids the use, then looks for pins. Between
//! the two steps each must have a full barrier, or both may miss each other. The reader's, of which there is one per hit test and call, is left to
//! the writer where the kernel can run a barrier on all threads of the process ([`heavy_barrier`], membarrier(2)); then a pin costs a store
//! and a look at a flag that nobody writes.

use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering, compiler_fence, fence};
use std::sync::{Mutex, OnceLock, PoisonError};

/// What is pinned: a number that is not 0.
#[derive(Clone, Copy)]
pub enum Word {
    /// A handle that a call was given.
    Handle,
    /// A surface, by its address.
    Surface,
}

/// A thread's pins, in cache lines of its own.
#[repr(align(128))]
struct Slot {
    words: [Pinned; 2],
}

struct Pinned {
    /// 0: nothing.
    key: AtomicUsize,
    /// How often its thread has pinned it; no other looks here.
    depth: AtomicU32,
}

impl Pinned {
    fn nothing() -> Self {
        Self {
            key: AtomicUsize::new(0),
            depth: AtomicU32::new(0),
        }
    }
}

/// All slots there are, and those that no thread has at present.
struct Slots {
    all: Vec<&'static Slot>,
    free: Vec<&'static Slot>,
}

static SLOTS: Mutex<Slots> = Mutex::new(Slots {
    all: Vec::new(),
    free: Vec::new(),
});

thread_local! {
    /// This thread's slot. Without a destructor, so that a look at it costs no more than that.
    static OWN: Cell<Option<&'static Slot>> = const { Cell::new(None) };
    /// Gives it back when the thread ends.
    static OWNER: Owner = Owner::new();
}

struct Owner(&'static Slot);

impl Owner {
    fn new() -> Self {
        let mut slots = SLOTS.lock().unwrap_or_else(PoisonError::into_inner);
        let slot = slots.free.pop().unwrap_or_else(|| {
            // As many as threads at once, and used again: never freed.
            let new: &'static Slot = Box::leak(Box::new(Slot {
                words: [Pinned::nothing(), Pinned::nothing()],
            }));
            slots.all.push(new);
            new
        });
        Self(slot)
    }
}

impl Drop for Owner {
    fn drop(&mut self) {
        OWN.set(None);
        let mut slots = SLOTS.lock().unwrap_or_else(PoisonError::into_inner);
        slots.free.push(self.0);
    }
}

#[cold]
fn claim() -> Option<&'static Slot> {
    let slot = OWNER.try_with(|owner| owner.0).ok()?;
    OWN.set(Some(slot));
    Some(slot)
}

/// Until it is dropped, other threads see what is pinned.
pub struct Pin {
    word: &'static Pinned,
    /// Stays on its thread.
    here: PhantomData<*const ()>,
}

impl Drop for Pin {
    #[inline(always)]
    fn drop(&mut self) {
        let depth = self.word.depth.load(Ordering::Relaxed) - 1;
        self.word.depth.store(depth, Ordering::Relaxed);
        if depth == 0 {
            self.word.key.store(0, Ordering::Release);
        }
    }
}

impl Pin {
    /// `None` where this thread pins another of that kind already, or is about to end: then what is used must be counted.
    #[inline(always)]
    pub fn new(word: Word, key: usize) -> Option<Self> {
        let slot = match OWN.get() {
            Some(slot) => slot,
            None => claim()?,
        };
        let word = &slot.words[word as usize];
        let depth = word.depth.load(Ordering::Relaxed);
        if depth != 0 && word.key.load(Ordering::Relaxed) != key {
            return None;
        }
        word.depth.store(depth + 1, Ordering::Relaxed);
        word.key.store(key, Ordering::Relaxed);
        light_barrier();
        Some(Self {
            word,
            here: PhantomData,
        })
    }
}

impl Pin {
    /// A pin of this thread's that was forgotten, to be dropped at last.
    pub fn again(word: Word, key: usize) -> Option<Self> {
        let word = &OWN.get()?.words[word as usize];
        let is_there = word.key.load(Ordering::Relaxed) == key;
        is_there.then_some(Self {
            word,
            here: PhantomData,
        })
    }
}

/// Whether a thread pins that. A pin that is not seen begins after whatever this thread wrote before; what was done under one that
/// has ended is seen after this.
pub fn is_pinned(word: Word, key: usize) -> bool {
    heavy_barrier();
    let slots = SLOTS.lock().unwrap_or_else(PoisonError::into_inner);
    let mut all = slots.all.iter();
    all.any(|slot| slot.words[word as usize].key.load(Ordering::Acquire) == key)
}

/// Whether [`heavy_barrier`] acts on all threads. Set within `ON_ALL_THREADS`'s initialisation: who has seen it true finds that true as well.
static READERS_ARE_FREE: AtomicBool = AtomicBool::new(false);
static ON_ALL_THREADS: OnceLock<bool> = OnceLock::new();

/// Lets readers do without barriers from now on, where that is possible.
pub fn prepare() {
    ON_ALL_THREADS.get_or_init(|| {
        let is_registered = membarrier::register();
        READERS_ARE_FREE.store(is_registered, Ordering::Release);
        is_registered
    });
}

#[inline(always)]
fn light_barrier() {
    if READERS_ARE_FREE.load(Ordering::Relaxed) {
        compiler_fence(Ordering::SeqCst);
    } else {
        fence(Ordering::SeqCst);
    }
}

fn heavy_barrier() {
    prepare();
    fence(Ordering::SeqCst);
    if ON_ALL_THREADS.get() == Some(&true) && !membarrier::run() {
        // Allowed once and forbidden since, by a sandbox: new readers have their own barriers, and those of the others are long over.
        READERS_ARE_FREE.store(false, Ordering::SeqCst);
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    fence(Ordering::SeqCst);
}

#[cfg(target_os = "linux")]
mod membarrier {
    use rustix::thread::{MembarrierCommand, MembarrierQuery, membarrier, membarrier_query};

    /// Whether the process may run barriers on its threads.
    pub fn register() -> bool {
        membarrier_query().contains(MembarrierQuery::PRIVATE_EXPEDITED)
            && membarrier(MembarrierCommand::RegisterPrivateExpedited).is_ok()
    }

    pub fn run() -> bool {
        membarrier(MembarrierCommand::PrivateExpedited).is_ok()
    }
}

#[cfg(not(target_os = "linux"))]
mod membarrier {
    pub fn register() -> bool {
        false
    }

    pub fn run() -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_pins_one_of_a_kind_at_a_time_and_others_see_it() {
        let key = 0x1230;
        assert!(!is_pinned(Word::Surface, key));
        let first = Pin::new(Word::Surface, key).unwrap();
        assert!(Pin::new(Word::Surface, key + 16).is_none());
        assert!(Pin::new(Word::Handle, key + 16).is_some());
        // The same again, and whichever ends last.
        let pin = Pin::new(Word::Surface, key).unwrap();
        drop(first);
        std::thread::scope(|scope| {
            scope.spawn(|| assert!(is_pinned(Word::Surface, key) && !is_pinned(Word::Handle, key)));
        });
        drop(pin);
        assert!(!is_pinned(Word::Surface, key));
    }

    /// Reader and writer never miss each other: the reader sees the ban, or the writer sees the pin.
    #[test]
    fn of_a_pin_and_a_ban_one_is_seen() {
        const ROUNDS: usize = 2000;
        static BANNED: AtomicUsize = AtomicUsize::new(0);
        static GONE: AtomicUsize = AtomicUsize::new(0);
        prepare();
        let key = 0x4560;
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while BANNED.load(Ordering::Acquire) < ROUNDS {
                    let _pin = Pin::new(Word::Surface, key).unwrap();
                    let banned = BANNED.load(Ordering::Acquire);
                    for _ in 0..20 {
                        // What was looked for before the pin may have been taken away, and nothing later.
                        assert!(GONE.load(Ordering::Acquire) <= banned);
                    }
                }
            });
            for round in 1..=ROUNDS {
                BANNED.store(round, Ordering::SeqCst);
                if !is_pinned(Word::Surface, key) {
                    GONE.store(round, Ordering::Release);
                }
            }
        });
    }
}
