//! Whole pictures, cut in every way.

use glam::UVec2;

use super::*;
use crate::scene::{Adaptive, AovSet, Filter, FilterShape, Window};

/// A scene with edges, a shadow, reflections and noise.
fn busy() -> Setup {
    let lights = vec![sun(30.0), uniform_environment()];
    let mut scene = Setup::new(true, material(0.3, 0.3, 0.5), lights);
    scene.film.aovs = AovSet::ALL;
    scene
}

#[test]
fn windows_put_together_are_the_whole_to_the_bit() {
    for shape in [FilterShape::BlackmanHarris, FilterShape::Mitchell] {
        let mut scene = busy();
        scene.film.filter = Filter::of(shape);
        let whole = scene.frame(0..4);
        let mut together = Frame::new(&scene.film, 0..4, Objects::new(["plane", "sphere"]));
        for corners in [[0, 0, 20, 30], [20, 0, 45, 7], [20, 7, 45, 30]] {
            let [x0, y0, x1, y1] = corners;
            scene.film.crop = Some(Window {
                start: UVec2::new(x0, y0),
                end: UVec2::new(x1, y1),
            });
            together.place(&scene.frame(0..4));
        }
        assert!(whole == together, "{shape:?}");
    }
}

#[test]
fn adaptive_and_progressive_films_have_the_same_bits_however_they_are_cut() {
    let mut scene = busy();
    scene.film.spp = 64;
    scene.film.adaptive = Some(Adaptive {
        threshold: 0.25,
        min_spp: 8,
    });
    let whole = scene.frame(0..64);
    let taken: Vec<u32> = (0..45 * 30)
        .map(|i| whole.pixel(i).counts.taken())
        .collect();
    assert!(taken.contains(&8) && taken.contains(&64));
    for progressive in [false, true] {
        scene.film.progressive = progressive;
        let mut frame = Frame::new(&scene.film, 0..64, Objects::new(["plane", "sphere"]));
        // Stopped again and again, at odd samples.
        while !frame.is_complete() {
            let left = std::sync::atomic::AtomicU32::new(20_011);
            let stop = || left.fetch_sub(1, std::sync::atomic::Ordering::Relaxed) < 2;
            let control = Control {
                stop: &stop,
                ..Control::default()
            };
            render_frame(&scene.input(), &mut frame, control);
        }
        assert!(frame == whole, "{progressive}");
    }
}

#[test]
fn a_progressive_film_is_shown_after_every_pass() {
    let mut scene = busy();
    scene.film.spp = 11;
    scene.film.progressive = true;
    let mut frame = Frame::new(&scene.film, 0..11, Objects::default());
    let mut seen = Vec::new();
    let control = Control {
        pass: Some(&mut |frame: &Frame| seen.push(frame.pixel(77).counts.taken())),
        ..Control::default()
    };
    render_frame(&scene.input(), &mut frame, control);
    assert_eq!(seen, [1, 2, 4, 8]);
    assert!(frame.is_complete());
}

#[test]
fn tiles_are_shown_before_they_are_placed_and_work_is_counted_to_its_end() {
    let mut scene = busy();
    scene.film.spp = 64;
    scene.film.progressive = true;
    scene.film.adaptive = Some(Adaptive {
        threshold: 0.25,
        min_spp: 8,
    });
    let whole = Frame::new(&scene.film, 0..64, Objects::default());
    let (mut frame, shown) = (whole.clone(), Mutex::new(whole));
    // Stopped once, in the middle.
    for most in [20_000, u32::MAX] {
        let last = Mutex::new((0, 0, 0));
        let left = std::sync::atomic::AtomicU32::new(most);
        let lacked = frame.lacks(&(0..64));
        let control = Control {
            stop: &|| left.fetch_sub(1, std::sync::atomic::Ordering::Relaxed) < 2,
            tile_done: &|tile| shown.lock().unwrap().place(tile),
            progress: &|status| {
                let mut last = last.lock().unwrap();
                assert!(status.done >= last.0);
                assert_eq!((status.total, status.passes), (lacked, 7));
                *last = (status.done, status.total, status.pass);
            },
            ..Control::default()
        };
        let outcome = render_frame(&scene.input(), &mut frame, control);
        assert_eq!(outcome.stopped, most != u32::MAX);
        assert!(shown.lock().unwrap().radiance() == frame.radiance());
        let (done, total, pass) = *last.lock().unwrap();
        assert_eq!((done, pass) == (total, 7), !outcome.stopped);
    }
}

#[test]
fn a_viewer_is_shown_what_an_exr_file_has() {
    let mut scene = busy();
    let frame = scene.frame(0..4);
    let names = "R G B A albedo.R albedo.G albedo.B N.X N.Y N.Z";
    assert_eq!(frame.shown_channels().join(" "), names);
    let (values, radiance) = (frame.shown_values(), frame.radiance());
    assert!(values.chunks(10).map(Vec3::from_slice).eq(radiance));
    scene.film.aovs = AovSet::NONE;
    assert_eq!(scene.frame(0..1).shown_channels().join(" "), "R G B A");
}

#[test]
fn all_filters_converge_to_the_same_mean() {
    let mean = |shape| {
        let mut scene = Setup::new(false, material(0.0, 1.0, 0.0), vec![uniform_environment()]);
        scene.film.spp = 64;
        scene.film.filter = Filter::of(shape);
        scene.mean().x
    };
    for &(name, shape) in FilterShape::NAMES {
        assert!((mean(shape) - 1.0).abs() < 0.01, "{name}");
    }
}

#[test]
fn the_clamp_lowers_fireflies_only() {
    let mut scene = busy();
    let free = scene.frame(0..4).radiance();
    scene.film.clamp = Some(0.3);
    let clamped = scene.frame(0..4).radiance();
    assert!(free.iter().any(|p| p.max_element() > 0.5));
    for (free, clamped) in free.iter().zip(clamped) {
        assert!(clamped.max_element() <= 0.3 + 1e-6 && clamped.cmple(*free + 1e-6).all());
    }
}
