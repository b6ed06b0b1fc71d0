use super::super::tests::load_bytes;
use super::*;

const PROPERTIES: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\n\
    property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty float s\nproperty float t\n\
    element face 1\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";

/// (x, y, z) of a square, with its normal along z and s = x, t = y.
const SQUARE: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

fn ascii() -> Vec<u8> {
    let mut text = format!("ply\nformat ascii 1.0\n{PROPERTIES}");
    for [x, y] in SQUARE {
        text += &format!("{x} {y} 0 0 0 1 255 {x} {y}\n");
    }
    text += "7 4 0 1 2 3\n";
    text.into_bytes()
}

fn binary(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut bytes = format!("ply\nformat binary_{order}_endian 1.0\n{PROPERTIES}").into_bytes();
    let mut put = |mut value: Vec<u8>| {
        // Given in big endian.
        if !big {
            value.reverse();
        }
        bytes.extend(value);
    };
    for [x, y] in SQUARE {
        put(x.to_be_bytes().into());
        put(f64::from(y).to_be_bytes().into());
        for value in [0.0_f32, 0.0, 0.0, 1.0] {
            put(value.to_be_bytes().into());
        }
        put(vec![255]);
        put(x.to_be_bytes().into());
        put(y.to_be_bytes().into());
    }
    put(vec![7]);
    put(vec![4]);
    for index in 0..4_i32 {
        put(index.to_be_bytes().into());
    }
    bytes
}

#[test]
fn the_three_encodings_give_the_same_mesh() {
    for bytes in [ascii(), binary(false), binary(true)] {
        let file = load_bytes("m.ply", &bytes).unwrap();
        let mesh = &file.parts[0].mesh;
        let corners = SQUARE.map(Vec2::from);
        assert_eq!(mesh.positions, corners.map(|p| p.extend(0.0)));
        assert_eq!(mesh.texcoords, corners);
        assert_eq!(mesh.normals, [Vec3::Z; 4]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    }
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    for bytes in [ascii(), binary(false), binary(true)] {
        // Without its last line break the text is still whole.
        for length in 0..bytes.len() - 1 {
            assert!(load_bytes("m.ply", &bytes[..length]).is_err(), "{length}");
        }
    }
}

fn replaced(from: &str, to: &str) -> LoadMeshErrorKind {
    let text = String::from_utf8(ascii()).unwrap().replace(from, to);
    load_bytes("m.ply", text.as_bytes()).unwrap_err().kind
}

#[test]
fn counts_beyond_the_file_are_refused_at_once() {
    for count in ["4000000000", "18446744073709551615"] {
        let kind = replaced("element vertex 4", &format!("element vertex {count}"));
        assert!(kind.to_string().contains(count), "{kind}");
        let empty = format!("element nothing {count}\nend_header");
        assert!(
            replaced("end_header", &empty)
                .to_string()
                .contains("nothing")
        );
    }
    assert!(matches!(
        replaced("7 4 0", "7 4000000000 0"),
        LoadMeshErrorKind::Malformed { .. }
    ));
}

#[test]
fn indices_out_of_range_name_the_face() {
    for index in [4_i64, -1] {
        let kind = replaced("7 4 0 1 2 3", &format!("7 4 0 1 2 {index}"));
        assert!(
            matches!(&kind, LoadMeshErrorKind::IndexOutOfRange { place, index: i, .. }
                if place == "face 0" && *i == index),
            "{kind:?}"
        );
    }
}

#[test]
fn headers_without_what_is_needed_are_refused() {
    for (from, to) in [
        ("property double y\n", ""),
        ("property list uchar int vertex", "property int vertex"),
        (
            "property list uchar int vertex",
            "property list uchar float vertex",
        ),
        ("format ascii 1.0\n", ""),
        ("ply\n", "plx\n"),
    ] {
        let kind = replaced(from, to);
        assert!(
            matches!(kind, LoadMeshErrorKind::Malformed { .. }),
            "{to:?}: {kind:?}"
        );
    }
    let points = replaced("vertex_indices", "something_else");
    assert!(matches!(points, LoadMeshErrorKind::NoFaces));
}

/// A text file of one square, with further properties and elements.
fn square(vertex: &str, values: [&str; 4], faces: &str) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{vertex}"
    );
    text += faces;
    let (header, body) = text.split_once("end_header\n").unwrap();
    let rows: String = SQUARE
        .iter()
        .zip(values)
        .map(|([x, y], more)| format!("{x} {y} 0 {more}\n"))
        .collect();
    format!("{header}end_header\n{rows}{body}")
}

fn load(text: &str) -> LoadedFile {
    load_bytes("m.ply", text.as_bytes()).unwrap()
}

#[test]
fn texture_coordinates_of_vertices_go_by_many_names() {
    let faces = "element face 1\nproperty list uchar uint vertex_index\nend_header\n4 0 1 2 3\n";
    for names in [
        ["s", "t"],
        ["u", "v"],
        ["texture_u", "texture_v"],
        ["s0", "t0"],
        ["u0", "v0"],
    ] {
        // The pair may stand beside a lone name of another pair.
        let properties = format!(
            "property float u1\nproperty double {}\nproperty float {}\n",
            names[1], names[0]
        );
        let file = load(&square(
            &properties,
            ["9 0 1", "9 0 2", "9 3 2", "9 3 1"],
            faces,
        ));
        let expected = [[1.0, 0.0], [2.0, 0.0], [2.0, 3.0], [1.0, 3.0]].map(Vec2::from);
        assert_eq!(file.parts[0].mesh.texcoords, expected);
        assert!(file.warnings.is_empty(), "{:?}", file.warnings);
    }
}

#[test]
fn texture_coordinates_of_faces_part_vertices_where_they_differ() {
    let faces = "element face 3\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n\
        3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0 0 1 1 0 1\n3 1 2 3 6 .5 0 1 1 0 1\n";
    let file = load(&square("", [""; 4], faces));
    let mesh = &file.parts[0].mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 2, 3]]);
    assert_eq!(mesh.positions[4], mesh.positions[1]);
    assert_eq!(mesh.texcoords[4], Vec2::new(0.5, 0.0));
    let mixed = faces.replace("6 .5 0 1 1 0 1", "0");
    let file = load(&square("", [""; 4], &mixed));
    assert_eq!(file.parts.len(), 2);
    assert!(file.parts[1].mesh.texcoords.is_empty());
    let odd = square("", [""; 4], &faces.replace("6 .5 0 1 1 0 1", "4 .5 0 1 1"));
    let error = load_bytes("m.ply", odd.as_bytes()).unwrap_err().to_string();
    assert!(
        error.contains("line 17: face 2") && error.contains("4 numbers"),
        "{error}"
    );
}

#[test]
fn the_pictures_of_meshlab_part_the_faces() {
    let faces = "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n\
        end_header\n3 0 1 2 6 0 0 1 0 1 1 1\n3 0 2 3 6 0 0 1 1 0 1 0\n";
    let text = square("", [""; 4], faces).replace(
        "element vertex",
        "comment TextureFile a b.png\ncomment TextureFile c.png\nelement vertex",
    );
    let file = load(&text);
    let names: Vec<_> = file
        .parts
        .iter()
        .map(|p| &p.material.as_ref().unwrap().name[..])
        .collect();
    assert_eq!(names, ["c.png", "a b.png"]);
    let texture = file.parts[1]
        .material
        .as_ref()
        .unwrap()
        .base_color
        .texture
        .clone();
    assert!(matches!(texture.unwrap().source, FileTexture::Path(p) if p.ends_with("a b.png")));
    let plain = "element face 1\nproperty list uchar int vertex_indices\nend_header\n4 0 1 2 3\n";
    let plain = square("", [""; 4], plain).replace(
        "element vertex",
        "comment TextureFile a.png\nelement vertex",
    );
    let unused = load(&plain).unused.to_string();
    assert!(unused.contains("1 texture (no texture"), "{unused}");
}

#[test]
fn strips_alternate_and_begin_anew_behind_minus_one() {
    let strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n9 0 1 3 2 -1 0 1 1 2\n";
    let mesh = load(&square("", [""; 4], strips)).parts.remove(0).mesh;
    assert_eq!(mesh.triangles, [[0, 1, 3], [3, 1, 2]]);
    // All of them wind as the square does.
    let up = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).z > 0.0
    };
    assert!(mesh.triangles.iter().all(up));
}

#[test]
fn concave_polygons_are_cut_inside() {
    let faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n4 1 2 3 0\n";
    let text = square("", [""; 4], faces).replace("1 1 0 \n", "0.2 0.2 0\n");
    assert_eq!(load(&text).parts[0].mesh.triangles, [[1, 2, 0], [2, 3, 0]]);
}

#[test]
fn what_is_left_out_is_told() {
    let faces = "element face 3\nproperty list uchar int vertex_indices\nproperty int material_index\nelement edge 1\n\
        property int vertex1\nproperty int vertex2\nend_header\n4 0 1 2 3 0\n2 0 1 0\n0 0\n0 1\n";
    let properties = "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\nproperty float ny\nproperty float nz\n";
    let values = ["1 2 3 0 0 1", "1 2 3 0 nan 1", "1 2 3 0 0 1", "1 2 3 0 0 1"];
    let file = load(&square(properties, values, faces));
    assert_eq!(
        file.unused.to_string(),
        "no effect: vertex.red, vertex.green, vertex.blue, face.material_index, 1 element edge, 2 faces of fewer than three corners"
    );
    assert!(matches!(&file.warnings[..], [normals] if normals.contains("normals")));
    assert_eq!(file.parts[0].mesh.normals[1], Vec3::ZERO);
}

#[test]
fn headers_of_the_wild_are_read() {
    let faces =
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n\n4 0 1 2 3\n\n";
    // CloudCompare's names, a property twice, numbers without a digit on either side of the point.
    let properties =
        "property float scalar_Scalar_field_#2\nproperty float x\nproperty float my value (m)\n";
    let text = square(
        properties,
        [".5 7 1.", "-.5 7 1.e3", "+1 7 nan", "0 7 -inf"],
        faces,
    );
    let latin = text.replace(
        "element vertex",
        "comment caf@ \nobj_info made by @\ncomment\nelement vertex",
    );
    let latin: Vec<u8> = latin
        .bytes()
        .map(|b| if b == b'@' { 0xe9 } else { b })
        .collect();
    let ends = |end: &str| text.replace('\n', end).into_bytes();
    for bytes in [ends("\n"), ends("\r\n"), ends("\r"), latin] {
        let file = load_bytes("m.ply", &bytes).unwrap();
        let corners = SQUARE.map(|p| Vec2::from(p).extend(0.0));
        assert_eq!(file.parts[0].mesh.positions, corners);
    }
}

#[test]
fn the_end_of_the_header_is_not_mistaken() {
    // The first number's first byte is that of a line's end.
    for (end, first) in [
        ("\n", b'\n'),
        ("\r\n", b'\n'),
        ("\r", b'\n'),
        ("\r\n", b'\r'),
        ("\r", b'\r'),
    ] {
        let header =
            format!("ply\nformat binary_little_endian 1.0\n{PROPERTIES}").replace('\n', end);
        let mut bytes = header.into_bytes();
        let x = f32::from_le_bytes([first, 0, 0, 0x3f]);
        let start = bytes.len();
        let from = binary(false);
        bytes.extend_from_slice(&from[from.len() - (4 * 37 + 18)..]);
        bytes[start..start + 4].copy_from_slice(&x.to_le_bytes());
        let file = load_bytes("m.ply", &bytes).unwrap();
        assert_eq!(file.parts[0].mesh.positions[0].x, x);
    }
}

#[test]
fn coordinates_that_are_no_numbers_name_the_line() {
    for word in ["nan", "-inf", "1e400", "1e39"] {
        let kind = replaced("1 0 0 0 0 1 255", &format!("{word} 0 0 0 0 1 255"));
        assert!(kind.to_string().contains("line 18: vertex 1"), "{kind}");
    }
}

#[test]
fn negative_list_counts_are_refused() {
    for (kind, count) in [("char", -1), ("short", -2), ("int", -3)] {
        let lists = format!("list {kind} int vertex");
        let text = String::from_utf8(ascii())
            .unwrap()
            .replace("list uchar int vertex", &lists);
        let text = text.replace("7 4 0", &format!("7 {count} 0"));
        assert!(load_bytes("m.ply", text.as_bytes()).is_err());
        let mut bytes = format!("ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty char x\nproperty char y\nproperty char z\n\
            element face 1\nproperty {lists}_indices\nend_header\n").into_bytes();
        bytes.extend([0, 0, 0, 0xff, 0xff, 0xff, 0xff]);
        assert!(load_bytes("m.ply", &bytes).is_err());
    }
}

#[test]
fn vertices_may_come_after_their_faces() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\n\
        property float x\nproperty float y\nproperty float z\nend_header\n3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n";
    assert_eq!(load(text).parts[0].mesh.triangles, [[0, 1, 2]]);
}
