//! Small files that claim large pictures and meshes, under a limit of memory: each is refused in one sentence, none ends the program.

mod program;

use program::{Folder, QUAD, stderr};

/// The deflated zeros of a PNG's or EXR's pixels: a stored block of none.
const NOTHING: [u8; 11] = [0x78, 1, 1, 0, 0, 0xff, 0xff, 0, 0, 0, 1];

/// Runs `query` on a mesh and a map under a limit of so many KB of address space.
#[cfg(unix)]
fn query(folder: &Folder, [mesh, map]: [&str; 2], limit: u64) -> std::process::Output {
    let arguments = "query --scale 1 --rays rays.csv --backend bvh --threads 1 --mesh";
    let arguments: Vec<&str> = arguments.split(' ').chain([mesh, "--map", map]).collect();
    folder.run_in_memory(limit, &arguments)
}

fn folder() -> Folder {
    let folder = Folder::with_quad();
    folder.put("quad.obj", QUAD);
    folder.put("rays.csv", "ox,oy,oz,dx,dy,dz\n0,0,5,0,0,-1\n");
    folder
}

/// What a sound map needs, and what is granted besides.
#[cfg(unix)]
fn limit(folder: &Folder) -> u64 {
    let needs = |limit| query(folder, ["quad.obj", "flat.png"], limit).status.code() == Some(0);
    let mut limit = 16 << 10;
    while !needs(limit) {
        limit += 16 << 10;
        assert!(limit < 4 << 20, "a map of 8 x 8 texels needs 4 GB");
    }
    limit + (64 << 10)
}

fn png(width: u32, height: u32, interlaced: u8) -> Vec<u8> {
    let chunk = |name: &[u8], data: &[u8]| {
        let body = [name, data].concat();
        let length = (data.len() as u32).to_be_bytes();
        [&length[..], &body, &crc32fast::hash(&body).to_be_bytes()].concat()
    };
    let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
    let header = [&size[..], &[16, 6, 0, 0, interlaced]].concat();
    let chunks = [
        chunk(b"IHDR", &header),
        chunk(b"IDAT", &NOTHING),
        chunk(b"IEND", &[]),
    ];
    [&b"\x89PNG\r\n\x1a\n"[..], &chunks.concat()].concat()
}

/// A baseline frame of one component, a scan of a few bits, an end.
fn jpeg() -> Vec<u8> {
    let table = |class: u8| [&[0xff, 0xc4, 0, 20, class, 1][..], &[0; 15], &[0]].concat();
    let frame = [0xff, 0xc0, 0, 11, 8, 0x1f, 0xfe, 0xff, 0xdc, 1, 1, 0x11, 0];
    let scan = [0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0, 0, 0, 0, 0xff, 0xd9];
    [&[0xff, 0xd8][..], &frame, &table(0), &table(0x10), &scan].concat()
}

/// A row of floats `width` wide and its display window, in one block of a few bytes.
fn exr(compression: u8, width: u32, display: u32, block: &[u8]) -> Vec<u8> {
    let attribute = |name: &str, kind: &str, value: &[u8]| {
        let length = (value.len() as u32).to_le_bytes();
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
    let window = |width: u32| [&[0; 8], &(width - 1).to_le_bytes()[..], &[0; 4]].concat();
    let channel = [&b"Y\0\x02\0\0\0\0\0\0\0"[..], &[1, 0, 0, 0, 1, 0, 0, 0, 0]].concat();
    let mut file = b"\x76\x2f\x31\x01\x02\0\0\0".to_vec();
    for (name, kind, value) in [
        ("channels", "chlist", &channel[..]),
        ("compression", "compression", &[compression]),
        ("dataWindow", "box2i", &window(width)),
        ("displayWindow", "box2i", &window(display)),
        ("lineOrder", "lineOrder", &[0]),
        ("pixelAspectRatio", "float", &1f32.to_le_bytes()),
        ("screenWindowCenter", "v2f", &[0; 8]),
        ("screenWindowWidth", "float", &1f32.to_le_bytes()),
    ] {
        file.extend(attribute(name, kind, value));
    }
    file.push(0);
    let start = file.len() as u64 + 8;
    file.extend(start.to_le_bytes());
    file.extend([0; 4]);
    file.extend((block.len() as u32).to_le_bytes());
    file.extend(block);
    file
}

/// A DWA block whose count number `place` is that large.
fn dwa(place: usize, count: u64) -> Vec<u8> {
    let mut counts = [2, 0, 0, 0, 20, 0, 0, 0, 0, 1, 0];
    counts[place] = count;
    let counts = counts.iter().flat_map(|count: &u64| count.to_le_bytes());
    counts.chain([0; 20]).collect()
}

fn webp(name: &[u8; 4], picture: &[u8]) -> Vec<u8> {
    let chunk = [name, &(picture.len() as u32).to_le_bytes()[..], picture].concat();
    let length = (chunk.len() as u32 + 4).to_le_bytes();
    [&b"RIFF"[..], &length, b"WEBP", &chunk].concat()
}

fn hostile() -> Vec<(String, Vec<u8>)> {
    const WIDE: u32 = 1 << 29;
    let bmp = [
        &b"BM\x64\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x20\x4e\0\0\x20\x4e\0\0\x01\0\x18\0"[..],
        &[0; 60],
    ];
    let tga = [
        &[
            0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x20, 0x4e, 0x20, 0x4e, 32, 0,
        ][..],
        &[0; 60],
    ];
    let lossy = [
        &[0x10, 0, 0, 0x9d, 1, 0x2a, 0xff, 0x3f, 0xff, 0x3f][..],
        &[0; 60],
    ];
    let mut files = vec![
        ("large.png".to_owned(), png(32_768, 16_384, 0)),
        ("interlaced.png".to_owned(), png(32_768, 16_384, 1)),
        ("wide.png".to_owned(), png(WIDE, 1, 0)),
        ("claim.jpg".to_owned(), jpeg()),
        (
            "flat.hdr".to_owned(),
            b"#?RADIANCE\n\n-Y 16384 +X 32767\n\x02\x02\x7f\xff\x09".to_vec(),
        ),
        (
            "old.hdr".to_owned(),
            b"#?RADIANCE\n\n-Y 1 +X 536870912\n\x09\x09\x09\x09\x01\x01\x01\xff".to_vec(),
        ),
        (
            "text.pgm".to_owned(),
            b"P2 32768 16384 65535\n1 2 3".to_vec(),
        ),
        (
            "claim.ppm".to_owned(),
            b"P6 16384 16384 255\n1 2 3".to_vec(),
        ),
        ("claim.pbm".to_owned(), b"P4 536870912 1\n1 2 3".to_vec()),
        ("claim.pfm".to_owned(), b"Pf 32768 16384 -1\n1 2 3".to_vec()),
        ("claim.bmp".to_owned(), bmp.concat()),
        ("claim.tga".to_owned(), tga.concat()),
        ("claim.webp".to_owned(), webp(b"VP8 ", &lossy.concat())),
        ("display.exr".to_owned(), exr(0, 1, WIDE, &[0; 4])),
    ];
    for compression in 0..10 {
        let block = exr(compression, WIDE, WIDE, &NOTHING);
        files.push((format!("wide{compression}.exr"), block));
    }
    for place in 1..10 {
        for bits in [28, 40, 60, 62, 63] {
            let block = exr(8, 8, 8, &dwa(place, 1 << bits));
            files.push((format!("dwa{place}_{bits}.exr"), block));
        }
    }
    files
}

#[cfg(unix)]
#[test]
fn small_files_that_claim_large_pictures_are_refused_in_little_memory() {
    let folder = folder();
    let limit = limit(&folder);
    for (name, bytes) in hostile() {
        folder.put(&name, &bytes);
        refused(&name, &query(&folder, ["quad.obj", &name], limit));
    }
}

#[cfg(unix)]
#[track_caller]
fn refused(name: &str, output: &std::process::Output) {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(3), "{name}: {said}");
    assert!(
        said.contains(name) && !said.contains("panicked"),
        "{name}: {said}"
    );
    assert_eq!(said.trim_end().lines().count(), 1, "{name}: {said}");
}

/// A glTF triangle, with something of its document replaced.
fn gltf(from: &str, to: &str) -> Vec<u8> {
    let document = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    assert!(document.contains(from), "{from}");
    document.replace(from, to).into_bytes()
}

#[cfg(unix)]
#[test]
fn small_files_that_claim_large_meshes_are_refused_in_little_memory() {
    let folder = folder();
    let limit = limit(&folder);
    let vertices =
        "element vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n";
    let one = vertices.replace("4000000000", "1");
    let ply = |format: &str, elements: &[&str], body: &[u8]| {
        let header = format!(
            "ply\nformat {format} 1.0\n{}end_header\n",
            elements.concat()
        );
        [header.as_bytes(), body].concat()
    };
    let faces = "element face 1\nproperty list uint int vertex_indices\n";
    let view = r#"{"buffer":0,"byteLength":36}"#;
    let meshopt = format!(
        r#"{{"buffer":0,"byteLength":36,"extensions":{{"EXT_meshopt_compression":{{"buffer":0,"byteLength":36,"byteStride":12,
        "count":{},"mode":"ATTRIBUTES"}}}}}}"#,
        u32::MAX
    );
    let files = [
        ("text.ply", ply("ascii", &[vertices], b"0 0 0\n")),
        (
            "binary.ply",
            ply("binary_little_endian", &[vertices], &[0; 36]),
        ),
        (
            "list.ply",
            ply(
                "binary_little_endian",
                &[&one, faces],
                &[[0; 12], [0xee; 12]].concat(),
            ),
        ),
        ("count.gltf", gltf("\"count\":3", "\"count\":4294967295")),
        (
            "zeros.gltf",
            gltf(
                "\"bufferView\":0,\"componentType\":5126,\"count\":3",
                "\"componentType\":5126,\"count\":4294967295",
            ),
        ),
        (
            "buffer.gltf",
            gltf(
                "\"buffers\":[{\"byteLength\":36",
                "\"buffers\":[{\"byteLength\":4294967295",
            ),
        ),
        ("meshopt.gltf", gltf(view, &meshopt)),
        (
            "sparse.gltf",
            gltf(
                "\"count\":3",
                r#""count":3,"sparse":{"count":4294967295,"indices":{"bufferView":0,"componentType":5125},"values":{"bufferView":0}}"#,
            ),
        ),
    ];
    for (name, bytes) in files {
        folder.put(name, &bytes);
        refused(name, &query(&folder, [name, "flat.png"], limit));
    }
}

#[cfg(unix)]
#[test]
fn a_library_is_in_memory_once_however_often_it_is_named() {
    let folder = folder();
    let library: String = (0..20_000)
        .map(|i| format!("newmtl m{i}\nKd 0.5 0.5 0.5\n"))
        .collect();
    folder.put("lib.mtl", &library);
    folder.put("often.obj", "mtllib lib.mtl\n".repeat(400) + QUAD);
    let output = query(&folder, ["often.obj", "flat.png"], limit(&folder));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}
