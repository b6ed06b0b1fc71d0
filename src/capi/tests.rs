use super::declarations as c;
use super::error::{Failure, answer};
use super::handle::Handle;
use super::live::Flight;
use super::surface::Surface;

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
        prismarch_surface_closest(_, _, _, _, _, _, _, _, _) in geometry;
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

/// A square under a map of 2x2 texels.
fn square() -> (*mut c::prismarch_map, *mut c::prismarch_surface) {
    let heights = [0u8, 255, 0, 255];
    let texels = c::prismarch_texels {
        data: heights.as_ptr().cast(),
        format: c::prismarch_texel_PRISMARCH_TEXEL_U8,
        texel_stride: 0,
        row_stride: 0,
    };
    let positions = [
        [0.0f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let texcoords = [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let quad = [0u32, 1, 2, 3];
    let (mut map, mut surface) = (std::ptr::null_mut(), std::ptr::null_mut());
    // SAFETY: arrays as long as is said; all outputs are writable.
    unsafe {
        let mut desc: c::prismarch_surface_desc = std::mem::zeroed();
        super::surface::prismarch_surface_desc_init(&mut desc);
        let none = std::ptr::null_mut();
        let wrap = c::prismarch_wrap_PRISMARCH_WRAP_CLAMP;
        super::map::prismarch_map_create(2, 2, &texels, wrap, &mut map, none);
        desc.vertex_count = 4;
        desc.primitive_count = 1;
        desc.primitive = c::prismarch_primitive_PRISMARCH_QUADS;
        desc.indices.data = quad.as_ptr().cast();
        desc.vertices.positions.data = positions.as_ptr().cast();
        desc.texcoords.data = texcoords.as_ptr().cast();
        desc.map = map;
        let status = super::surface::prismarch_surface_create(&desc, &mut surface, none);
        assert_eq!(status, c::prismarch_status_PRISMARCH_OK);
    }
    (map, surface)
}

#[test]
fn an_edit_during_a_trace_is_caught_where_debug_assertions_are_on() {
    let (map, surface) = square();
    let texels = c::prismarch_texels {
        data: [7u8].as_ptr().cast(),
        format: c::prismarch_texel_PRISMARCH_TEXEL_U8,
        texel_stride: 0,
        row_stride: 0,
    };
    // SAFETY: live handles, one texel.
    unsafe {
        let update = || {
            let (none, error) = (std::ptr::null_mut(), std::ptr::null_mut());
            super::map::prismarch_map_update(map, 0, 0, 1, 1, &texels, none, error)
        };
        let flight = Flight::new(&Handle::<Surface>::borrow(surface.cast()).unwrap().live);
        let expected = if cfg!(debug_assertions) {
            c::prismarch_status_PRISMARCH_ERROR_IN_FLIGHT
        } else {
            c::prismarch_status_PRISMARCH_OK
        };
        assert_eq!(update(), expected);
        #[allow(clippy::drop_non_drop)] // it is one in debug builds
        drop(flight);
        assert_eq!(update(), c::prismarch_status_PRISMARCH_OK);
        super::surface::prismarch_surface_release(surface);
        super::map::prismarch_map_release(map);
    }
}

#[test]
fn the_halves_of_a_quad_meet_along_its_diagonal() {
    let (map, surface) = square();
    let at = |u: f32, v: f32| {
        // SAFETY: any bits are such a struct.
        let mut point: c::prismarch_point = unsafe { std::mem::zeroed() };
        let none = std::ptr::null_mut();
        // SAFETY: a live handle; the point is writable.
        let status = unsafe {
            super::surface::prismarch_interpolate(surface, 0, u, v, 0.0, &mut point, none)
        };
        assert_eq!(status, c::prismarch_status_PRISMARCH_OK);
        point
    };
    for k in 0..=8 {
        let u = k as f32 / 8.0;
        for (u, v) in [(u, 0.25), (u, 0.5), (u, 0.875)] {
            let point = at(u, v);
            assert!((point.base_position[0] - u).abs() < 1e-6, "{u} {v}");
            assert!((point.base_position[1] - v).abs() < 1e-6, "{u} {v}");
            // Derivatives run along the caller's u and v in both halves.
            assert!((point.dPdu[0] - 1.0).abs() < 1e-5 && (point.dPdv[1] - 1.0).abs() < 1e-5);
        }
    }
    // SAFETY: released once each.
    unsafe {
        super::surface::prismarch_surface_release(surface);
        super::map::prismarch_map_release(map);
    }
}
