//! Luminance and chroma: Y, RY = (R - Y) / Y and BY = (B - Y) / Y, the chroma of fewer pixels (OpenEXR's "Luminance/chroma images").

use exr::meta::header::Header;
use glam::DVec3;

use super::exr_blocks::{Plane, Planes};

/// The weights of red, green and blue in luminance, of Rec. 709.
const REC_709: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// Indices of Y, RY and BY, where chroma stands beside the luminance `y`.
pub(super) fn channels(header: &Header, y: usize) -> Option<[usize; 3]> {
    let list = &header.channels.list;
    let name = list[y].name.to_string();
    let layer = name.strip_suffix('Y')?;
    let find = |chroma: &str| {
        let wanted = format!("{layer}{chroma}");
        list.iter()
            .position(|channel| channel.name.to_string() == wanted)
    };
    Some([y, find("RY")?, find("BY")?])
}

/// Red, green and blue over the data window, chroma bilinear; `None` where luminance itself is of fewer pixels.
pub(super) fn colors(header: &Header, read: Planes) -> Option<[Vec<f32>; 3]> {
    let Ok([luminance, red, blue]) = <[Plane; 3]>::try_from(read.planes) else {
        return None;
    };
    let width = luminance.width;
    if luminance.sampling != (1, 1) {
        return None;
    }
    let weights = weights(header).as_vec3();
    let (red, blue) = (Chroma::of(red), Chroma::of(blue));
    let mut colors = [(); 3].map(|()| Vec::new());
    for (i, &y) in luminance.into_floats().iter().enumerate() {
        let (column, row) = (i % width, i / width);
        let r = (red.at(column, row) + 1.0) * y;
        let b = (blue.at(column, row) + 1.0) * y;
        let g = (y - r * weights.x - b * weights.z) / weights.y;
        for (plane, sample) in colors.iter_mut().zip([r, g, b]) {
            plane.push(sample);
        }
    }
    Some(colors)
}

/// A plane of fewer pixels, whose samples stand at every so many-th pixel, the first included.
struct Chroma {
    width: usize,
    height: usize,
    sampling: (usize, usize),
    samples: Vec<f32>,
}

impl Chroma {
    fn of(plane: Plane) -> Self {
        let (width, sampling) = (plane.width, plane.sampling);
        let samples = plane.into_floats();
        Self {
            width,
            height: samples.len() / width,
            sampling,
            samples,
        }
    }

    fn at(&self, column: usize, row: usize) -> f32 {
        let cell = |at: usize, step: usize, size: usize| {
            let first = at / step;
            let part = (at % step) as f32 / step as f32;
            (first, (first + 1).min(size - 1), part)
        };
        let (x0, x1, fx) = cell(column, self.sampling.0, self.width);
        let (y0, y1, fy) = cell(row, self.sampling.1, self.height);
        let sample = |x: usize, y: usize| self.samples[y * self.width + x];
        let mix = |a: f32, b: f32, part: f32| a + (b - a) * part;
        let above = mix(sample(x0, y0), sample(x1, y0), fx);
        let below = mix(sample(x0, y1), sample(x1, y1), fx);
        mix(above, below, fy)
    }
}

/// What red, green and blue of the file's chromaticities make of white's luminance.
fn weights(header: &Header) -> DVec3 {
    let Some(c) = &header.shared_attributes.chromaticities else {
        return REC_709;
    };
    // XYZ of luminance 1.
    let [red, green, blue, white] = [c.red, c.green, c.blue, c.white].map(|at| {
        let (x, y) = (f64::from(at.0), f64::from(at.1));
        DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
    });
    let weights = glam::DMat3::from_cols(red, green, blue).inverse() * white;
    match weights.is_finite() && weights.y.abs() > 1e-6 {
        true => weights,
        false => REC_709,
    }
}

#[cfg(test)]
mod tests {
    use exr::meta::attribute::Chromaticities;
    use exr::prelude::{ImageAttributes, SmallVec, Vec2};

    use super::*;

    #[test]
    fn the_primaries_of_rec_709_have_its_weights() {
        let mut image = ImageAttributes::with_size((2, 2));
        image.chromaticities = Some(Chromaticities {
            red: Vec2(0.64, 0.33),
            green: Vec2(0.3, 0.6),
            blue: Vec2(0.15, 0.06),
            white: Vec2(0.3127, 0.329),
        });
        let header = Header::new("".into(), (2, 2), SmallVec::new());
        assert_eq!(weights(&header), REC_709);
        let header = header.with_shared_attributes(image);
        assert!((weights(&header) - REC_709).length() < 1e-3);
        assert!((weights(&header).element_sum() - 1.0).abs() < 1e-6);
    }
}
