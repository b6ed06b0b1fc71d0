use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use glam::Vec3;

use super::declarations as c;
use super::error::{Failure, answer};
use super::handle::used;
use super::surface::Surface;
use crate::embree::HitTest;
use crate::ray::{Ray, RayPacket};

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
        prismarch_surface_desc_init_sized(_, _) in surface;
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
        prismarch_geometry_keeps_surface() in geometry;
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

/// Four corners and what else a square needs.
struct Square {
    positions: [[f32; 3]; 4],
    texcoords: [[f32; 2]; 4],
    quad: [u32; 4],
}

const SQUARE: Square = Square {
    positions: [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ],
    texcoords: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
    quad: [0, 1, 2, 3],
};

const OK: c::prismarch_status = c::prismarch_status_PRISMARCH_OK;
const HANDLE: c::prismarch_status = c::prismarch_status_PRISMARCH_ERROR_HANDLE;
const ARGUMENT: c::prismarch_status = c::prismarch_status_PRISMARCH_ERROR_ARGUMENT;
const DATA: c::prismarch_status = c::prismarch_status_PRISMARCH_ERROR_DATA;
const IN_FLIGHT: c::prismarch_status = c::prismarch_status_PRISMARCH_ERROR_IN_FLIGHT;

impl Square {
    fn desc(&self, map: *mut c::prismarch_map) -> c::prismarch_surface_desc {
        // SAFETY: pointers, numbers and a bool may be zero; the description is writable.
        let mut desc: c::prismarch_surface_desc = unsafe { std::mem::zeroed() };
        let size = size_of_val(&desc);
        // SAFETY: the description is writable.
        unsafe { super::surface::prismarch_surface_desc_init_sized(&mut desc, size) };
        desc.vertex_count = 4;
        desc.primitive_count = 1;
        desc.primitive = c::prismarch_primitive_PRISMARCH_QUADS;
        desc.indices.data = self.quad.as_ptr().cast();
        desc.vertices = self.vertices();
        desc.texcoords.data = self.texcoords.as_ptr().cast();
        desc.map = map;
        desc
    }

    fn vertices(&self) -> c::prismarch_vertices {
        // SAFETY: pointers and numbers may be zero.
        let mut vertices: c::prismarch_vertices = unsafe { std::mem::zeroed() };
        vertices.positions.data = self.positions.as_ptr().cast();
        vertices
    }
}

fn texels(data: *const u8) -> c::prismarch_texels {
    c::prismarch_texels {
        data: data.cast(),
        format: c::prismarch_texel_PRISMARCH_TEXEL_U8,
        texel_stride: 0,
        row_stride: 0,
    }
}

fn new_map() -> *mut c::prismarch_map {
    let heights = [0u8, 255, 0, 255];
    let mut map = std::ptr::null_mut();
    let wrap = c::prismarch_wrap_PRISMARCH_WRAP_CLAMP;
    let none = std::ptr::null_mut();
    // SAFETY: four texels; the map is writable.
    let status = unsafe {
        super::map::prismarch_map_create(2, 2, &texels(heights.as_ptr()), wrap, &mut map, none)
    };
    assert_eq!(status, OK);
    map
}

fn create(
    desc: *const c::prismarch_surface_desc,
) -> (c::prismarch_status, *mut c::prismarch_surface) {
    let mut surface = std::ptr::null_mut();
    // SAFETY: descriptions of these tests; the surface is writable.
    let status = unsafe {
        super::surface::prismarch_surface_create(desc, &mut surface, std::ptr::null_mut())
    };
    (status, surface)
}

/// A square under a map of 2x2 texels.
fn square() -> (*mut c::prismarch_map, *mut c::prismarch_surface) {
    let map = new_map();
    let (status, surface) = create(&SQUARE.desc(map));
    assert_eq!(status, OK);
    (map, surface)
}

fn free(map: *mut c::prismarch_map, surface: *mut c::prismarch_surface) {
    // SAFETY: no pointers but handles.
    unsafe {
        assert_eq!(super::surface::prismarch_surface_release(surface), OK);
        assert_eq!(super::map::prismarch_map_release(map), OK);
    }
}

fn interpolate(surface: *const c::prismarch_surface) -> c::prismarch_status {
    // SAFETY: any bits are such a struct, and it is writable.
    unsafe {
        let mut point: c::prismarch_point = std::mem::zeroed();
        let none = std::ptr::null_mut();
        super::surface::prismarch_interpolate(surface, 0, 0.5, 0.25, 0.0, &mut point, none)
    }
}

fn update(surface: *mut c::prismarch_surface, square: &Square) -> c::prismarch_status {
    let (needed, error) = (std::ptr::null_mut(), std::ptr::null_mut());
    // SAFETY: as many vertices as there were.
    unsafe {
        super::surface::prismarch_surface_update_vertices(
            surface,
            0,
            &square.vertices(),
            needed,
            error,
        )
    }
}

fn edit(map: *mut c::prismarch_map) -> c::prismarch_status {
    let (needed, error) = (std::ptr::null_mut(), std::ptr::null_mut());
    // SAFETY: one texel.
    unsafe {
        super::map::prismarch_map_update(map, 0, 0, 1, 1, &texels([7u8].as_ptr()), needed, error)
    }
}

#[test]
fn an_update_beside_a_ray_is_refused_and_changes_nothing() {
    let (map, surface) = square();
    let live = used::<Surface, _>(surface).unwrap().live.clone();
    let within = live.enter();
    assert_eq!(
        (edit(map), update(surface, &SQUARE)),
        (IN_FLIGHT, IN_FLIGHT)
    );
    let again = live.enter();
    drop(within);
    assert_eq!(
        (edit(map), update(surface, &SQUARE)),
        (IN_FLIGHT, IN_FLIGHT)
    );
    drop(again);
    let begun = live.begin_filter();
    assert_eq!(
        (edit(map), update(surface, &SQUARE)),
        (IN_FLIGHT, IN_FLIGHT)
    );
    // In a filter of another surface's a look cannot be pinned, and is counted.
    let (other_map, other) = square();
    let other_live = used::<Surface, _>(other).unwrap().live.clone();
    let within = other_live.enter();
    let nested = other_live.begin_filter();
    assert_eq!((begun, nested, update(other, &SQUARE)), (1, 2, IN_FLIGHT));
    other_live.end_filter(nested);
    assert_eq!(update(other, &SQUARE), IN_FLIGHT);
    drop(within);
    assert_eq!(update(other, &SQUARE), OK);
    free(other_map, other);
    live.end_filter(begun);
    assert_eq!((edit(map), update(surface, &SQUARE)), (OK, OK));
    // A ray that comes and goes while an update is made.
    let watched = live.watch().unwrap();
    assert_eq!(interpolate(surface), OK);
    assert!(watched.shut().is_err());
    assert!(live.watch().unwrap().shut().is_ok());
    free(map, surface);
}

/// Rays of several threads on a surface that goes up and down: each hit is on the surface as it was before or after an update.
#[test]
fn rays_beside_updates_meet_a_whole_surface() {
    let (map, surface) = square();
    let live = used::<Surface, _>(surface).unwrap().live.clone();
    let raised = Square {
        positions: SQUARE.positions.map(|[x, y, z]| [x, y, z + 1.0]),
        ..SQUARE
    };
    let ray = Ray::new(Vec3::new(0.5, 0.25, 5.0), Vec3::NEG_Z);
    let done = AtomicBool::new(false);
    let [mut made, mut refused] = [0, 0];
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    let hit = live.intersect(0, &ray).unwrap();
                    let far = 4.5 - hit.t;
                    assert!(far.abs() < 1e-4 || (far - 1.0).abs() < 1e-4, "{far}");
                    assert!(live.bounds(0).max.z >= 1.0);
                    std::thread::yield_now();
                }
            });
        }
        let surface = surface.addr();
        let (made, refused) = (&mut made, &mut refused);
        scope
            .spawn(move || {
                let surface = std::ptr::without_provenance_mut(surface);
                for round in 0..2000 {
                    match update(surface, if round % 2 == 0 { &raised } else { &SQUARE }) {
                        OK => *made += 1,
                        IN_FLIGHT => *refused += 1,
                        other => panic!("status {other}"),
                    }
                }
            })
            .join()
            .unwrap();
        done.store(true, Ordering::Relaxed);
    });
    assert_eq!(made + refused, 2000);
    assert_eq!(update(surface, &SQUARE), OK);
    free(map, surface);
}

#[test]
fn wild_stale_and_other_handles_get_a_status_in_every_function() {
    let (map, surface) = square();
    let (stale_map, stale_surface) = square();
    free(stale_map, stale_surface);
    // Handles that have come since are others, wherever they are kept.
    let (young_map, young_surface) = square();
    assert!(young_map != stale_map && young_surface != stale_surface);
    let number = 5u64;
    let wild = [
        stale_map.addr(),
        stale_surface.addr(),
        std::ptr::from_ref(&number).addr(),
        16,
        3,
        usize::MAX,
        surface.addr() + 1,
        surface.addr() ^ 1 << 20,
        1 << (usize::BITS - 1),
    ];
    let no_map = wild.into_iter().chain([surface.addr()]);
    let no_surface = wild.into_iter().chain([map.addr()]);
    let error = std::ptr::null_mut();
    // SAFETY: no handle is read through; all else is writable.
    unsafe {
        use super::{geometry, map as maps, surface as surfaces};
        for wild in no_map.map(std::ptr::without_provenance_mut) {
            let [mut w, mut h] = [0; 2];
            assert_eq!(
                maps::prismarch_map_size(wild, &mut w, &mut h, error),
                HANDLE
            );
            assert_eq!(edit(wild), HANDLE);
            assert_eq!(maps::prismarch_map_retain(wild), HANDLE);
            assert_eq!(maps::prismarch_map_release(wild), HANDLE);
            assert_eq!(create(&SQUARE.desc(wild)), (HANDLE, std::ptr::null_mut()));
        }
        for wild in no_surface.map(std::ptr::without_provenance_mut) {
            assert_eq!(interpolate(wild), HANDLE);
            assert_eq!(update(wild, &SQUARE), HANDLE);
            assert_eq!(surfaces::prismarch_surface_check(wild, error), HANDLE);
            let mut bytes = 0;
            let status = surfaces::prismarch_surface_bytes(wild, &mut bytes, error);
            assert_eq!(status, HANDLE);
            assert_eq!(surfaces::prismarch_surface_retain(wild), HANDLE);
            assert_eq!(surfaces::prismarch_surface_release(wild), HANDLE);
            let none = std::ptr::null_mut();
            let status = surfaces::prismarch_interpolate_n(
                wild,
                none,
                none.cast(),
                none.cast(),
                none.cast(),
                0,
                0.0,
                none.cast(),
                error,
            );
            assert_eq!(status, HANDLE);
            let mut geometry = std::ptr::null_mut();
            let status =
                geometry::prismarch_geometry_create(none.cast(), wild, &mut geometry, error);
            assert_eq!(status, HANDLE);
            assert_eq!(closest(wild, [0.0; 3], 1.0), HANDLE);
        }
        // Geometries that are none of ours, or none at all.
        let wild = std::ptr::from_ref(&number).cast_mut().cast();
        let status = geometry::prismarch_geometry_set_user_data(wild, wild.cast(), error);
        assert_eq!(status, HANDLE);
        assert!(geometry::prismarch_geometry_user_data(wild).is_null());
        assert!(geometry::prismarch_geometry_user_data(std::ptr::null_mut()).is_null());
    }
    assert_eq!(
        interpolate(std::ptr::null()),
        c::prismarch_status_PRISMARCH_ERROR_NULL
    );
    assert_eq!(interpolate(young_surface), OK);
    free(young_map, young_surface);
    free(map, surface);
}

fn closest(surface: *const c::prismarch_surface, at: [f32; 3], radius: f32) -> c::prismarch_status {
    let mut found = false;
    // SAFETY: three floats; the outputs are writable.
    unsafe {
        let mut point: c::prismarch_closest_point = std::mem::zeroed();
        super::geometry::prismarch_surface_closest(
            surface,
            0,
            at.as_ptr(),
            radius,
            0.0,
            std::ptr::null(),
            &mut found,
            &mut point,
            std::ptr::null_mut(),
        )
    }
}

/// Each call of a thread ends with what is right before or after the release by another.
#[test]
fn a_release_waits_for_calls_that_use_the_handle() {
    for _ in 0..50 {
        let (map, surface) = square();
        let (started, address) = (AtomicUsize::new(0), surface.addr());
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    let surface = std::ptr::without_provenance(address);
                    started.fetch_add(1, Ordering::Relaxed);
                    while interpolate(surface) == OK {}
                    assert_eq!(interpolate(surface), HANDLE);
                });
            }
            while started.load(Ordering::Relaxed) < 2 {
                std::thread::yield_now();
            }
            free(map, surface);
        });
    }
}

#[test]
fn descriptions_of_other_versions_are_read() {
    let (first, size) = (
        super::desc::FIRST_SIZE,
        size_of::<c::prismarch_surface_desc>(),
    );
    let map = new_map();
    let release = |surface| {
        // SAFETY: no pointer but a handle.
        let status = unsafe { super::surface::prismarch_surface_release(surface) };
        assert_eq!(status, OK);
    };
    let has_filter = |desc: &c::prismarch_surface_desc| {
        let (status, surface) = create(desc);
        assert_eq!(status, OK);
        let has_filter = used::<Surface, _>(surface).unwrap().options.has_filter;
        release(surface);
        has_filter
    };
    let mut desc = SQUARE.desc(map);
    desc.has_filter = false;
    for struct_size in first..=size {
        desc.struct_size = struct_size;
        assert_eq!(has_filter(&desc), struct_size == first);
    }
    // What an older program's lacks may be anything.
    (desc.struct_size, desc.reserved) = (first, [255; 7]);
    assert!(has_filter(&desc));
    // A newer one's.
    #[repr(C)]
    struct Newer(c::prismarch_surface_desc, [u8; 24]);
    let mut newer = Newer(SQUARE.desc(map), [0; 24]);
    newer.0.struct_size = size + 24;
    let (status, surface) = create(&raw const newer.0);
    assert_eq!(status, OK);
    release(surface);
    newer.1[23] = 1;
    assert_eq!(create(&raw const newer.0).0, ARGUMENT);
    // None's.
    for size in [0, 3, first - 1, 5000, usize::MAX] {
        newer.0.struct_size = size;
        assert_eq!(create(&raw const newer.0).0, ARGUMENT, "{size}");
    }
    let mut reserved = SQUARE.desc(map);
    reserved.reserved[6] = 1;
    assert_eq!(create(&reserved).0, ARGUMENT);
    // SAFETY: a handle.
    unsafe { super::map::prismarch_map_release(map) };
}

#[test]
fn a_description_is_filled_as_far_as_it_goes() {
    use super::surface::{prismarch_surface_desc_init, prismarch_surface_desc_init_sized};
    let first = super::desc::FIRST_SIZE;
    let size = size_of::<c::prismarch_surface_desc>();
    // SAFETY: room for more than any of the sizes.
    unsafe {
        let mut memory = [std::mem::MaybeUninit::<c::prismarch_surface_desc>::uninit(); 2];
        let desc = memory.as_mut_ptr().cast::<c::prismarch_surface_desc>();
        let fill = || desc.cast::<u8>().write_bytes(0xaa, 2 * size);
        let byte = |i: usize| desc.cast::<u8>().add(i).read();
        fill();
        assert_eq!(prismarch_surface_desc_init(desc), OK);
        assert_eq!(
            ((*desc).struct_size, byte(first), byte(size)),
            (first, 0xaa, 0xaa)
        );
        assert_eq!(((*desc).scale, (*desc).time_step_count), (1.0, 1));
        fill();
        assert_eq!(prismarch_surface_desc_init_sized(desc, size + 5), OK);
        assert_eq!((*desc).struct_size, size + 5);
        assert!((*desc).has_filter && byte(size + 4) == 0 && byte(size + 5) == 0xaa);
        for bad in [0, first - 1, usize::MAX] {
            assert_eq!(prismarch_surface_desc_init_sized(desc, bad), ARGUMENT);
        }
        let none = std::ptr::null_mut();
        let null = c::prismarch_status_PRISMARCH_ERROR_NULL;
        assert_eq!(prismarch_surface_desc_init(none), null);
    }
}

#[test]
fn counts_and_strides_of_no_array_get_a_status() {
    let map = new_map();
    let null = c::prismarch_status_PRISMARCH_ERROR_NULL;
    let with = |change: &dyn Fn(&mut c::prismarch_surface_desc)| {
        let mut desc = SQUARE.desc(map);
        change(&mut desc);
        create(&desc).0
    };
    for count in [5, u32::MAX] {
        let none = std::ptr::null();
        let status = with(&|d| {
            (d.vertex_count, d.vertices.positions.data) = (count, none);
        });
        assert_eq!(status, null);
        let status = with(&|d| (d.vertex_count, d.texcoords.data) = (count, none));
        assert_eq!(status, null);
        let status = with(&|d| (d.primitive_count, d.indices.data) = (count, none));
        assert!([null, ARGUMENT].contains(&status));
    }
    let far = usize::MAX;
    for (stride, offset) in [
        (far, 0),
        (far / 4, 0),
        (0, far),
        (0, far / 2),
        (far / 8, far / 2),
    ] {
        for which in 0..3 {
            let status = with(&|d| {
                let buffer = match which {
                    0 => &mut d.indices,
                    1 => &mut d.vertices.positions,
                    _ => &mut d.texcoords,
                };
                (buffer.stride, buffer.offset) = (stride, offset);
                d.primitive_count = 9;
            });
            assert_eq!(status, ARGUMENT, "{which} {stride} {offset}");
        }
    }
    // SAFETY: one texel, which is not looked at where strides lead away from it.
    unsafe {
        let (mut none, wrap) = (std::ptr::null_mut(), c::prismarch_wrap_PRISMARCH_WRAP_CLAMP);
        let one = [0u8];
        for stride in [isize::MAX, isize::MIN, isize::MAX / 2, isize::MIN / 2] {
            for (texel_stride, row_stride) in [(stride, 0), (0, stride), (stride, stride)] {
                let texels = c::prismarch_texels {
                    texel_stride,
                    row_stride,
                    ..texels(one.as_ptr())
                };
                let error = std::ptr::null_mut();
                let status =
                    super::map::prismarch_map_create(9, 9, &texels, wrap, &mut none, error);
                assert_eq!(status, ARGUMENT);
            }
        }
        super::map::prismarch_map_release(map);
    }
}

#[test]
fn rays_and_points_beyond_what_embree_takes_miss_or_get_a_status() {
    let (map, surface) = square();
    let live = used::<Surface, _>(surface).unwrap().live.clone();
    let odd = [
        2e18,
        -2e18,
        f32::MAX,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    let good = Ray::new(Vec3::new(0.5, 0.25, 5.0), Vec3::NEG_Z);
    assert!(live.intersect(0, &good).is_some() && live.occluded(0, &good));
    let mut packet = RayPacket::from_rays(&[good; 8]);
    for (lane, x) in odd.into_iter().enumerate() {
        for axis in 0..3 {
            let [mut from, mut along] = [good; 2];
            from.origin[axis] = x;
            along.direction[axis] = x;
            for ray in [from, along] {
                assert!(live.intersect(0, &ray).is_none() && !live.occluded(0, &ray));
                packet.set(lane, &ray);
                let bits = live.occluded8(0, &packet, 255);
                assert_eq!(bits >> lane & 1, 0);
                assert!(live.intersect8(0, &packet, 255)[lane].is_none());
            }
        }
    }
    let hits = live.intersect8(0, &packet, 255).map(|hit| hit.is_some());
    assert_eq!(hits, [false, false, false, false, false, false, true, true]);
    assert_eq!(live.occluded8(0, &packet, 0b0111_1111), 0b0100_0000);

    for x in odd {
        for axis in 0..3 {
            let mut at = [0.0; 3];
            at[axis] = x;
            assert_eq!(closest(surface, at, 1.0), ARGUMENT);
        }
    }
    for radius in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        assert_eq!(closest(surface, [0.0; 3], radius), ARGUMENT);
    }
    for radius in [0.0, 1e30, f32::INFINITY] {
        assert_eq!(closest(surface, [0.0; 3], radius), OK);
    }
    free(map, surface);
}

#[test]
fn surfaces_that_reach_too_far_are_refused() {
    let map = new_map();
    let scaled = |by: f32| Square {
        positions: SQUARE.positions.map(|p| p.map(|x| x * by)),
        ..SQUARE
    };
    for (by, expected) in [(1e18, OK), (1.9e18, DATA), (1e30, DATA), (3e38, DATA)] {
        let (status, surface) = create(&scaled(by).desc(map));
        assert_eq!(status, expected, "{by}");
        // SAFETY: a handle, or null.
        unsafe { super::surface::prismarch_surface_release(surface) };
    }
    for scale in [2e18, -2e18, 3e38] {
        let desc = c::prismarch_surface_desc {
            scale,
            ..SQUARE.desc(map)
        };
        assert_eq!(create(&desc).0, DATA, "{scale}");
    }
    let (status, surface) = create(&SQUARE.desc(map));
    assert_eq!(status, OK);
    assert_eq!(update(surface, &scaled(1e19)), DATA);
    // Nothing has changed.
    assert_eq!((update(surface, &SQUARE), interpolate(surface)), (OK, OK));
    free(map, surface);
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
    free(map, surface);
}
