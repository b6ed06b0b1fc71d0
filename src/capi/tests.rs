use super::declarations as c;
use super::error::{Failure, answer};

/// The header's prototypes and the functions here are the same: what C calls is what is defined.
#[test]
fn functions_have_the_types_of_the_header() {
    macro_rules! same {
        ($($name:ident($($argument:tt),*) in $module:ident;)*) => {$(
            // Both coerce to one pointer type, or this does not compile.
            let _: [unsafe extern "C" fn($(same!(@any $argument)),*) -> _; 2] =
                [c::$name, super::$module::$name];
        )*};
        (@any $argument:tt) => { _ };
    }
    same! {
        prismarch_map_create(_, _, _, _, _, _) in map;
        prismarch_map_load(_, _, _, _, _) in map;
        prismarch_map_size(_, _, _, _) in map;
        prismarch_map_update(_, _, _, _, _, _, _, _) in map;
        prismarch_map_retain(_) in map;
        prismarch_map_release(_) in map;
        prismarch_surface_desc_init(_) in surface;
        prismarch_surface_create(_, _, _) in surface;
        prismarch_surface_update_vertices(_, _, _, _, _) in surface;
        prismarch_surface_check(_, _) in surface;
        prismarch_surface_bytes(_, _, _) in surface;
        prismarch_surface_retain(_) in surface;
        prismarch_surface_release(_) in surface;
        prismarch_interpolate(_, _, _, _, _, _, _) in surface;
        prismarch_interpolate_n(_, _, _, _, _, _, _, _, _) in surface;
        prismarch_geometry_create(_, _, _, _) in geometry;
        prismarch_geometry_set_user_data(_, _, _) in geometry;
        prismarch_geometry_user_data(_) in geometry;
        prismarch_closest(_, _, _, _, _, _, _) in geometry;
    }
    assert_eq!(super::prismarch_version(), c::PRISMARCH_VERSION);
}

#[test]
fn a_panic_becomes_a_status() {
    // SAFETY: any bits are such a struct.
    let mut error: c::prismarch_error = unsafe { std::mem::zeroed() };
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    // SAFETY: `error` is writable.
    let status = unsafe { answer(&mut error, || panic!("forced")) };
    std::panic::set_hook(hook);
    assert_eq!(status, c::prismarch_status_PRISMARCH_ERROR_PANIC);
    assert_eq!(text(&error), "a fault of prismarch: forced");
}

#[test]
fn long_messages_are_cut_at_whole_characters() {
    // SAFETY: any bits are such a struct.
    let mut error: c::prismarch_error = unsafe { std::mem::zeroed() };
    // SAFETY: `error` is writable.
    unsafe { answer(&mut error, || Err(Failure::data("\u{e4}".repeat(1000)))) };
    assert_eq!(text(&error), "\u{e4}".repeat(255));
}

fn text(error: &c::prismarch_error) -> String {
    // SAFETY: the message is ended by a zero.
    unsafe { std::ffi::CStr::from_ptr(error.message.as_ptr()) }
        .to_string_lossy()
        .into_owned()
}
