use std::path::PathBuf;

use exr::image::{Blocks, Levels};
use exr::math::RoundingMode;
use exr::meta::attribute::{IntegerBounds, LineOrder};
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image, ImageAttributes, Layer,
    LayerAttributes, WritableImage,
};

use super::*;
use crate::image::heights::read_texels;
use crate::image::test_files::{Folder, each_tenth};
use crate::image::{
    Channel, ColorPixels, ColorSpace, ExrChannel, load_color, load_environment, write_exr_picture,
};
use crate::surface::Texels;

/// Size and heights, rows from the bottom.
fn heights(path: &Path, channel: &str) -> Result<(usize, usize, Vec<f32>), ImageError> {
    let Ok(channel) = channel.parse::<Channel>();
    match read_texels(path.into(), &channel, None)? {
        (width, height, Texels::F32(texels)) => Ok((width, height, texels)),
        _ => panic!("EXR is float"),
    }
}

fn refused(path: &Path, channel: &str) -> String {
    heights(path, channel).unwrap_err().to_string()
}

/// A grey picture with its data window in a display window from (0, 0).
fn windowed(
    folder: &Folder,
    display: (usize, usize),
    position: (i32, i32),
    (width, height): (usize, usize),
) -> PathBuf {
    let path = folder.path("window.exr");
    // 1 + column + 10 row, counted from the bottom left of the data window.
    let samples = (0..width * height).map(|i| (1 + i % width + 10 * (i / width)) as f32);
    let picture = ExrPicture {
        display,
        position,
        width,
        height,
        channels: vec![ExrChannel::floats("Y", samples.collect())],
        attributes: Vec::new(),
    };
    write_exr_picture(&path, picture).unwrap();
    path
}

#[test]
fn pictures_are_of_the_display_window_s_size() {
    let folder = Folder::new();
    let read = |display, position, size| {
        let (width, height, texels) = heights(&windowed(&folder, display, position, size), "Y")?;
        assert_eq!((width, height), display);
        Ok::<_, ImageError>(texels)
    };
    // Inside: rows and columns without data are 0.
    assert_eq!(
        read((4, 3), (1, 1), (2, 1)).unwrap(),
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    );
    assert_eq!(read((2, 2), (0, 1), (2, 1)).unwrap(), [1.0, 2.0, 0.0, 0.0]);
    // Overscan is cut off.
    assert_eq!(read((2, 1), (-1, -1), (4, 3)).unwrap(), [12.0, 13.0]);
    // Partly beside, and wholly.
    assert_eq!(read((2, 2), (1, -1), (2, 2)).unwrap(), [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(read((2, 2), (50, 50), (2, 2)).unwrap(), [0.0; 4]);
    // So much of nothing is made, and no more.
    assert_eq!(read((2048, 1024), (0, 0), (2, 2)).unwrap().len(), 1 << 21);
    let far = read((2048, 1025), (0, 0), (2, 2)).unwrap_err().to_string();
    assert!(far.contains("display window of 2048x1025"), "{far}");
}

#[test]
fn colours_and_environments_have_the_display_window_too() {
    let folder = Folder::new();
    let path = windowed(&folder, (2, 2), (1, 0), (1, 1));
    let image = load_color(&path, ColorSpace::Linear).unwrap();
    let ColorPixels::Linear(pixels) = image.pixels else {
        panic!("EXR is linear")
    };
    assert_eq!(pixels, [[0.0; 3], [0.0; 3], [0.0; 3], [1.0; 3]]);
    let sky = load_environment(&path).unwrap();
    assert_eq!((sky.width, sky.height, sky.pixels[1].x), (2, 2, 1.0));
    // Our own parts of pictures keep their place.
    let part = read_exr(&path).unwrap();
    assert_eq!((part.position, part.width, part.height), ((1, 0), 1, 1));
}

#[test]
fn each_channel_is_read_from_its_own_part() {
    let folder = Folder::new();
    let plane = |value: f32| FlatSamples::F32(vec![value; 4]);
    let part = |name: &'static str, value| (Some(name), vec![("x", plane(value))]);
    let parts = vec![part("R", 0.25), part("G", 0.5), part("B", 0.75)];
    let path = folder.exr((2, 2), Compression::ZIP1, parts);
    assert_eq!(heights(&path, "G.x").unwrap().2, [0.5; 4]);
    let layer = |name: &'static str, channel, value| (Some(name), vec![(channel, plane(value))]);
    let parts = vec![
        layer("a", "R", 0.25),
        layer("b", "G", 0.5),
        layer("c", "B", 0.75),
    ];
    let path = folder.exr((2, 2), Compression::PIZ, parts);
    let image = load_color(&path, ColorSpace::Linear).unwrap();
    assert_eq!(image.pixel(1, 1).to_array(), [0.25, 0.5, 0.75]);
}

/// A mip-mapped picture in tiles; every level of half of it.
fn tiled(folder: &Folder, levels: bool) -> PathBuf {
    let path = folder.path("tiles.exr");
    let plane = |width: usize, height: usize| {
        FlatSamples::F32((0..width * height).map(|i| i as f32).collect())
    };
    let samples = match levels {
        false => Levels::Singular(plane(37, 21)),
        true => Levels::Mip {
            rounding_mode: RoundingMode::Down,
            level_data: [(37, 21), (18, 10), (9, 5), (4, 2), (2, 1), (1, 1)]
                .map(|(w, h)| plane(w, h))
                .to_vec(),
        },
    };
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::Tiles(exr::math::Vec2(16, 8)),
        line_order: LineOrder::Increasing,
    };
    let channels = AnyChannels::sort([AnyChannel::new("Y", samples)].into_iter().collect());
    let layer = Layer::new((37, 21), LayerAttributes::default(), encoding, channels);
    let window = ImageAttributes::new(IntegerBounds::from_dimensions((37, 21)));
    let image = Image {
        attributes: window,
        layer_data: layer,
    };
    image.write().to_file(&path).unwrap();
    path
}

#[test]
fn tiles_are_read_at_full_resolution() {
    let folder = Folder::new();
    for levels in [false, true] {
        let (width, height, texels) = heights(&tiled(&folder, levels), "Y").unwrap();
        assert_eq!((width, height), (37, 21));
        for y in 0..21 {
            for x in 0..37 {
                assert_eq!(texels[(20 - y) * 37 + x], (y * 37 + x) as f32);
            }
        }
    }
    each_tenth(&tiled(&folder, false), |path| heights(path, "Y"));
}

/// A file of rows of 1, whose table of blocks starts at the second value.
fn rows(folder: &Folder) -> (Vec<u8>, usize) {
    let samples = FlatSamples::F32((0..64).map(|i| (i % 7) as f32).collect());
    let layer = (None, vec![("Y", samples)]);
    let path = folder.exr((8, 8), Compression::Uncompressed, vec![layer]);
    let bytes = std::fs::read(path).unwrap();
    // Eight rows of eight floats, each led by its row and size, stand behind eight addresses.
    let table = bytes.len() - 8 * (8 + 8 + 32);
    (bytes, table)
}

#[test]
fn rows_that_come_twice_or_not_at_all_are_damage() {
    let folder = Folder::new();
    let (whole, table) = rows(&folder);
    let path = folder.path("rows.exr");
    std::fs::write(&path, &whole).unwrap();
    heights(&path, "Y").unwrap();
    // The second row's address is the first's, none at all, and one behind the end.
    for address in [&whole[table..table + 8], &[0; 8], &[0xff; 8]] {
        let mut bytes = whole.clone();
        bytes[table + 8..table + 16].copy_from_slice(address);
        std::fs::write(&path, &bytes).unwrap();
        let reason = refused(&path, "Y");
        assert!(
            reason.contains("table") || reason.contains("truncated"),
            "{reason}"
        );
    }
    // The second row says that it is the first, or the ninth.
    for row in [0, 8, -1] {
        let mut bytes = whole.clone();
        let chunk = table + 64 + 40;
        bytes[chunk..chunk + 4].copy_from_slice(&i32::to_le_bytes(row));
        std::fs::write(&path, &bytes).unwrap();
        assert!(refused(&path, "Y").contains("table"));
    }
}

/// Compressions by their number in the file.
const COMPRESSIONS: [Compression; 10] = [
    Compression::Uncompressed,
    Compression::RLE,
    Compression::ZIP1,
    Compression::ZIP16,
    Compression::PIZ,
    Compression::PXR24,
    Compression::B44,
    Compression::B44A,
    Compression::DWAA(None),
    Compression::DWAB(None),
];

/// Luminance at every pixel, chroma at every second one of every second row, in compression number `compression`.
fn luminance_chroma(
    path: &Path,
    (width, height): (usize, usize),
    pixel: [f32; 3],
    compression: u8,
) {
    let attribute = |name: &str, kind: &str, value: &[u8]| {
        let length = (value.len() as i32).to_le_bytes();
        [
            name.as_bytes(),
            b"\0",
            kind.as_bytes(),
            b"\0",
            &length,
            value,
        ]
        .concat()
    };
    let channel = |name: &str, sampling: i32| {
        let s = sampling.to_le_bytes();
        [name.as_bytes(), b"\0", &2i32.to_le_bytes(), &[0; 4], &s, &s].concat()
    };
    let channels = [channel("BY", 2), channel("RY", 2), channel("Y", 1), vec![0]].concat();
    let corner = [width - 1, height - 1].map(|side| (side as i32).to_le_bytes());
    let window = [&[0; 8], corner.as_flattened()].concat();
    let mut file = b"\x76\x2f\x31\x01\x02\0\0\0".to_vec();
    for (name, kind, value) in [
        ("channels", "chlist", &channels[..]),
        ("compression", "compression", &[compression]),
        ("dataWindow", "box2i", &window),
        ("displayWindow", "box2i", &window),
        ("lineOrder", "lineOrder", &[0]),
        ("pixelAspectRatio", "float", &1f32.to_le_bytes()),
        ("screenWindowCenter", "v2f", &[0; 8]),
        ("screenWindowWidth", "float", &1f32.to_le_bytes()),
    ] {
        file.extend(attribute(name, kind, value));
    }
    file.push(0);
    let [r, g, b] = pixel;
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let row = |line: usize| {
        let chroma = if line.is_multiple_of(2) { width / 2 } else { 0 };
        let blue = std::iter::repeat_n((b - y) / y, chroma);
        let red = std::iter::repeat_n((r - y) / y, chroma);
        let samples = blue.chain(red).chain(std::iter::repeat_n(y, width));
        samples.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()
    };
    let mut header = MetaData::read_from_buffered(&file[..], true)
        .unwrap()
        .headers[0]
        .clone();
    let compression = COMPRESSIONS[usize::from(compression)];
    let lines = compression.scan_lines_per_block();
    let mut block = |first: usize| {
        let rows = lines.min(height - first);
        let samples: Vec<u8> = (first..first + rows).flat_map(row).collect();
        // The crate does not know that these channels have fewer samples.
        header.channels.bytes_per_pixel = samples.len() / (width * rows);
        let place = IntegerBounds::new((0, first as i32), (width, rows));
        let coded = compression
            .compress_image_section_to_le(&header, samples, place)
            .unwrap();
        let leader = [first as i32, coded.len() as i32].map(i32::to_le_bytes);
        [leader.as_flattened(), &coded].concat()
    };
    let blocks: Vec<Vec<u8>> = (0..height).step_by(lines).map(&mut block).collect();
    let mut start = file.len() + 8 * blocks.len();
    for block in &blocks {
        file.extend((start as u64).to_le_bytes());
        start += block.len();
    }
    file.extend(blocks.concat());
    std::fs::write(path, file).unwrap();
}

#[test]
fn luminance_and_chroma_are_height_and_colour() {
    let folder = Folder::new();
    let path = folder.path("chroma.exr");
    let pixel = [0.5, 0.25, 0.75];
    let y = 0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2];
    for (compression, name) in COMPRESSIONS.iter().enumerate() {
        // The crate does not write fewer samples in these.
        if matches!(
            name,
            Compression::PXR24 | Compression::B44 | Compression::B44A
        ) {
            continue;
        }
        luminance_chroma(&path, (18, 38), pixel, compression as u8);
        let (width, height, texels) = heights(&path, "luminance").unwrap();
        assert_eq!((width, height), (18, 38));
        assert!(
            texels.iter().all(|t| (t - y).abs() < 1e-3),
            "{name}: {texels:?}"
        );
        let image = load_color(&path, ColorSpace::Linear).unwrap();
        for (x, y) in [(0, 0), (17, 37), (3, 2), (8, 17)] {
            let found = image.pixel(x, y);
            let off = (found - glam::Vec3::from(pixel)).length();
            assert!(off < 0.01, "{name}: {found}");
        }
        each_tenth(&path, |path| heights(path, "Y"));
    }
    assert!(refused(&path, "RY").contains("RY"));
    // Luminance is not the red of such a picture.
    assert!(refused(&path, "r").contains("no channel"));
    // Sides that two does not divide.
    luminance_chroma(&path, (5, 4), pixel, 0);
    assert!(refused(&path, "luminance").contains("2 x 2"));
}

#[test]
fn integers_of_our_own_files_stay_integers() {
    let folder = Folder::new();
    let samples = FlatSamples::U32(vec![1, 2, 3, u32::MAX]);
    let path = folder.exr(
        (2, 2),
        Compression::PIZ,
        vec![(None, vec![("id", samples)])],
    );
    let picture = read_exr(&path).unwrap();
    assert_eq!(
        picture.channels[0].samples,
        ExrSamples::U32(vec![3, u32::MAX, 1, 2])
    );
}
