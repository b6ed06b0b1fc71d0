//! `[film]`.

use glam::UVec2;

use super::{Item, SceneError};
use crate::scene::{Adaptive, Aov, AovSet, Film, Filter, FilterShape, ToneCurve, Window};

/// Largest width and height of a picture.
pub(crate) const MAX_SIDE: u32 = 65_536;
/// Most pixels of a picture: 2^28, which is 13 GB of sums without AOVs.
const MAX_PIXELS: u64 = 1 << 28;
/// Most samples per pixel.
pub(crate) const MAX_SPP: u32 = 1 << 20;
/// Most stops of exposure, up and down.
pub(crate) const MAX_STOPS: f32 = 64.0;

const KEYS: &[&str] = &[
    "width",
    "height",
    "crop",
    "spp",
    "seed",
    "filter",
    "filter_radius",
    "clamp",
    "adaptive_threshold",
    "adaptive_min_spp",
    "progressive",
    "aovs",
    "exposure",
    "tone",
];

/// Reads `[film]`.
pub(super) fn film(item: Item) -> Result<Film, SceneError> {
    let mut section = item.section(KEYS)?;
    let mut film = Film::default();
    if let Some(width) = section.optional("width", |i| i.integer(1..=MAX_SIDE))? {
        film.width = width;
    }
    if let Some(item) = section.get("height") {
        film.height = item.integer(1..=MAX_SIDE)?;
        if let Some((found, most)) = too_many_pixels(film.width, film.height) {
            return Err(item.error(found, format!("at most {most} pixels")));
        }
    }
    if let Some(item) = section.get("crop") {
        film.crop = Some(crop(&item, &film)?);
    }
    if let Some(spp) = section.optional("spp", |i| i.integer(1..=MAX_SPP))? {
        film.spp = spp;
    }
    if let Some(seed) = section.optional("seed", |i| i.integer(0..=u32::MAX))? {
        film.seed = seed;
    }
    if let Some(shape) = section.optional("filter", |i| i.word(FilterShape::NAMES))? {
        film.filter = Filter::of(shape);
    }
    if let Some(radius) = section.optional("filter_radius", |i| {
        let (low, high) = (Filter::RADII.start(), Filter::RADII.end());
        i.number(&format!("pixels from {low} to {high}"), |x| {
            Filter::RADII.contains(&x)
        })
    })? {
        film.filter.radius = radius;
    }
    film.clamp = section.optional("clamp", |i| i.number("radiance above 0", |x| x > 0.0))?;
    let threshold = section.optional("adaptive_threshold", |i| {
        i.number("an error above 0", |x| x > 0.0)
    })?;
    let min_spp = section.optional("adaptive_min_spp", |i| i.integer(2..=MAX_SPP))?;
    film.adaptive = threshold.map(|threshold| Adaptive {
        threshold,
        min_spp: min_spp.unwrap_or(Adaptive::USUAL_MIN_SPP),
    });
    if let Some(progressive) = section.optional("progressive", |i| i.boolean())? {
        film.progressive = progressive;
    }
    if let Some(item) = section.get("aovs") {
        let names = item.items("a list of names")?;
        let aovs = names.iter().map(|name| name.word(Aov::NAMES));
        film.aovs = aovs.collect::<Result<AovSet, _>>()?;
    }
    if let Some(stops) = section.optional("exposure", |i| {
        i.number("stops from -64 to 64", |x| x.abs() <= MAX_STOPS)
    })? {
        film.exposure = stops;
    }
    if let Some(tone) = section.optional("tone", |i| i.word(ToneCurve::NAMES))? {
        film.tone = tone;
    }
    Ok(film)
}

fn crop(item: &Item, film: &Film) -> Result<Window, SceneError> {
    let whole = Window::whole(film.width, film.height);
    let corners = item.integers::<4>().map(|[x0, y0, x1, y1]| Window {
        start: UVec2::new(x0, y0),
        end: UVec2::new(x1, y1),
    });
    corners.filter(|crop| fits(crop, &whole)).ok_or_else(|| {
        let UVec2 { x, y } = whole.end;
        item.refuse(format!(
            "pixels [x0, y0, x1, y1] inside of {x}x{y}, with x0 < x1 and y0 < y1"
        ))
    })
}

/// Whether `crop` has pixels, all of them inside of `whole`.
pub(crate) fn fits(crop: &Window, whole: &Window) -> bool {
    crop.pixels() > 0 && crop.intersection(whole) == *crop
}

/// The size as found and the most pixels allowed, if a picture of this size has more.
pub(crate) fn too_many_pixels(width: u32, height: u32) -> Option<(String, u64)> {
    let pixels = u64::from(width) * u64::from(height);
    let found = || format!("{width}x{height} = {pixels} pixels");
    (pixels > MAX_PIXELS).then(|| (found(), MAX_PIXELS))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::file::SceneFile;

    fn read(keys: &str) -> Result<Film, String> {
        let text = format!("[film]\n{keys}\n[[mesh]]\nfile = \"a.obj\"");
        let file = SceneFile::parse_with(Path::new("s.toml"), &text, &[]);
        file.map(|file| file.film).map_err(|e| e.to_string())
    }

    #[test]
    fn every_key_is_read() {
        let keys = "width = 64\nheight = 48\ncrop = [0, 8, 32, 48]\nspp = 4\nseed = 9\nfilter = \"mitchell\"\n\
            clamp = 10\nadaptive_threshold = 0.02\nadaptive_min_spp = 8\nprogressive = true\n\
            aovs = [\"N\", \"prim\"]\nexposure = -1.5\ntone = \"agx\"";
        let film = Film {
            width: 64,
            height: 48,
            crop: Some(Window {
                start: UVec2::new(0, 8),
                end: UVec2::new(32, 48),
            }),
            spp: 4,
            seed: 9,
            filter: Filter {
                shape: FilterShape::Mitchell,
                radius: 2.0,
            },
            clamp: Some(10.0),
            adaptive: Some(Adaptive {
                threshold: 0.02,
                min_spp: 8,
            }),
            progressive: true,
            aovs: AovSet::NONE.with(Aov::Normal).with(Aov::Prim),
            exposure: -1.5,
            tone: ToneCurve::Agx,
        };
        assert_eq!(read(keys), Ok(film));
        let radius = read("filter_radius = 3\nfilter = \"box\"").unwrap();
        assert_eq!(radius.filter.radius, 3.0);
        assert_eq!(read(""), Ok(Film::default()));
    }

    #[test]
    fn what_does_not_fit_is_refused_by_key_and_place() {
        let cases = [
            ("crop = [0, 0, 641, 480]", "inside of 640x480"),
            ("crop = [5, 0, 5, 480]", "x0 < x1"),
            ("crop = [0, 0, 5]", "found [0, 0, 5]"),
            ("crop = [0, 0, -1, 5]", "film.crop"),
            ("filter = \"sinc\"", "blackman-harris"),
            ("filter_radius = 0", "pixels from"),
            ("clamp = 0", "above 0"),
            ("adaptive_threshold = nan", "above 0"),
            ("adaptive_min_spp = 1", "from 2"),
            ("aovs = [\"N\", \"speed\"]", "film.aovs[1]"),
            ("aovs = \"N\"", "a list"),
            ("tone = \"aces\"", "\"agx\""),
        ];
        for (key, word) in cases {
            let error = read(key).unwrap_err();
            assert!(
                error.contains(word) && error.contains("s.toml:2:"),
                "{error}"
            );
        }
    }
}
