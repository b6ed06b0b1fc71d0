//! Renders that are watched: in the viewer tev, which is played by a listener, and by the file that is written again and again.

mod program;

use std::collections::BTreeMap;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use prismarch::image::{read_exr, write_png_gray16};
use program::{Folder, OUTPUT, USAGE, done, line_refused, pixels, refused, stderr};

/// What tev shows.
#[derive(Debug, Default)]
struct Shown {
    name: String,
    size: (usize, usize),
    /// Bits of every channel, row by row from the top.
    channels: BTreeMap<String, Vec<u32>>,
    updates: usize,
}

/// A packet being taken apart.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (field, rest) = self.0.split_at(N);
        self.0 = rest;
        field.try_into().unwrap()
    }

    fn int(&mut self) -> usize {
        i32::from_le_bytes(self.bytes()).try_into().unwrap()
    }

    fn long(&mut self) -> usize {
        i64::from_le_bytes(self.bytes()).try_into().unwrap()
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|&byte| byte == 0).unwrap();
        let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
        self.0 = &self.0[end + 1..];
        text
    }

    fn texts(&mut self) -> Vec<String> {
        let count = self.int();
        (0..count).map(|_| self.text()).collect()
    }
}

impl Shown {
    fn take(&mut self, packet: &[u8]) {
        let mut fields = Fields(packet);
        let [kind, grabs_focus] = fields.bytes();
        let name = fields.text();
        match kind {
            4 => {
                assert!(self.name.is_empty() && grabs_focus == 1);
                self.name = name;
                self.size = (fields.int(), fields.int());
                let black = vec![0; self.size.0 * self.size.1];
                let names = fields.texts().into_iter();
                self.channels = names.map(|name| (name, black.clone())).collect();
                assert!(fields.0.is_empty());
            }
            6 => {
                assert!(self.name == name && grabs_focus == 0);
                self.updates += 1;
                let names = fields.texts();
                let [x, y, width, height] = [(); 4].map(|()| fields.int());
                let offsets: Vec<_> = names.iter().map(|_| fields.long()).collect();
                let strides: Vec<_> = names.iter().map(|_| fields.long()).collect();
                let values: Vec<u32> = (fields.0.chunks_exact(4))
                    .map(|value| u32::from_le_bytes(value.try_into().unwrap()))
                    .collect();
                let mut needed = 0;
                for ((name, offset), stride) in names.iter().zip(offsets).zip(strides) {
                    needed = needed.max(offset + (width * height - 1) * stride + 1);
                    let channel = self.channels.get_mut(name).unwrap();
                    for pixel in 0..width * height {
                        let (column, row) = (x + pixel % width, y + pixel / width);
                        assert!(column < self.size.0 && row < self.size.1);
                        channel[row * self.size.0 + column] = values[offset + pixel * stride];
                    }
                }
                assert_eq!(fields.0.len(), 4 * needed);
            }
            other => panic!("a packet of kind {other}"),
        }
    }
}

/// Takes packets until the other side hangs up, `most` at most.
fn listen(mut stream: TcpStream, most: usize) -> Shown {
    let mut shown = Shown::default();
    for _ in 0..most {
        let mut length = [0; 4];
        if stream.read_exact(&mut length).is_err() {
            break;
        }
        let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut packet).unwrap();
        shown.take(&packet);
    }
    shown
}

/// Renders and plays a tev that takes `most` packets; what it shows in the end, and what the program said.
fn show(folder: &Folder, arguments: &str, most: usize) -> (Shown, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::scope(|scope| {
        let tev = scope.spawn(|| listen(listener.accept().unwrap().0, most));
        let output = done(folder, &format!("{arguments} --tev 127.0.0.1:{port}"));
        (tev.join().unwrap(), stderr(&output))
    })
}

/// The usual folder with bumps, and a picture of more than one cell.
fn folder() -> Folder {
    let folder = Folder::in_memory();
    let noise = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 16) as u16;
    let heights: Vec<u16> = (0..32 * 32).map(noise).collect();
    write_png_gray16(&folder.path("flat.png"), 32, 32, &heights).unwrap();
    let scene = folder.text("scene.toml");
    let size = ("width = 16\nheight = 12", "width = 90\nheight = 75");
    folder.put("scene.toml", scene.replace(size.0, size.1));
    folder
}

/// Holds what tev shows to the channels of an EXR file.
#[track_caller]
fn is_shown(folder: &Folder, file: &str, shown: &Shown) {
    let picture = read_exr(&folder.path(file)).unwrap();
    let (x0, y0) = (picture.position.0 as usize, picture.position.1 as usize);
    let channels = pixels(folder, file).1;
    assert_eq!(shown.size, picture.display);
    for (name, found) in &shown.channels {
        let mut expected = vec![0; found.len()];
        // Files come from the bottom row up.
        for (row, bits) in channels[name].chunks(picture.width).rev().enumerate() {
            expected[(y0 + row) * shown.size.0 + x0..][..bits.len()].copy_from_slice(bits);
        }
        assert!(*found == expected, "{name}");
    }
}

#[test]
fn tev_shows_what_the_file_has_to_the_bit() {
    let folder = folder();
    let all = "A,B,G,N.X,N.Y,N.Z,R,albedo.B,albedo.G,albedo.R";
    for (options, channels) in [
        ("", all),
        (" --spp 5 --progressive --aovs N,Z", "A,B,G,N.X,N.Y,N.Z,R"),
        (" --crop 5,66,70,75 --aovs none --threads 1", "A,B,G,R"),
        (" --crop 70,1,90,2 --spp 4 --preview", all),
        // Tiles of a pixel or two.
        (" --crop 60,60,68,68 --spp 4096 --integrator depth", all),
    ] {
        let render = format!("render scene.toml -o a.exr{options}");
        let (shown, said) = show(&folder, &render, usize::MAX);
        assert!(!said.contains("warning"), "{said}");
        assert_eq!(shown.name, "a.exr");
        let names: Vec<&str> = shown.channels.keys().map(String::as_str).collect();
        assert_eq!(names.join(","), channels, "{options}");
        is_shown(&folder, "a.exr", &shown);
        assert!(shown.updates < 200, "{}", shown.updates);
    }
    let (shown, _) = show(&folder, "render scene.toml -o a.png", usize::MAX);
    done(&folder, "render scene.toml -o a.exr");
    assert_eq!((&shown.name[..], shown.channels.len()), ("a.png", 4));
    is_shown(&folder, "a.exr", &shown);
}

#[test]
fn a_viewer_that_hangs_up_is_a_warning() {
    let folder = folder();
    let render = "render scene.toml --size 70x40 --spp 8 --progressive --aovs N -o";
    done(&folder, &format!("{render} whole.exr"));
    for most in [0, 2] {
        let (shown, said) = show(&folder, &format!("{render} a.exr"), most);
        assert!(shown.updates < 2);
        assert!(said.matches("warning").count() <= 1, "{said}");
        assert!(pixels(&folder, "a.exr") == pixels(&folder, "whole.exr"));
    }
}

#[test]
fn a_viewer_that_is_not_there_is_an_error_before_all_else() {
    let folder = folder();
    // A port that nobody listens at.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    drop(listener);
    let render = "render scene.toml -o a.exr --tev";
    line_refused(
        &folder,
        &format!("{render} {address}"),
        OUTPUT,
        &[&address, "--tev"],
    );
    for bad in [
        "127.0.0.1:0",
        "127.0.0.1:70000",
        "127.0.0.1:x",
        ":14158",
        "a:b:c",
    ] {
        line_refused(
            &folder,
            &format!("{render} {bad}"),
            USAGE,
            &[bad, "HOST:PORT"],
        );
    }
    for bad in ["0", "-1", "nan", "1e9", "soon"] {
        let preview = ["render", "scene.toml", "--preview", bad];
        refused(&folder, &preview, USAGE, &[bad]);
    }
}

#[test]
fn a_previewed_run_ends_in_the_same_bits() {
    let folder = folder();
    let render = "render scene.toml --size 30x20 --spp 400 --aovs N,variance -o";
    done(&folder, &format!("{render} whole.exr"));
    let previewed = done(&folder, &format!("{render} a.exr --preview 0.1"));
    assert!(
        stderr(&previewed).contains("pass "),
        "{}",
        stderr(&previewed)
    );
    assert!(pixels(&folder, "a.exr") == pixels(&folder, "whole.exr"));
    // Attributes come in any order.
    let attributes = |name: &str| {
        let mut all = read_exr(&folder.path(name)).unwrap().attributes;
        all.sort();
        all
    };
    assert_eq!(attributes("a.exr"), attributes("whole.exr"));
}

#[cfg(unix)]
#[test]
fn a_preview_that_cannot_be_written_ends_the_run() {
    let folder = folder();
    // Hours, if it did not end.
    let run = "render scene.toml --spp 1000000 -o a.exr --preview 0.1";
    let arguments: Vec<&str> = run.split(' ').collect();
    let before = folder.names();
    let output = folder.run_on_full_disk(&arguments);
    assert_eq!(output.status.code(), Some(OUTPUT), "{}", stderr(&output));
    assert_eq!(folder.names(), before);
}

/// Renders to `a.exr` until that is there, then kills the run.
fn kill_at_the_first_preview(folder: &Folder, render: &str) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_prismarch"))
        .args(format!("{render} a.exr --preview 0.1 --quiet").split(' '))
        .current_dir(folder.path(""))
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !folder.path("a.exr").exists() && begun.elapsed() < Duration::from_secs(60) {
        thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_preview_is_partial_and_goes_on_when_the_run_is_killed() {
    let folder = folder();
    // Hours, if it were not killed.
    kill_at_the_first_preview(&folder, "render scene.toml --spp 1000000 -o");
    let left = read_exr(&folder.path("a.exr")).unwrap();
    let partial = ("prismarch/partial".to_owned(), "true".to_owned());
    assert!(left.attributes.contains(&partial));
    std::fs::remove_file(folder.path("a.exr")).unwrap();

    let render = "render scene.toml --size 20x15 --spp 1200 --aovs N -o";
    kill_at_the_first_preview(&folder, render);
    done(&folder, &format!("{render} a.exr --resume"));
    done(&folder, &format!("{render} whole.exr"));
    assert!(pixels(&folder, "a.exr") == pixels(&folder, "whole.exr"));
}
