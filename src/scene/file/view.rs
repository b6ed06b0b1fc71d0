//! `[film]`.

use super::{Item, SceneError};
use crate::scene::{Film, ToneCurve};

/// Largest width and height of a picture.
pub(crate) const MAX_SIDE: u32 = 65_536;
/// Most pixels of a picture: 2^28, which is 3 GB of linear RGB.
const MAX_PIXELS: u64 = 1 << 28;
/// Most samples per pixel.
pub(crate) const MAX_SPP: u32 = 1 << 20;

impl Default for Film {
    /// 640x480, 16 samples per pixel, filmic.
    fn default() -> Self {
        Self {
            width: 640,
            height: 480,
            spp: 16,
            seed: 0,
            exposure: 0.0,
            tone: ToneCurve::default(),
        }
    }
}

/// Reads `[film]`.
pub(super) fn film(item: Item) -> Result<Film, SceneError> {
    let mut section = item.section(&["width", "height", "spp", "seed", "exposure", "tone"])?;
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
    if let Some(spp) = section.optional("spp", |i| i.integer(1..=MAX_SPP))? {
        film.spp = spp;
    }
    if let Some(seed) = section.optional("seed", |i| i.integer(0..=u32::MAX))? {
        film.seed = seed;
    }
    if let Some(stops) = section.optional("exposure", |i| {
        i.number("stops from -64 to 64", |x| x.abs() <= 64.0)
    })? {
        film.exposure = stops;
    }
    let tones = [
        ("filmic", ToneCurve::Filmic),
        ("standard", ToneCurve::Standard),
    ];
    if let Some(tone) = section.optional("tone", |i| i.word(&tones))? {
        film.tone = tone;
    }
    Ok(film)
}

/// The size as found and the most pixels allowed, if a picture of this size has more.
pub(crate) fn too_many_pixels(width: u32, height: u32) -> Option<(String, u64)> {
    let pixels = u64::from(width) * u64::from(height);
    let found = || format!("{width}x{height} = {pixels} pixels");
    (pixels > MAX_PIXELS).then(|| (found(), MAX_PIXELS))
}
