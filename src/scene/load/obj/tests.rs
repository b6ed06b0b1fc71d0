use super::super::tests::load_bytes;
use super::super::{FileDetail, FileTexture, load_mesh};
use super::*;
use crate::surface::{MeshBuilder, MeshError, NormalMode};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn load(statements: &str) -> Result<LoadedFile, LoadMeshErrorKind> {
    load_bytes("m.obj", format!("{SQUARE}{statements}").as_bytes()).map_err(|e| e.kind)
}

fn only(statements: &str) -> MeshBuilder {
    let mut file = load(statements).unwrap();
    assert_eq!(file.parts.len(), 1);
    assert!(file.warnings.is_empty(), "{:?}", file.warnings);
    file.parts.remove(0).mesh
}

#[test]
fn polygons_become_fans_over_shared_vertices() {
    let mesh = only("f 1 2 3 4\n");
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.positions.len(), 4);
    assert!(mesh.normals.is_empty() && mesh.texcoords.is_empty());
}

#[test]
fn negative_indices_count_back() {
    let mesh = only("f -4 -3 -2 -1\n");
    assert_eq!(mesh.positions[0], Vec3::ZERO);
    assert_eq!(mesh.positions[3], Vec3::Y);
}

#[test]
fn corners_share_a_vertex_exactly_when_all_their_indices_agree() {
    let mesh = only(
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/2/1 4/4/1\n",
    );
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 3, 4]]);
    assert_eq!(mesh.texcoords[2], Vec2::ONE);
    assert_eq!(mesh.texcoords[3], Vec2::X);
    assert_eq!(mesh.normals, [Vec3::Z; 5]);
}

#[test]
fn groups_of_one_material_are_one_part_in_file_order() {
    let mesh = only("g a\nf 1 2 3\ng b\nf 3 4 1\no c\nf 2 3 4\n");
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 3, 0], [1, 2, 3]]);
    assert_eq!(mesh.positions.len(), 4);
}

#[test]
fn normals_may_be_missing_on_some_faces() {
    let mesh = only("vn 1 0 0\nf 1//1 2//1 3//1\nf 1 3 4\n");
    assert_eq!(mesh.triangles.len(), 2);
    assert_eq!(mesh.normals[0], Vec3::X);
    assert_eq!(mesh.normals[mesh.triangles[1][0] as usize], Vec3::ZERO);
}

#[test]
fn faces_with_and_without_texture_coordinates_are_two_parts() {
    let file = load("vt 0 0\nf 1/1 2/1 3/1\nf 1 3 4\n").unwrap();
    assert_eq!(file.parts.len(), 2);
    assert_eq!(file.parts[0].mesh.texcoords.len(), 3);
    assert!(file.parts[1].mesh.texcoords.is_empty());
    let whole = file.into_single_mesh();
    assert_eq!(whole.triangles.len(), 2);
    assert!(whole.texcoords.is_empty());
}

#[test]
fn comments_colours_continued_lines_and_polylines_are_understood() {
    let text = "# c\nv 0 0 0 1 0 0\nv 2 0 0 2\nv 0 1 0\nl 1 2 3\np 1\nvt 0.5\n\
                f 1/1 2/1 \\\n3/1 # last\n";
    let file = load_bytes("m.obj", text.as_bytes()).unwrap();
    let mesh = &file.parts[0].mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.positions[1], Vec3::X);
    assert_eq!(mesh.texcoords[0], Vec2::new(0.5, 0.0));
}

#[test]
fn a_byte_order_mark_does_not_hide_the_first_vertex() {
    let text = "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let file = load_bytes("m.obj", text.as_bytes()).unwrap();
    assert_eq!(file.parts[0].mesh.positions[0], Vec3::ZERO);
}

#[test]
fn indices_out_of_range_name_the_line() {
    for (face, what, index, count) in [
        ("f 1 2 5", "vertex", 5, 4),
        ("f 1 2 0", "vertex", 0, 4),
        ("f 1 2 -5", "vertex", -5, 4),
        ("f 1 2 -9223372036854775808", "vertex", i64::MIN, 4),
    ] {
        match load(&format!("{face}\n")) {
            Err(LoadMeshErrorKind::IndexOutOfRange {
                place,
                what: found_what,
                index: found,
                count: found_count,
                ..
            }) => {
                assert_eq!(place, "line 5");
                assert_eq!((found_what, found, found_count), (what, index, count));
            }
            other => panic!("{face}: {other:?}"),
        }
    }
}

#[test]
fn broken_statements_name_the_line() {
    for text in [
        "f 1 2\n",
        "f\n",
        "f 1 2 x\n",
        "f 1 2 3/\u{2f}/\u{2f}\n",
        "f 1 2 99999999999999999999\n",
        "v 1 2\n",
        "v 1 2 three\n",
        "v 1 2 3 0\n",
        "vn 1 2\n",
        "vt\n",
    ] {
        match load(text) {
            Err(LoadMeshErrorKind::Syntax { line, .. }) => assert!(line == 5 || line == 6),
            other => panic!("{text:?}: {other:?}"),
        }
    }
}

#[test]
fn a_file_cut_off_anywhere_never_panics() {
    let text = format!("{SQUARE}vt 0 1\nvn 0 0 1\ng a\nf 1/1/1 2/1/1 3/1/1 4/1/1\n");
    for length in 0..text.len() {
        let _ = load_bytes("m.obj", &text.as_bytes()[..length]);
    }
}

#[test]
fn files_without_faces_or_text_are_refused() {
    assert!(matches!(load(""), Err(LoadMeshErrorKind::NoFaces)));
    let binary = load_bytes("m.obj", b"v 0 0 0\n\xff\0\n").unwrap_err();
    assert!(matches!(
        binary.kind,
        LoadMeshErrorKind::NotText { line: 2 }
    ));
}

#[test]
fn nan_is_left_to_the_builder_which_names_the_vertex() {
    let file = load_bytes("m.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let error = file.into_single_mesh().build(NormalMode::File).unwrap_err();
    assert!(matches!(error, MeshError::NotFinite { vertex: 1, .. }));
}

#[test]
fn concave_polygons_are_cut_inside() {
    let text = "v 0 0 0\nv 16 0 0\nv 4 3 0\nv 0 12 0\nvt 0 0\nf 2/1 3/1 4/1 1/1\n";
    let file = load_bytes("m.obj", text.as_bytes()).unwrap();
    let mesh = &file.parts[0].mesh;
    let used: Vec<Vec<Vec3>> = mesh
        .triangles
        .iter()
        .map(|t| t.map(|i| mesh.positions[i as usize]).to_vec())
        .collect();
    let (origin, inner) = (Vec3::ZERO, Vec3::new(4.0, 3.0, 0.0));
    assert_eq!(used.len(), 2);
    assert!(
        used.iter()
            .all(|t| t.contains(&origin) && t.contains(&inner))
    );
}

#[test]
fn polygons_that_cross_themselves_are_counted_once() {
    let file = load("f 1 3 2 4\nf 1 3 2 4\n").unwrap();
    assert_eq!(file.parts[0].mesh.triangles.len(), 4);
    assert_eq!(file.warnings.len(), 1, "{:?}", file.warnings);
    assert!(file.warnings[0].starts_with("2 polygons"));
}

#[test]
fn normals_that_cannot_be_used_are_left_out_with_one_warning() {
    let text = "vn 1 0 0\nvn nan 0 0\nf 1//1 2//0 3//1\nf 1//1 3//9 4//-7\nf 2//2 3//1 4//1\nf 1//1 2//1 4//1\n";
    let file = load(text).unwrap();
    assert_eq!(file.warnings.len(), 1, "{:?}", file.warnings);
    assert!(
        file.warnings[0].contains("3 faces, the first at line 7"),
        "{}",
        file.warnings[0]
    );
    let mesh = &file.parts[0].mesh;
    assert_eq!(mesh.triangles.len(), 4);
    let normal =
        |triangle: usize, corner: usize| mesh.normals[mesh.triangles[triangle][corner] as usize];
    assert_eq!(
        [0, 1, 2].map(|c| normal(0, c)),
        [Vec3::X, Vec3::ZERO, Vec3::X]
    );
    assert_eq!(
        [0, 1, 2].map(|c| normal(1, c)),
        [Vec3::X, Vec3::ZERO, Vec3::ZERO]
    );
    assert_eq!(normal(2, 0), Vec3::ZERO);
}

#[test]
fn faces_keep_texture_coordinates_only_if_every_corner_has_them() {
    let text = "vt 0 0\nf 1/1 2/0 3/1\nf 1/1 3 4/1\nf 1/1 2/1 4/2\nf 1/1 2/1 3/1\nf 1 2 3\n";
    let file = load(text).unwrap();
    assert_eq!(file.warnings.len(), 1, "{:?}", file.warnings);
    assert!(
        file.warnings[0].contains("3 faces, the first at line 6"),
        "{}",
        file.warnings[0]
    );
    let textured: Vec<_> = file
        .parts
        .iter()
        .map(|p| (p.mesh.texcoords.len(), p.mesh.triangles.len()))
        .collect();
    assert_eq!(textured, [(0, 4), (3, 1)]);
}

#[test]
fn old_line_ends_and_any_encoding_are_read() {
    let text = "# caf\u{e9}\rv 0 0 0\rv 1 0 0\rv 0 1 0\ro \u{fc}ber\rf 1 2 3\r";
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let utf16: Vec<u8> = "\u{feff}"
        .encode_utf16()
        .chain(text.encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    for bytes in [text.as_bytes(), &latin, &utf16] {
        let file = load_bytes("m.obj", bytes).unwrap();
        assert_eq!(file.parts[0].name, "\u{fc}ber");
        assert_eq!(file.parts[0].mesh.triangles, [[0, 1, 2]]);
    }
}

#[test]
fn other_statements_are_passed_over() {
    let mesh = only(
        "s 1\ncstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nparm u 0 1\nend\nl 1 2\np 3\nlod 1\nshadow_obj x\nf 1 2 3\n\
         call other.obj\ncsh echo\n\u{1f600} 7\n",
    );
    assert_eq!(mesh.triangles.len(), 1);
}

#[test]
fn a_face_may_have_thousands_of_corners_over_many_lines() {
    let n = 5000;
    let mut text = String::new();
    let mut face = "f".to_owned();
    for i in 0..n {
        let p = [1.0, 0.5][i % 2] * Vec2::from_angle(i as f32 * std::f32::consts::TAU / n as f32);
        text += &format!("v {} {} 0\n", p.x, p.y);
        face += &format!(" \\\n{}", i + 1);
    }
    let file = load_bytes("m.obj", (text + &face).as_bytes()).unwrap();
    assert!(file.warnings.is_empty());
    assert_eq!(file.parts[0].mesh.triangles.len(), n - 2);
    assert_eq!(file.parts[0].mesh.positions.len(), n);
}

#[test]
fn a_library_is_read_once_however_often_it_is_named() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("m.mtl"),
        "newmtl a\nKd 2 x\nnewmtl b\nKd 1 x\n",
    )
    .unwrap();
    let path = folder.path().join("m.obj");
    let names = "mtllib m.mtl\nmtllib ./m.mtl m.mtl\nmtllib \"m.mtl\"\nmtllib M.MTL\n".repeat(100);
    // Below its use is early enough.
    std::fs::write(&path, format!("{SQUARE}usemtl a\nf 1 2 3\n{names}")).unwrap();
    let file = load_mesh(&path).unwrap();
    let [of_case, fault] = &file.warnings[..] else {
        panic!("{:?}", file.warnings);
    };
    assert!(of_case.contains("M.MTL"), "{of_case}");
    // Of the one material that is used.
    assert!(fault.contains("m.mtl: line 2"), "{fault}");
    assert_eq!(file.files, [folder.path().join("m.mtl"), path]);
}

#[test]
fn a_missing_library_is_a_warning() {
    let file = load("mtllib none.mtl\nusemtl rock\nf 1 2 3\n").unwrap();
    assert_eq!(file.warnings.len(), 1, "{:?}", file.warnings);
    assert!(file.warnings[0].contains("none.mtl"));
    assert!(file.parts[0].material.is_none());
}

#[test]
fn materials_part_the_faces_and_bring_their_maps() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("my lib.mtl"),
        "newmtl rock\nKd 0.5 0.25 1\nmap_Kd rock color.png\nmap_bump ignored.png\n\
         disp -mm -1 2 rock height.png\nnewmtl moss\nbump -bm 0.5 moss.png\n",
    )
    .unwrap();
    let path = folder.path().join("m.obj");
    let text = format!(
        "mtllib my lib.mtl\n{SQUARE}usemtl rock\nf 1 2 3\nusemtl moss\nf 1 3 4\nusemtl rock\nf 2 3 4\n\
         usemtl lost\nf 1 2 4\n"
    );
    std::fs::write(&path, text).unwrap();
    let file = load_mesh(&path).unwrap();
    assert_eq!(
        file.warnings,
        ["material \"lost\" is in no material library"]
    );
    let faces: Vec<usize> = file.parts.iter().map(|p| p.mesh.triangles.len()).collect();
    assert_eq!(faces, [2, 1, 1]);
    // The two rock faces share an edge, though other faces stand between them.
    assert_eq!(file.parts[0].mesh.positions.len(), 4);
    let rock = file.parts[0].material.as_ref().unwrap();
    assert_eq!(rock.base_color.factor, Vec3::new(0.5, 0.25, 1.0));
    let color = folder.path().join("rock color.png");
    let texture = rock.base_color.texture.as_ref().unwrap();
    assert_eq!(texture.source, FileTexture::Path(color));
    let map = rock.displacement.as_ref().unwrap();
    assert_eq!(map.path, folder.path().join("rock height.png"));
    assert_eq!((map.scale, map.midlevel), (Some(2.0), Some(0.5)));
    let moss = file.parts[1].material.as_ref().unwrap();
    let map = moss.displacement.as_ref().unwrap();
    assert_eq!(map.path, folder.path().join("moss.png"));
    assert_eq!(map.scale, Some(0.5));
    assert_eq!(map.from, "bump of material \"moss\" in my lib.mtl");
    // What does not displace shades, and what displaces does not shade once more.
    let Some(FileDetail::Bump(bump)) = &moss.detail else {
        panic!("{:?}", moss.detail);
    };
    assert_eq!(bump.factor, 0.5);
    assert!(moss.clone().displaced().detail.is_none());
    assert!(rock.clone().displaced().detail.is_some());
    assert!(file.parts[2].material.is_none());
}

#[test]
fn names_are_the_same_in_every_encoding_and_with_quotes() {
    let folder = tempfile::tempdir().unwrap();
    let library = b"newmtl gr\xfcn # old\rKd 0 1 0 # green\rmap_Kd \"gr\xfcn 1.png\" -s 2 2 1\rnewmtl my wood\r";
    std::fs::write(folder.path().join("m.mtl"), library).unwrap();
    std::fs::write(folder.path().join("gr\u{fc}n 1.png"), "x").unwrap();
    let path = folder.path().join("m.obj");
    let text =
        format!("mtllib m.mtl\n{SQUARE}usemtl gr\u{fc}n\nf 1 2 3\nusemtl \"my wood\"\nf 1 3 4\n");
    std::fs::write(&path, text).unwrap();
    let file = load_mesh(&path).unwrap();
    assert!(file.warnings.is_empty(), "{:?}", file.warnings);
    let green = file.parts[0].material.as_ref().unwrap();
    assert_eq!(green.base_color.factor, Vec3::Y);
    let texture = green.base_color.texture.as_ref().unwrap();
    assert_eq!(
        texture.source,
        FileTexture::Path(folder.path().join("gr\u{fc}n 1.png"))
    );
    assert_eq!(texture.uv.scale, Vec2::splat(2.0));
    assert_eq!(texture.from, "map_Kd of material \"gr\u{fc}n\" in m.mtl");
    assert_eq!(file.parts[1].material.as_ref().unwrap().name, "my wood");
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_no_libraries() {
    let folder = tempfile::tempdir().unwrap();
    let made = std::process::Command::new("mkfifo")
        .arg(folder.path().join("pipe.mtl"))
        .status();
    assert!(made.unwrap().success());
    let path = folder.path().join("m.obj");
    std::fs::write(
        &path,
        format!("mtllib /dev/zero\nmtllib pipe.mtl\n{SQUARE}usemtl a\nf 1 2 3\n"),
    )
    .unwrap();
    let file = load_mesh(&path).unwrap();
    assert_eq!(file.warnings.len(), 2, "{:?}", file.warnings);
    assert_eq!(file.files, [path]);
}

#[test]
fn materials_say_what_they_are_made_of() {
    let folder = tempfile::tempdir().unwrap();
    let library = "newmtl lamp\nKd 0 0 0\nKe 4 2 1\nnewmtl shiny\nKs 0.4 0.4 0.4\nNs 30\nNi 1.6\nd 0.75\nnewmtl chalk\nKs 0 0 0\nNs 30\n\
        newmtl pane\nKd 0.2 0.2 0.2\nTf 0.5 1 0.5\nTr 0.9\nillum 7\nnewmtl pbr\nPr 0.3\nPm 1\nPc 0.5\nmap_Pr -imfchan g rough.png\nnorm n.png\nbump h.png\n";
    std::fs::write(folder.path().join("m.mtl"), library).unwrap();
    let names = ["lamp", "shiny", "chalk", "pane", "pbr"];
    let faces: String = names
        .iter()
        .map(|n| format!("usemtl {n}\nf 1 2 3\n"))
        .collect();
    let path = folder.path().join("m.obj");
    std::fs::write(&path, format!("mtllib m.mtl\n{SQUARE}{faces}")).unwrap();
    let file = load_mesh(&path).unwrap();
    let materials: Vec<_> = file
        .parts
        .into_iter()
        .map(|p| p.material.unwrap())
        .collect();
    let [lamp, shiny, chalk, pane, pbr] = &materials[..] else {
        panic!("five were written");
    };
    assert_eq!(lamp.emission.factor, Vec3::new(4.0, 2.0, 1.0));
    // alpha = roughness^2 = sqrt(2 / 32).
    assert!((shiny.roughness.factor - 0.5).abs() < 1e-6);
    assert!((shiny.specular.factor - 0.4).abs() < 1e-6);
    assert_eq!((shiny.ior, shiny.opacity.factor), (1.6, 0.75));
    // An exponent without a highlight says nothing.
    assert_eq!((chalk.roughness.factor, chalk.specular.factor), (1.0, 0.0));
    assert_eq!((pane.transmission.factor, pane.opacity.factor), (1.0, 1.0));
    assert_eq!(pane.base_color.factor, Vec3::new(0.5, 1.0, 0.5));
    assert_eq!(
        (pbr.roughness.factor, pbr.metallic.factor, pbr.coat.factor),
        (0.3, 1.0, 0.5)
    );
    assert_eq!(pbr.roughness.texture.as_ref().unwrap().1, "g");
    assert!(matches!(pbr.detail, Some(FileDetail::NormalMap { .. })));
}

#[test]
fn statements_that_have_no_effect_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let library = "newmtl a\nKa 1 1 1\nKd 1 1 1\nsharpness 60\nsharpness 70\nmap_Ks s.png\nnewmtl b\nsharpness 1\nnewmtl c\nodd 1\n";
    std::fs::write(folder.path().join("m.mtl"), library).unwrap();
    let path = folder.path().join("m.obj");
    let load = |text: String| {
        std::fs::write(&path, text).unwrap();
        load_mesh(&path).unwrap().unused.to_string()
    };
    let told = load(format!(
        "mtllib m.mtl\nmtllib m.mtl\n{SQUARE}v 0 0 0 1 0 0\ns 1\nusemtl a\nf 1 2 3\ns 2\nusemtl b\nf 1 3 2\nl 1 2\nl 2 3\np 1\ncstype bezier\n"
    ));
    assert_eq!(
        told,
        "no effect: colours of 1 vertex, 2 groups of smoothing, cstype of 1 line, l of 2 lines, p of 1 line, map_Ks of 1 material, \
         sharpness of 2 materials"
    );
    // One group is what is done anyhow, and beside normals there is nothing to smooth.
    for smoothing in ["s 1\n", "vn 0 0 1\ns 1\ns 2\n"] {
        assert_eq!(load(format!("{SQUARE}{smoothing}f 1 2 3\n")), "no effect: ");
    }
}
