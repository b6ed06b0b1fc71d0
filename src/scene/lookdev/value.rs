//! Values as TOML has them: short where readers want that, and paths as seen from the file's folder.

use std::path::{Component, Path, PathBuf};

use glam::{Vec2, Vec3};

use crate::surface::Wrap;

/// A number with all its digits.
pub(super) fn float(x: f32) -> String {
    format!("{x:?}")
}

/// Coordinates within a ten-thousandth of `size`, for readers.
pub(super) fn point(p: Vec3, size: f32) -> String {
    let [x, y, z] = p.to_array().map(|x| near(x, size));
    format!("[{x}, {y}, {z}]")
}

/// A number to a ten-thousandth of `size` or better.
pub(super) fn near(x: f32, size: f32) -> String {
    let digits = 4 - f64::from(size).log10().floor() as i32;
    if !(0..=12).contains(&digits) {
        return float(x);
    }
    let digits = digits.max(1) as usize;
    let text = format!("{x:.digits$}");
    let short = text.trim_end_matches('0');
    let whole = if short.ends_with('.') { "0" } else { "" };
    let text = format!("{short}{whole}");
    match text.parse() {
        Ok(0.0) => "0.0".into(), // not -0
        _ => text,
    }
}

pub(super) fn uv(scale: Vec2) -> String {
    format!("{{ scale = [{}, {}] }}", float(scale.x), float(scale.y))
}

/// A string as TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// The word for a value, quoted.
pub(super) fn word<T: PartialEq>(words: &[(&str, T)], value: T) -> String {
    let word = words.iter().find(|(_, known)| *known == value);
    quoted(word.map_or("", |(word, _)| word))
}

pub(super) fn wrap(wrap: Wrap) -> &'static str {
    match wrap {
        Wrap::Repeat => "repeat",
        Wrap::Clamp => "clamp",
        Wrap::Mirror => "mirror",
    }
}

/// `path` as seen from `folder`, where there is a way that leaves something in common; else in full.
pub(super) fn relative(path: &Path, folder: &Path) -> PathBuf {
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    // Links to folders are followed, since `..` leads out of where they lead; what the file itself is called stays.
    let parent = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let (Ok(parent), Ok(folder), Some(name)) = (
        parent.canonicalize(),
        folder.canonicalize(),
        path.file_name(),
    ) else {
        return std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    };
    let same = parent
        .components()
        .zip(folder.components())
        .take_while(|(a, b)| a == b);
    let same = same.count();
    let named = |c: &Component| matches!(c, Component::Normal(_));
    if !parent.components().take(same).any(|c| named(&c)) && parent != folder {
        return parent.join(name);
    }
    let out = folder.components().skip(same).map(|_| Component::ParentDir);
    let way = out.chain(parent.components().skip(same));
    way.collect::<PathBuf>().join(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::UvTransform;

    #[test]
    fn paths_lead_from_the_folder_to_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in ["a/b", "c"] {
            std::fs::create_dir_all(path(name)).unwrap();
        }
        for (file, from, way) in [
            ("x.obj", "", "x.obj"),
            ("a/x.obj", "", "a/x.obj"),
            ("x.obj", "a", "../x.obj"),
            ("a/b/x.obj", "c", "../a/b/x.obj"),
            ("a/../c/x.obj", "c", "x.obj"),
        ] {
            assert_eq!(relative(&path(file), &path(from)), Path::new(way), "{file}");
        }
        let none = relative(&path("none/x.obj"), &path("c"));
        assert!(none.is_absolute(), "{none:?}");
    }

    #[test]
    fn numbers_are_short_where_that_is_near_enough_and_toml_always() {
        assert_eq!(near(1.234_567, 1.0), "1.2346");
        assert_eq!(near(-0.000_001, 1.0), "0.0");
        assert_eq!(near(12.0, 1.0), "12.0");
        assert_eq!(near(123_456.7, 1e4), "123456.7");
        for size in [1e-30f32, 1e-9, 1e-3, 1.0, 3e4, 1e9, 1e18] {
            for x in [0.0, size, -1.2345 * size, 7e3 * size] {
                let text = format!("x = {}", near(x, size));
                let table: toml::Table = text.parse().unwrap();
                let read = table["x"].as_float().unwrap();
                assert!(
                    (read - f64::from(x)).abs()
                        <= 1e-4 * f64::from(size) + 1e-7 * f64::from(x.abs()),
                    "{text}"
                );
            }
        }
    }

    #[test]
    fn uv_transforms_are_those_of_scene_files() {
        assert_eq!(UvTransform::default().scale, Vec2::ONE);
        assert_eq!(uv(Vec2::new(2.0, 0.5)), "{ scale = [2.0, 0.5] }");
    }
}
