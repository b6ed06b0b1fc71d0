use std::ops::Range;
use std::path::PathBuf;

use glam::{Vec2, Vec3};
use tempfile::TempDir;

use super::super::merge::merge;
use super::super::sample::{CameraSample, FirstHit};
use super::super::{Part, Source};
use super::*;
use crate::image::read_exr;
use crate::scene::{Film, Window};

const SPP: u32 = 12;

fn film() -> Film {
    Film {
        width: 7,
        height: 5,
        spp: SPP,
        aovs: AovSet::ALL.with(Aov::Cost),
        ..Film::default()
    }
}

fn window(corners: [u32; 4]) -> Window {
    let [x0, y0, x1, y1] = corners;
    Window {
        start: UVec2::new(x0, y0),
        end: UVec2::new(x1, y1),
    }
}

/// A number in [0, 1) for each sample of each pixel.
fn noise(pixel: UVec2, sample: u32) -> f32 {
    let x = (pixel.x + 31 * pixel.y + 977 * sample).wrapping_mul(0x9e37_79b9);
    ((x ^ x >> 15) >> 8) as f32 / (1 << 24) as f32
}

/// What "rendering" these samples of this window of `film` gives.
fn rendered(film: &Film, corners: [u32; 4], samples: Range<u32>) -> FrameFile {
    let film = Film {
        crop: Some(window(corners)),
        ..*film
    };
    let source = Source {
        name: "scene.toml".into(),
        hash: "abc".into(),
        integrator: "beauty".into(),
        backend: "none".into(),
    };
    let objects = Objects::new(["a", "b", "c"]);
    let mut frame = Frame::new(&film, samples.clone(), objects);
    let places: Vec<UVec2> = super::super::frame::pixels(film.window()).collect();
    for (index, place) in places.into_iter().enumerate() {
        let mut pixel = Pixel::default();
        for number in samples.clone() {
            let x = noise(place, number);
            let object = frame.objects().hash(number as usize % 3);
            let sample = CameraSample {
                radiance: if x < 0.05 {
                    Vec3::NAN
                } else {
                    Vec3::new(x, x * x, 9.0 * x)
                },
                first: (x > 0.3).then_some(FirstHit {
                    albedo: Vec3::splat(x),
                    normal: Vec3::new(x, 0.0, 1.0 - x),
                    position: Vec3::new(-x, 1e-3 * x, 1e6 * x),
                    texcoord: Vec2::new(x, 2.0 * x),
                    displacement: -0.1 * x,
                    object: 0,
                    prim: number,
                }),
                cost: (100.0 * x) as u32,
            };
            pixel.add(&sample, if number == 5 { -1 } else { 1 }, 3.0 * x, object);
        }
        frame.set_pixel(index, &pixel.ranked());
    }
    let mut info = FrameInfo::new(&film, samples, &source);
    info.partial = false;
    FrameFile { frame, info }
}

/// Files put together.
fn merged(files: &[(PathBuf, FrameFile)]) -> Result<Option<FrameFile>, FrameError> {
    let paths: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
    merge(&paths)
}

/// Through a file and back.
fn stored(folder: &TempDir, name: &str, file: &FrameFile) -> (PathBuf, FrameFile) {
    let path = folder.path().join(name);
    file.frame.write(&path, &file.info).unwrap();
    let read = FrameFile::read(&path).unwrap();
    (path, read)
}

/// The bits of all channels.
fn bits(folder: &TempDir, file: &FrameFile) -> Vec<(String, Vec<u32>)> {
    let (path, _) = stored(folder, "bits.exr", file);
    let mut channels: Vec<_> = read_exr(&path)
        .unwrap()
        .channels
        .into_iter()
        .map(|channel| match channel.samples {
            ExrSamples::F32(s) => (channel.name, s.into_iter().map(f32::to_bits).collect()),
            ExrSamples::U32(s) => (channel.name, s),
        })
        .collect();
    channels.sort();
    channels
}

const WHOLE: [u32; 4] = [0, 0, 7, 5];

#[test]
fn a_file_comes_back_with_windows_names_and_attributes() {
    let folder = tempfile::tempdir().unwrap();
    let part = rendered(&film(), [2, 1, 6, 4], 0..SPP);
    let (path, read) = stored(&folder, "part.exr", &part);
    assert_eq!(read.info, part.info);
    assert_eq!(bits(&folder, &read), bits(&folder, &part));
    let picture = read_exr(&path).unwrap();
    assert_eq!((picture.display, picture.position), ((7, 5), (2, 1)));
    assert_eq!((picture.width, picture.height), (4, 3));
    let value = |name: &str| {
        attribute(&path, &picture.attributes, name)
            .unwrap()
            .to_owned()
    };
    assert_eq!(value("prismarch/scene_hash"), "abc");
    assert_eq!(value("prismarch/parts"), "2,1,6,4 0..12");
    assert_eq!(value("prismarch/partial"), "false");
    assert_eq!(value("prismarch/version"), env!("CARGO_PKG_VERSION"));
    let manifest = value(&object_attribute("manifest"));
    assert!(manifest.starts_with("{\"a\":\""), "{manifest}");
    assert!(
        picture
            .channels
            .iter()
            .all(|channel| !channel.name.starts_with("sums."))
    );
}

#[test]
fn a_frame_with_samples_to_come_is_kept_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut some = rendered(&film(), WHOLE, 3..8);
    let (_, read) = stored(&folder, "some.exr", &some);
    assert!(read.frame.sums_are(&some.frame));
    some.info.partial = true;
    let (path, read) = stored(&folder, "partial.exr", &some);
    assert!(read.info.partial);
    assert!(matches!(
        merged(&[(path, read)]),
        Err(FrameError::Partial { .. })
    ));
}

#[test]
fn tiles_merged_are_the_whole_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let whole = rendered(&film(), WHOLE, 0..SPP);
    let tiles = [[0, 0, 3, 5], [3, 2, 7, 5], [3, 0, 7, 2]];
    let tiles = tiles.into_iter().enumerate().map(|(index, corners)| {
        stored(
            &folder,
            &format!("{index}.exr"),
            &rendered(&film(), corners, 0..SPP),
        )
    });
    let tiles: Vec<_> = tiles.collect();
    let merged = merged(&tiles).unwrap().unwrap();
    assert_eq!(merged.info, whole.info);
    assert_eq!(bits(&folder, &merged), bits(&folder, &whole));
}

#[test]
fn runs_of_samples_merged_are_the_whole_to_rounding() {
    let folder = tempfile::tempdir().unwrap();
    let whole = bits(&folder, &rendered(&film(), WHOLE, 0..SPP));
    for cuts in [vec![5, 6], vec![1], vec![3, 4, 9]] {
        let ends = cuts.iter().copied().chain([SPP]);
        let starts = [0].into_iter().chain(cuts.iter().copied());
        let mut runs: Vec<_> = starts
            .zip(ends)
            .map(|(start, end)| {
                let run = rendered(&film(), WHOLE, start..end);
                stored(&folder, &format!("{start}.exr"), &run)
            })
            .collect();
        runs.reverse();
        let merged = merged(&runs).unwrap().unwrap();
        assert_eq!(merged.info.parts.len(), 1);
        assert!(merged.info.is_final());
        let merged = bits(&folder, &merged);
        assert_eq!(merged.len(), whole.len());
        for ((name, merged), (_, whole)) in merged.iter().zip(&whole) {
            let integers =
                name == "prim" || name.starts_with("Crypto") || name.starts_with("samples");
            for (&m, &w) in merged.iter().zip(whole) {
                let [m_value, w_value] = [m, w].map(f32::from_bits);
                let near = (m_value - w_value).abs() <= 1e-6 * w_value.abs();
                assert!(m == w || !integers && near, "{name} {m_value} {w_value}");
            }
        }
    }
}

#[test]
fn more_samples_can_be_added_to_a_finished_picture() {
    let folder = tempfile::tempdir().unwrap();
    let few = Film { spp: 5, ..film() };
    let first = stored(&folder, "first.exr", &rendered(&few, WHOLE, 0..5));
    let rest = stored(&folder, "rest.exr", &rendered(&film(), WHOLE, 5..SPP));
    let merged = merged(&[rest, first]).unwrap().unwrap();
    let whole = rendered(&film(), WHOLE, 0..SPP);
    assert_eq!(merged.info, whole.info);
    for (merged, whole) in merged
        .frame
        .radiance()
        .into_iter()
        .zip(whole.frame.radiance())
    {
        assert!((merged - whole).abs().cmple(1e-6 * whole).all());
    }
}

#[test]
fn gaps_stay_gaps_and_can_be_filled_later() {
    let folder = tempfile::tempdir().unwrap();
    let tile = |corners, name: &str| stored(&folder, name, &rendered(&film(), corners, 0..SPP));
    let corners = vec![tile([0, 0, 2, 2], "a.exr"), tile([5, 3, 7, 5], "b.exr")];
    let gapped = merged(&corners).unwrap().unwrap();
    assert_eq!(gapped.info.parts.len(), 2);
    let gapped = stored(&folder, "gapped.exr", &gapped);
    assert_eq!(gapped.1.frame.radiance()[3], Vec3::ZERO);
    let rest = [
        ([2, 0, 7, 2], "c.exr"),
        ([0, 2, 5, 5], "d.exr"),
        ([5, 2, 7, 3], "e.exr"),
    ];
    let rest = rest.map(|(corners, name)| tile(corners, name));
    let files: Vec<_> = rest.into_iter().chain([gapped]).collect();
    let merged = merged(&files).unwrap().unwrap();
    let whole = rendered(&film(), WHOLE, 0..SPP);
    assert_eq!(bits(&folder, &merged), bits(&folder, &whole));
    assert_eq!(merged.info, whole.info);
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let left = rendered(&film(), [0, 0, 3, 5], 0..SPP);
    let right = rendered(&film(), [3, 0, 7, 5], 0..SPP);
    let folder = tempfile::tempdir().unwrap();
    let error = |left: &FrameFile, right: &FrameFile| {
        let files = [("left.exr", left), ("right.exr", right)];
        let files = files.map(|(name, file)| {
            let path = folder.path().join(name);
            file.frame.write(&path, &file.info).unwrap();
            path
        });
        merge(&files).unwrap_err().to_string()
    };
    for name in ["scene_hash", "version", "seed", "filter", "integrator"] {
        let mut odd = right.clone();
        odd.info
            .identity
            .iter_mut()
            .find(|(n, _)| n == name)
            .unwrap()
            .1 = "other".into();
        let error = error(&left, &odd);
        for word in ["left.exr", "right.exr", name, "found other"] {
            assert!(error.contains(word), "no {word}: {error}");
        }
    }
    let mut odd = right.clone();
    odd.info.size.x = 8;
    assert!(error(&left, &odd).contains("found 8x5; expected 7x5"));
    let other_aovs = Film {
        aovs: AovSet::NONE.with(Aov::Depth),
        ..film()
    };
    let odd = rendered(&other_aovs, [3, 0, 7, 5], 0..SPP);
    assert!(error(&left, &odd).contains("aovs: found Z"));
    let both = rendered(&film(), [2, 1, 7, 5], 4..6);
    let twice = error(&left, &both);
    assert!(
        twice.contains("samples 4..6 of the pixels 2,1,3,5"),
        "{twice}"
    );
    assert!(merge(&[]).unwrap().is_none());
    let part = |start, samples| Part {
        window: window(start),
        samples,
    };
    assert_eq!(part(WHOLE, 0..4).intersection(&part(WHOLE, 4..8)), None);
}

#[test]
fn broken_files_are_refused_and_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let (path, _) = stored(&folder, "a.exr", &rendered(&film(), WHOLE, 0..4));
    let bytes = std::fs::read(&path).unwrap();
    for length in (0..bytes.len()).step_by(bytes.len() / 60) {
        std::fs::write(&path, &bytes[..length]).unwrap();
        let error = FrameFile::read(&path).unwrap_err().to_string();
        assert!(error.contains("a.exr"), "{length}: {error}");
    }
    // A picture of something else.
    crate::image::write_exr(
        &path,
        1,
        1,
        ExrChannel::rgb(None, &[[1.0; 3]]).to_vec(),
        &[],
    )
    .unwrap();
    assert!(matches!(
        FrameFile::read(&path),
        Err(FrameError::NotAFrame { .. })
    ));
    // A count that is none, and one of more samples than there are.
    let good = rendered(&film(), WHOLE, 0..SPP);
    for count in [0.5, -1.0, f32::NAN, 1e30, 13.0] {
        good.frame.write(&path, &good.info).unwrap();
        let mut picture = read_exr(&path).unwrap();
        let counts = picture
            .channels
            .iter_mut()
            .find(|c| c.name == "samples.count");
        let ExrSamples::F32(samples) = &mut counts.unwrap().samples else {
            panic!("counts are floats")
        };
        samples[9] = count;
        write_exr_picture(&path, picture).unwrap();
        let error = FrameFile::read(&path).unwrap_err().to_string();
        assert!(
            error.contains("samples.count") && error.contains("(2, 3)"),
            "{error}"
        );
    }
}
