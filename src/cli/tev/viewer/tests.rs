use std::io::Read;
use std::net::TcpListener;
use std::thread;

use super::*;

fn window(x0: u32, y0: u32, x1: u32, y1: u32) -> Window {
    Window {
        start: UVec2::new(x0, y0),
        end: UVec2::new(x1, y1),
    }
}

/// A viewer of `window` that loses patience soon.
fn viewer(window: Window) -> Viewer {
    let image = Image {
        name: "a".into(),
        size: UVec2::new(2048, 2048),
        window,
        channels: vec!["R", "G"],
    };
    let short = Duration::from_millis(100);
    Viewer::with_patience(
        image,
        Patience {
            still: short,
            whole: 20 * short,
        },
    )
}

/// Both ends of a connection.
fn connection() -> (TcpStream, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let ours = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    (ours, listener.accept().unwrap().0)
}

/// Values of every pixel of a window, those of `seed`.
fn values(window: Window, seed: f32) -> Vec<f32> {
    let pixels = (window.start.y..window.end.y)
        .flat_map(|y| (window.start.x..window.end.x).map(move |x| (x, y)));
    pixels
        .flat_map(|(x, y)| [x as f32 + seed, y as f32])
        .collect()
}

#[test]
fn what_is_put_in_comes_out_once_by_cells() {
    let whole = window(10, 20, 10 + 130, 20 + 70);
    let viewer = viewer(whole);
    for (part, seed) in [
        (whole, 0.5),
        (whole, 0.25),
        (window(70, 80, 100, 90), 0.125),
    ] {
        viewer.put(part, &values(part, seed));
    }
    let mut image = vec![[f32::NAN; 2]; whole.pixels()];
    let mut packets = 0;
    while let Some((part, values)) = viewer.next() {
        packets += 1;
        let mut values = values.chunks_exact(2);
        for y in part.start.y..part.end.y {
            for x in part.start.x..part.end.x {
                let value = values.next().unwrap();
                image[whole.index(UVec2::new(x, y)).unwrap()] = [value[0], value[1]];
            }
        }
        assert!(values.next().is_none());
    }
    assert_eq!(packets, 3 * 2);
    let inner = window(70, 80, 100, 90);
    for y in whole.start.y..whole.end.y {
        for x in whole.start.x..whole.end.x {
            let at = UVec2::new(x, y);
            let seed = inner.index(at).map_or(0.25, |_| 0.125);
            let value = image[whole.index(at).unwrap()];
            assert_eq!(value, [x as f32 + seed, y as f32]);
        }
    }
}

#[test]
fn what_the_viewer_has_is_not_sent_again() {
    let whole = window(0, 0, 100, 100);
    let viewer = viewer(whole);
    viewer.put(whole, &vec![0.0; 2 * 100 * 100]);
    assert!(viewer.next().is_none());
    let mut some = vec![0.0; 2 * 100 * 100];
    some[2 * (70 * 100 + 30)] = 1.0;
    viewer.put(whole, &some);
    let (part, values) = viewer.next().unwrap();
    assert_eq!(part.to_string(), "0,70,64,71"); // what was compared at once
    assert_eq!(values.iter().sum::<f32>(), 1.0);
    assert!(viewer.next().is_none());
}

#[test]
fn a_viewer_that_never_reads_holds_nobody_up() {
    let whole = window(0, 0, 2048, 2048);
    let viewer = viewer(whole);
    let (ours, _theirs) = connection();
    thread::scope(|scope| {
        let sent = scope.spawn(|| viewer.send(&ours));
        // 32 MB each: more than the system keeps of a connection.
        for seed in [1.0, 2.0] {
            viewer.put(whole, &values(whole, seed));
        }
        assert!(!sent.is_finished());
        viewer.end();
        let error = sent.join().unwrap().unwrap_err();
        assert_eq!(error.kind(), ErrorKind::TimedOut);
    });
}

#[test]
fn a_viewer_that_hangs_up_is_left_alone() {
    let whole = window(0, 0, 64, 64);
    let viewer = viewer(whole);
    let (ours, mut theirs) = connection();
    thread::scope(|scope| {
        let sent = scope.spawn(|| viewer.send(&ours));
        theirs.read_exact(&mut [0; 8]).unwrap();
        drop(theirs);
        let mut seed = 0.0;
        while !sent.is_finished() {
            seed += 1.0;
            viewer.put(whole, &values(whole, seed));
            thread::yield_now();
        }
        let error = sent.join().unwrap().unwrap_err();
        assert!(!is_passing(&error), "{error}");
        viewer.put(whole, &values(whole, 0.0));
        viewer.state().queue.clear();
        viewer.put(whole, &values(whole, 0.5));
        assert!(viewer.next().is_none());
        viewer.end();
    });
}
