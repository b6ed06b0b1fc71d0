//! Values of options, checked as they are parsed.

use std::ops::Range;
use std::time::Duration;

use clap::builder::{PathBufValueParser, PossibleValuesParser, TypedValueParser};
use glam::{UVec2, Vec2};

use super::render::Given;
use crate::scene::{
    Aov, AovSet, Filter, MAX_SIDE, MAX_SPP, MAX_STOPS, STEP_TEXELS, Window, too_many_pixels,
};

/// `WxH`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

/// `640x480`.
pub fn size(text: &str) -> Result<Size, String> {
    let expected = || format!("expected WIDTHxHEIGHT, like 640x480, each from 1 to {MAX_SIDE}");
    let side = |s: &str| s.parse().ok().filter(|n| (1..=MAX_SIDE).contains(n));
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
    let (width, height) = (side(width), side(height));
    let (Some(width), Some(height)) = (width, height) else {
        return Err(expected());
    };
    match too_many_pixels(width, height) {
        Some((found, most)) => Err(format!("{found}; expected at most {most} pixels")),
        None => Ok(Size { width, height }),
    }
}

/// `x0,y0,x1,y1`.
pub fn window(text: &str) -> Result<Window, String> {
    let corners = text.split(',').map(|x| x.trim().parse().ok());
    let corners: Option<Vec<u32>> = corners.collect();
    match corners.as_deref() {
        Some(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Window {
            start: UVec2::new(x0, y0),
            end: UVec2::new(x1, y1),
        }),
        _ => Err("expected pixels x0,y0,x1,y1 from the top left, with x0 < x1 and y0 < y1".into()),
    }
}

/// `A..B`: A, ..., B - 1.
pub fn samples(text: &str) -> Result<Range<u32>, String> {
    let ends = text.split_once("..");
    let number = |s: &str| s.parse().ok().filter(|&n: &u32| n <= MAX_SPP);
    let ends = ends.and_then(|(a, b)| Some((number(a)?, number(b)?)));
    ends.filter(|(a, b)| a < b)
        .map(|(a, b)| a..b)
        .ok_or_else(|| {
            format!("expected A..B with A < B, like 0..16: samples A to B - 1, at most {MAX_SPP}")
        })
}

/// A number above 0, or none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit(pub Option<f32>);

/// A number above 0, or `off`.
pub fn limit(text: &str) -> Result<Limit, String> {
    if text == "off" {
        return Ok(Limit(None));
    }
    let number = finite(text).ok().filter(|&x| x > 0.0);
    let limit = number.map(|x| Limit(Some(x)));
    limit.ok_or_else(|| "expected a number above 0, or off".into())
}

/// Half the width of a filter.
pub fn filter_radius(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|x| Filter::RADII.contains(x));
    number.ok_or_else(|| {
        let (low, high) = (Filter::RADII.start(), Filter::RADII.end());
        format!("expected pixels from {low} to {high}")
    })
}

/// Stops of exposure.
pub fn stops(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|x| x.abs() <= MAX_STOPS);
    number.ok_or_else(|| format!("expected stops from -{MAX_STOPS} to {MAX_STOPS}"))
}

/// Names with commas between, `all` or `none`.
pub fn aovs(text: &str) -> Result<AovSet, String> {
    let known = |name: &str| Aov::NAMES.iter().find(|(known, _)| *known == name);
    match text {
        "all" => Ok(AovSet::ALL),
        "none" => Ok(AovSet::NONE),
        _ => {
            let aovs = text.split(',').map(|name| Some(known(name.trim())?.1));
            let aovs: Option<AovSet> = aovs.collect();
            aovs.ok_or_else(|| format!("expected all, none, or some of {}", AovSet::ALL))
        }
    }
}

/// One of a few words.
pub fn word<T: Copy + Send + Sync>(
    words: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(words.iter().map(|(word, _)| *word)).try_map(move |found| {
        let word = words.iter().find(|(word, _)| *word == found);
        word.map(|&(_, meaning)| meaning).ok_or("unknown")
    })
}

/// A finite number.
pub fn finite(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|x: &f32| x.is_finite());
    number.ok_or_else(|| "expected a finite number".into())
}

/// A displacement scale.
pub fn scale(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|&x| x != 0.0);
    number.ok_or_else(|| "expected a finite number other than 0".into())
}

/// The path of a picture, or `none`.
pub fn file_or_none() -> impl TypedValueParser<Value = Given> {
    PathBufValueParser::new().map(|path| match path.to_str() {
        Some("none") => Given::Nothing,
        _ => Given::File(path),
    })
}

/// The same, or a number from 0 to 1.
pub fn amount() -> impl TypedValueParser<Value = Given> {
    PathBufValueParser::new().try_map(|path| {
        let number = path.to_str().and_then(|text| text.parse::<f32>().ok());
        match (path.to_str(), number) {
            (Some("none"), _) => Ok(Given::Nothing),
            (_, Some(x)) if (0.0..=1.0).contains(&x) => Ok(Given::Number(x)),
            (_, Some(_)) => Err("expected a number from 0 to 1, or the path of a picture"),
            _ => Ok(Given::File(path)),
        }
    })
}

/// One number above 0, or two with a comma between.
pub fn repeats(text: &str) -> Result<Vec2, String> {
    let expected = "expected how often the maps repeat, above 0: X or X,Y";
    let numbers: Option<Vec<f32>> = text.split(',').map(|x| length(x.trim()).ok()).collect();
    match numbers.as_deref() {
        Some(&[both]) => Ok(Vec2::splat(both)),
        Some(&[x, y]) => Ok(Vec2::new(x, y)),
        _ => Err(expected.into()),
    }
}

/// Azimuth, and perhaps elevation.
pub fn orbit(text: &str) -> Result<[f32; 2], String> {
    let degrees = |x: &str| finite(x.trim()).ok().filter(|x| x.abs() <= 360.0);
    let numbers: Option<Vec<f32>> = text.split(',').map(degrees).collect();
    match numbers.as_deref() {
        Some(&[azimuth]) => Ok([azimuth, 0.0]),
        Some(&[azimuth, elevation]) => Ok([azimuth, elevation]),
        _ => Err("expected degrees from -360 to 360: AZIMUTH or AZIMUTH,ELEVATION".into()),
    }
}

/// A march step in texels.
pub fn texels(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|x| STEP_TEXELS.contains(x));
    number.ok_or_else(|| {
        let (low, high) = (STEP_TEXELS.start(), STEP_TEXELS.end());
        format!("expected texels per step, from {low} to {high}")
    })
}

/// The angle of a pixel.
pub fn spread(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|x| (0.0..=1.0).contains(x));
    number.ok_or_else(|| "expected radians from 0 to 1".into())
}

/// A pause between two looks at something.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let number = finite(text).ok().filter(|x| (0.1..=86_400.0).contains(x));
    number.map(Duration::from_secs_f32).ok_or_else(|| {
        "expected seconds from 0.1 to 86400; a scene file goes before --preview".into()
    })
}

/// A length above zero.
pub fn length(text: &str) -> Result<f32, String> {
    let number = finite(text).ok().filter(|&x| x > 0.0);
    number.ok_or_else(|| "expected a length above 0".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_numbers_in_range() {
        let size_of = |width, height| Ok(Size { width, height });
        assert_eq!(size("640x480"), size_of(640, 480));
        assert_eq!(size("1X65536"), size_of(1, 65536));
        for bad in [
            "",
            "x",
            "640",
            "0x480",
            "640x0",
            "-1x1",
            "65537x1",
            "1x2x3",
            "65536x65536",
        ] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn windows_and_runs_of_samples_are_not_empty() {
        assert_eq!(
            window("1,2, 3,4").map(|w| w.to_string()),
            Ok("1,2,3,4".into())
        );
        for bad in [
            "",
            "1,2,3",
            "1,2,3,4,5",
            "1,2,1,4",
            "3,2,1,4",
            "-1,0,2,2",
            "a,0,2,2",
            "1.5,0,2,2",
        ] {
            assert!(window(bad).is_err(), "{bad}");
        }
        assert_eq!(samples("16..64"), Ok(16..64));
        for bad in [
            "",
            "4",
            "4..4",
            "5..4",
            "..4",
            "4..",
            "-1..4",
            "0..1048577",
            "0...4",
        ] {
            assert!(samples(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn limits_can_be_off_and_lists_of_aovs_are_names() {
        assert_eq!(limit("off"), Ok(Limit(None)));
        assert_eq!(limit("2.5"), Ok(Limit(Some(2.5))));
        for bad in ["", "0", "-1", "nan", "inf", "on"] {
            assert!(limit(bad).is_err(), "{bad}");
        }
        assert_eq!(aovs("N, Z").map(|a| a.to_string()), Ok("N Z".into()));
        assert_eq!(aovs("none"), Ok(AovSet::NONE));
        assert!(aovs("").is_err() && aovs("n").is_err() && aovs("all,N").is_err());
        assert!(filter_radius("0").is_err() && stops("65").is_err());
    }

    #[test]
    fn numbers_are_finite_and_fit() {
        assert_eq!(scale("-0.5"), Ok(-0.5));
        for bad in ["0", "nan", "inf", "1e50", "one", ""] {
            assert!(scale(bad).is_err(), "{bad}");
        }
        assert_eq!(repeats("2"), Ok(Vec2::splat(2.0)));
        assert_eq!(repeats("2, 0.5"), Ok(Vec2::new(2.0, 0.5)));
        assert!(repeats("0").is_err() && repeats("1,2,3").is_err() && repeats("").is_err());
        assert_eq!(orbit("-30"), Ok([-30.0, 0.0]));
        assert_eq!(orbit("90,15"), Ok([90.0, 15.0]));
        assert!(orbit("361").is_err() && orbit("1,").is_err() && orbit("nan").is_err());
        assert_eq!(texels("0.25"), Ok(0.25));
        assert!(texels("0").is_err() && texels("-1").is_err() && texels("1e-9").is_err());
        assert_eq!(length("1e-3"), Ok(1e-3));
        assert_eq!(seconds("0.5"), Ok(Duration::from_millis(500)));
        for bad in ["", "0", "-1", "nan", "86401", "3s", "scene.toml"] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
        assert!(length("0").is_err() && length("nan").is_err());
    }
}
