//! Textures: wrap modes, sources, sharing.

use std::sync::Arc;

use super::*;
use crate::surface::Wrap;

#[test]
fn each_axis_has_its_own_wrap_mode() {
    let modes = [
        (10_497, Wrap::Repeat),
        (33_071, Wrap::Clamp),
        (33_648, Wrap::Mirror),
    ];
    for ((s, across), (t, up)) in modes.into_iter().flat_map(|s| modes.map(|t| (s, t))) {
        let mut document = document();
        document["textures"][0]["sampler"] = json!(0);
        document["samplers"] = json!([{ "wrapS": s, "wrapT": t }]);
        let material = load(&document).unwrap().parts.remove(0).material.unwrap();
        assert_eq!(material.base_color.texture.unwrap().wrap, [across, up]);
    }
}

#[test]
fn a_picture_that_is_only_there_by_an_extension_is_read_or_missed() {
    let load = |texture: Value| {
        let mut document = document();
        document["images"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "uri": "other" }));
        document["textures"][0] = texture;
        let mut file = load(&document).unwrap();
        let material = file.parts.remove(0).material.unwrap();
        let name = material.base_color.texture.map(|t| match t.source {
            FileTexture::Path(path) => path.file_name().unwrap().to_string_lossy().into_owned(),
            FileTexture::Embedded { .. } => panic!("pictures are files"),
        });
        (name, file.unused)
    };
    let by = |extension: &str| json!({ extension: { "source": 1 } });
    let (name, unused) = load(json!({ "extensions": by("EXT_texture_webp") }));
    assert_eq!((name.as_deref(), unused.is_empty()), (Some("other"), true));
    for extension in ["KHR_texture_basisu", "MSFT_texture_dds"] {
        let (name, unused) = load(json!({ "extensions": by(extension) }));
        let told = format!("no effect: {extension} of 1 texture");
        assert_eq!((name, unused.to_string()), (None, told));
        let (name, unused) = load(json!({ "source": 0, "extensions": by(extension) }));
        let there = (name.as_deref(), unused.is_empty());
        assert_eq!(there, (Some("my color.png"), true));
    }
    let (name, unused) = load(json!({}));
    let told = "no effect: no picture of 1 texture".to_owned();
    assert_eq!((name, unused.to_string()), (None, told));
}

#[test]
fn a_picture_inside_the_file_is_copied_once() {
    let mut document = document();
    document["images"][0] = json!({ "bufferView": 1 });
    let textures = json!([{ "source": 0 }, { "source": 0 }]);
    document["textures"] = textures;
    document["materials"][0]["emissiveTexture"] = json!({ "index": 1 });
    let material = load(&document).unwrap().parts.remove(0).material.unwrap();
    let bytes = |texture: Option<crate::scene::load::FileTextureUse>| match texture.unwrap().source
    {
        FileTexture::Embedded { bytes, .. } => bytes,
        FileTexture::Path(_) => panic!("the picture is in the file"),
    };
    let (base, emission) = (
        bytes(material.base_color.texture),
        bytes(material.emission.texture),
    );
    assert_eq!(base[..], binary()[48..64]);
    assert!(Arc::ptr_eq(&base, &emission));
}

#[test]
fn pictures_that_overlap_are_refused_once_they_outgrow_the_file() {
    let mut document = document();
    let view = |i: usize| json!({ "buffer": 0, "byteOffset": i, "byteLength": 70 });
    let views = document["bufferViews"].as_array_mut().unwrap();
    views.extend([view(0), view(0), view(1)]);
    let mut load = |images: &[usize]| {
        let images: Vec<Value> = images.iter().map(|i| json!({ "bufferView": i })).collect();
        document["images"] = json!(images);
        load(&document)
    };
    assert!(load(&[3, 3, 4, 3]).is_ok());
    let error = load(&[3, 5]).unwrap_err().to_string();
    assert!(
        error.contains("image 1") && error.contains("overlaps"),
        "{error}"
    );
}
