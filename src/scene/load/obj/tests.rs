use super::super::tests::load_bytes;
use super::super::{FileTexture, load_mesh};
use super::*;
use crate::surface::{MeshError, NormalMode};

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
        ("f 1/1 2/1 3/1", "texture coordinate", 1, 0),
        ("f 1//-9 2//-9 3//-9", "normal", -9, 0),
        (
            "f 1/-9223372036854775808 2/1 3/1",
            "texture coordinate",
            i64::MIN,
            0,
        ),
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
        "vt 1 1\nf 1/1 2 3\n",
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
    let binary = load_bytes("m.obj", b"v 0 0 0\n\xff\xfe\n").unwrap_err();
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
    assert!(file.parts[2].material.is_none());
}

#[test]
fn materials_say_what_they_are_made_of() {
    let folder = tempfile::tempdir().unwrap();
    let library = "newmtl lamp\nKd 0 0 0\nKe 4 2 1\nnewmtl shiny\nKs 0.4 0.4 0.4\nNs 30\nNi 1.6\nd 0.75\nnewmtl chalk\nKs 0 0 0\nNs 30\n\
        newmtl pane\nKd 0.2 0.2 0.2\nTf 0.5 1 0.5\nTr 0.9\nillum 7\nnewmtl pbr\nPr 0.3\nPm 1\nPc 0.5\nmap_Pr -imfchan g rough.png\nnorm n.png\n";
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
    assert!(pbr.detail.is_some());
}
