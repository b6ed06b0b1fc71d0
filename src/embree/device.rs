//! The device: Embree's threads, memory and errors.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::NonNull;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};

use super::faults::Faults;
use super::sys;
use super::{EmbreeError, ErrorCode};

/// How to make a [`Device`].
#[derive(Clone, Debug, Default)]
pub struct DeviceOptions {
    /// Embree's configuration, like `threads=2`; empty for the defaults.
    pub config: String,
    /// Bytes that Embree may hold; an allocation beyond fails with [`EmbreeError::MemoryLimit`].
    pub memory_limit: Option<usize>,
}

/// What Embree holds, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// Now.
    pub current: usize,
    /// At most so far.
    pub peak: usize,
}

/// An Embree device. Clones are the same device.
#[derive(Clone, Debug)]
pub struct Device {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    raw: NonNull<sys::pm_device>,
    state: Arc<DeviceState>,
}

// SAFETY: Embree's device functions may be called from any thread; the pointer is never written after `new`.
unsafe impl Send for Inner {}
// SAFETY: as above.
unsafe impl Sync for Inner {}

impl Drop for Inner {
    fn drop(&mut self) {
        // SAFETY: made by pm_device_new, freed once; `state`, which its callbacks use, is dropped later.
        unsafe { sys::pm_device_free(self.raw.as_ptr()) }
    }
}

/// What the callbacks write.
#[derive(Debug)]
struct DeviceState {
    current: AtomicI64,
    peak: AtomicI64,
    /// Negative: none.
    limit: i64,
    refused: AtomicBool,
    faults: Arc<Faults>,
}

impl DeviceState {
    /// False refuses an allocation that is about to happen: such bytes are not counted.
    fn account(&self, bytes: i64, post: bool) -> bool {
        let total = self.current.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if bytes > 0 && self.limit >= 0 && total > self.limit {
            self.refused.store(true, Ordering::Relaxed);
            if !post {
                self.current.fetch_sub(bytes, Ordering::Relaxed);
            }
            return false;
        }
        self.peak.fetch_max(total, Ordering::Relaxed);
        true
    }
}

thread_local! {
    /// While a call is guarded: the error it reported. Embree reports on the calling thread.
    static REPORTED: RefCell<Option<Option<(c_int, String)>>> = const { RefCell::new(None) };
}

unsafe extern "C" fn on_error(user: *const c_void, code: c_int, message: *const c_char) {
    // SAFETY: Embree passes a C string that is valid during the call.
    let message = unsafe { CStr::from_ptr(message) }
        .to_string_lossy()
        .into_owned();
    let unguarded = REPORTED.with_borrow_mut(|slot| match slot {
        Some(first) => {
            first.get_or_insert((code, message));
            None
        }
        None => Some(message),
    });
    if let Some(message) = unguarded {
        // SAFETY: `user` is the DeviceState given to pm_device_new, which outlives the device.
        let state = unsafe { &*user.cast::<DeviceState>() };
        state.faults.record(EmbreeError::Library {
            code: ErrorCode::from_raw(code),
            message,
        });
    }
}

unsafe extern "C" fn on_memory(user: *const c_void, bytes: i64, post: bool) -> bool {
    // SAFETY: as in `on_error`.
    unsafe { &*user.cast::<DeviceState>() }.account(bytes, post)
}

impl Device {
    /// A device. Fails when the configuration cannot be read, the processor is unsupported, or the library
    /// lacks ray masks or filter functions.
    pub fn new(options: &DeviceOptions) -> Result<Self, EmbreeError> {
        let config = CString::new(options.config.as_str()).map_err(|_| EmbreeError::Library {
            code: ErrorCode::InvalidArgument,
            message: "the configuration contains a zero byte".to_string(),
        })?;
        let limit = options
            .memory_limit
            .map_or(-1, |bytes| i64::try_from(bytes).unwrap_or(i64::MAX));
        let state = Arc::new(DeviceState {
            current: AtomicI64::new(0),
            peak: AtomicI64::new(0),
            limit,
            refused: AtomicBool::new(false),
            faults: Arc::default(),
        });
        let user: *const DeviceState = Arc::as_ptr(&state);
        let mut code = 0;
        // SAFETY: `config` is a C string; `state` lives in `Inner` until after the device is freed.
        let raw = unsafe {
            sys::pm_device_new(
                config.as_ptr(),
                user.cast(),
                Some(on_error),
                Some(on_memory),
                &mut code,
            )
        };
        let raw = NonNull::new(raw).ok_or_else(|| EmbreeError::Library {
            code: ErrorCode::from_raw(code),
            message: format!("no device with configuration `{}`", options.config),
        })?;
        let device = Self {
            inner: Arc::new(Inner { raw, state }),
        };
        device.require_features()?;
        Ok(device)
    }

    fn require_features(&self) -> Result<(), EmbreeError> {
        // SAFETY: a live device.
        let (masks, filters) = unsafe {
            (
                sys::pm_device_has_masks(self.raw()),
                sys::pm_device_has_filters(self.raw()),
            )
        };
        let missing = match (masks, filters) {
            (true, true) => return Ok(()),
            (false, _) => "ray masks",
            (true, false) => "filter functions",
        };
        Err(EmbreeError::Unsupported {
            version: self.version(),
            what: missing,
        })
    }

    /// Version of the library that is loaded, like `4.3.3`.
    pub fn version(&self) -> String {
        // SAFETY: a live device.
        let v = unsafe { sys::pm_device_version(self.raw()) };
        format!("{}.{}.{}", v / 10000, v / 100 % 100, v % 100)
    }

    /// What Embree holds for everything made from this device. Buffers that are shared with it do not count.
    pub fn memory(&self) -> Memory {
        let bytes = |a: &AtomicI64| usize::try_from(a.load(Ordering::Relaxed)).unwrap_or(0);
        Memory {
            current: bytes(&self.inner.state.current),
            peak: bytes(&self.inner.state.peak),
        }
    }

    /// The first fault since the last call: a panic in a hit test or filter, or an error while rays were traced.
    /// Committing a scene asks too.
    pub fn check(&self) -> Result<(), EmbreeError> {
        self.faults().take()
    }

    pub(super) fn raw(&self) -> *const sys::pm_device {
        self.inner.raw.as_ptr()
    }

    pub(super) fn faults(&self) -> &Arc<Faults> {
        &self.inner.state.faults
    }

    /// Runs a call into the shim and returns what it reported as an error.
    pub(super) fn guarded<T>(&self, call: impl FnOnce() -> T) -> Result<T, EmbreeError> {
        // A hit test's `bounds` may itself build a scene: guards nest.
        let outer = REPORTED.replace(Some(None));
        let value = call();
        match REPORTED.replace(outer).flatten() {
            None => Ok(value),
            Some((code, message)) => Err(self.describe(code, message)),
        }
    }

    fn describe(&self, code: c_int, message: String) -> EmbreeError {
        let state = &self.inner.state;
        match ErrorCode::from_raw(code) {
            ErrorCode::OutOfMemory if state.refused.swap(false, Ordering::Relaxed) => {
                EmbreeError::MemoryLimit {
                    limit: usize::try_from(state.limit).unwrap_or(0),
                }
            }
            code => EmbreeError::Library { code, message },
        }
    }
}
