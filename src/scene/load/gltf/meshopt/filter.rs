//! Filters: what the elements of mode ATTRIBUTES are turned into once they are decoded.

use std::f32::consts::FRAC_1_SQRT_2;

use super::MeshoptFilter;

/// Turns elements of `stride` bytes into what they stand for, in place.
pub(super) fn apply(filter: MeshoptFilter, bytes: &mut [u8], stride: usize) -> Result<(), String> {
    match (filter, stride) {
        (MeshoptFilter::None, _) => {}
        (MeshoptFilter::Octahedral, 4) => {
            for element in bytes.as_chunks_mut::<4>().0 {
                let [x, y, one, rest] = element.map(|b| f32::from(b.cast_signed()));
                let n = octahedral(x, y, one, 127.0).map(|c| (c as i8).cast_unsigned());
                *element = [n[0], n[1], n[2], (rest as i8).cast_unsigned()];
            }
        }
        (MeshoptFilter::Octahedral, 8) => each_four_shorts(bytes, |[x, y, one, rest]| {
            let [x, y, z] = octahedral(x.into(), y.into(), one.into(), 32767.0);
            [x as i16, y as i16, z as i16, rest]
        }),
        (MeshoptFilter::Quaternion, 8) => each_four_shorts(bytes, quaternion),
        (MeshoptFilter::Exponential, _) => {
            for word in bytes.as_chunks_mut::<4>().0 {
                let code = i32::from_le_bytes(*word);
                let (exponent, mantissa) = (code >> 24, code << 8 >> 8);
                let value = f64::from(mantissa) * 2_f64.powi(exponent);
                *word = (value as f32).to_le_bytes();
            }
        }
        (MeshoptFilter::Color, _) => {
            return Err("the filter COLOR, which no attribute that is read here has".into());
        }
        (filter, stride) => {
            return Err(format!(
                "the filter {filter:?} on elements of {stride} bytes"
            ));
        }
    }
    Ok(())
}

fn each_four_shorts(bytes: &mut [u8], turn: impl Fn([i16; 4]) -> [i16; 4]) {
    for element in bytes.as_chunks_mut::<8>().0 {
        let [a, b, c, d, e, f, g, h] = *element;
        let shorts = [[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes);
        for (to, short) in element.as_chunks_mut::<2>().0.iter_mut().zip(turn(shorts)) {
            *to = short.to_le_bytes();
        }
    }
}

/// A unit vector, times `unit` and rounded, from a place on the unfolded octahedron; `one` is its corner.
fn octahedral(x: f32, y: f32, one: f32, unit: f32) -> [f32; 3] {
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half is folded outward.
    let fold = (-z).max(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let scale = unit / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|c| (c * scale).round())
}

/// Three components of a unit quaternion, scaled to their largest possible value; the fourth, the largest of all, follows. The low
/// bits of the last number say which it is, the others what the largest value was stored as.
fn quaternion([a, b, c, code]: [i16; 4]) -> [i16; 4] {
    let scale = FRAC_1_SQRT_2 / f32::from(code | 3);
    let [a, b, c] = [a, b, c].map(|x| f32::from(x) * scale);
    let largest = (1.0 - a * a - b * b - c * c).max(0.0).sqrt();
    let mut q = [a, b, c, largest].map(|x| (x * 32767.0).round() as i16);
    // Stored cyclically from the one after the largest.
    q.rotate_right((usize::from(code.cast_unsigned()) + 1) % 4);
    q
}
