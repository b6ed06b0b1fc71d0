use super::*;

fn read(statements: &str) -> (FileMaterial, Vec<String>) {
    let mut warnings = Vec::new();
    let mut reader = Reader {
        library: Path::new("lib/m.mtl"),
        locator: &mut Locator::default(),
        warnings: &mut warnings,
        others: &mut BTreeMap::new(),
    };
    let material = reader.material("a".into(), statements.as_bytes(), 10);
    (material, warnings)
}

#[test]
fn unusable_statements_are_reported_and_left_out() {
    let text = "Kd 0.5\nKd 1 2\nkd nan 0 0\nKa oops\nmap_Kd\nMAP_DISP h.png\nNs 1e999\nKs spectral f.rfl\n";
    let (material, warnings) = read(text);
    assert_eq!(material.base_color.factor, Vec3::splat(0.5));
    assert!(material.base_color.texture.is_none());
    assert_eq!(material.displacement.unwrap().path, Path::new("lib/h.png"));
    let lines: Vec<_> = warnings
        .iter()
        .map(|w| w.split(':').nth(1).unwrap().trim())
        .collect();
    assert_eq!(
        lines,
        ["line 11", "line 12", "line 14", "line 16", "line 17"]
    );
}

#[test]
fn numbers_may_follow_options_and_colours_may_have_more() {
    let (material, warnings) = read("d -halo 0.25\nKd 0.1 0.2 0.3 1.0 # old\n");
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(material.opacity.factor, 0.25);
    assert_eq!(material.base_color.factor, Vec3::new(0.1, 0.2, 0.3));
}

#[test]
fn a_map_alone_is_taken_as_it_is() {
    let (material, _) = read("map_Ke glow.png\nmap_Pm m.png\n");
    assert_eq!(material.emission.factor, Vec3::ONE);
    assert_eq!(material.metallic.factor, 1.0);
}

#[test]
fn map_norm_is_a_normal_map_and_bump_maps_are_heights() {
    let (material, _) = read("map_norm n.png\nmap_Bump h.png\n");
    assert!(matches!(
        material.detail,
        Some(FileDetail::NormalMap { .. })
    ));
    let (material, _) = read("map_Bump h.png -bm 0.02 -imfchan l\n");
    let Some(FileDetail::Bump(heights)) = material.detail else {
        panic!("{:?}", material.detail);
    };
    assert_eq!(heights.factor, 0.02);
    let (texture, channel) = heights.texture.unwrap();
    assert_eq!(channel, "luminance");
    assert_eq!(texture.from, "map_Bump of material \"a\" in m.mtl");
}
