//! Counted handles that C holds pointers to.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::declarations::{prismarch_status, prismarch_status_PRISMARCH_OK};
use super::error::{Failure, answer};

/// What C can hold.
pub trait Kind {
    /// Stands at the beginning of a live handle. When it is gone, it is not: a handle that is used after its last release is noticed
    /// unless its memory serves for something else already.
    const MAGIC: u64;
    /// For messages.
    const NAME: &'static str;
}

/// How many references C holds, by address: what it holds is live, and one release too many is told without a look at memory that
/// may be gone.
static HELD: Mutex<BTreeMap<usize, usize>> = Mutex::new(BTreeMap::new());

/// Does something with the number of C's references to `pointer`, which are forgotten at 0.
fn counted<T, R>(pointer: *const T, change: impl FnOnce(&mut usize) -> R) -> R {
    let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
    let count = held.entry(pointer.addr()).or_default();
    let result = change(count);
    if *count == 0 {
        held.remove(&pointer.addr());
    }
    result
}

/// A counted object.
#[repr(C)]
pub struct Handle<T: Kind> {
    magic: AtomicU64,
    value: T,
}

impl<T: Kind> Deref for Handle<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: Kind> Drop for Handle<T> {
    fn drop(&mut self) {
        self.magic.store(0, Ordering::Relaxed);
    }
}

impl<T: Kind> Handle<T> {
    pub fn new(value: T) -> Arc<Self> {
        Arc::new(Self {
            magic: AtomicU64::new(T::MAGIC),
            value,
        })
    }

    /// One reference for C.
    pub fn give(self: Arc<Self>) -> *const Self {
        let pointer = Arc::into_raw(self);
        counted(pointer, |count| *count += 1);
        pointer
    }

    /// Checks a pointer from C.
    ///
    /// # Safety
    ///
    /// `pointer` is null, or one that [`give`](Self::give) gave.
    unsafe fn checked(pointer: *const Self) -> Result<(), Failure> {
        if pointer.is_null() {
            return Err(Failure::null(T::NAME));
        }
        if !pointer.is_aligned() {
            return Err(Failure::handle(T::NAME));
        }
        // SAFETY: live; or, against the contract, released, which is told from what is left if that is possible at all.
        let magic = unsafe { (*pointer).magic.load(Ordering::Relaxed) };
        if magic == T::MAGIC {
            Ok(())
        } else {
            Err(Failure::handle(T::NAME))
        }
    }

    /// # Safety
    ///
    /// As for `checked`, and no other thread releases the last reference meanwhile.
    pub unsafe fn borrow<'a>(pointer: *const Self) -> Result<&'a Self, Failure> {
        // SAFETY: the caller's promise.
        unsafe {
            Self::checked(pointer)?;
            Ok(&*pointer)
        }
    }

    /// Another reference.
    ///
    /// # Safety
    ///
    /// As for `borrow`.
    pub unsafe fn retained(pointer: *const Self) -> Result<Arc<Self>, Failure> {
        // SAFETY: the caller's promise; the count goes up for the one that is made.
        unsafe {
            Self::checked(pointer)?;
            Arc::increment_strong_count(pointer);
            Ok(Arc::from_raw(pointer))
        }
    }

    /// One more reference for C, which must hold one.
    ///
    /// # Safety
    ///
    /// `pointer` is null or one that C got.
    pub unsafe fn retain(pointer: *const Self) -> prismarch_status {
        // SAFETY: the caller's promise; what C holds is live.
        unsafe {
            answer(std::ptr::null_mut(), || {
                if pointer.is_null() {
                    return Err(Failure::null(T::NAME));
                }
                counted(pointer, |count| {
                    if *count == 0 {
                        return Err(Failure::handle(T::NAME));
                    }
                    Self::checked(pointer)?;
                    Arc::increment_strong_count(pointer);
                    *count += 1;
                    Ok(())
                })
            })
        }
    }

    /// One reference of C's less; null is nothing, and one that C does not hold is an error.
    ///
    /// # Safety
    ///
    /// `pointer` is one that C got, and the reference is not used again.
    pub unsafe fn release(pointer: *const Self) -> prismarch_status {
        if pointer.is_null() {
            return prismarch_status_PRISMARCH_OK;
        }
        // SAFETY: the caller's promise.
        unsafe {
            answer(std::ptr::null_mut(), || {
                counted(pointer, |count| {
                    if *count == 0 {
                        return Err(Failure::handle(T::NAME));
                    }
                    Self::checked(pointer)?;
                    *count -= 1;
                    Ok(())
                })?;
                drop(Arc::from_raw(pointer));
                Ok(())
            })
        }
    }
}

/// Where a result goes.
///
/// # Safety
///
/// `out` is null or valid for a write.
pub unsafe fn output<'a, T>(out: *mut T, what: &str) -> Result<&'a mut T, Failure> {
    // SAFETY: the caller's promise.
    unsafe { out.as_mut() }.ok_or_else(|| Failure::null(what))
}
