//! Names for the samples of a pixel.

use super::Fault;
use super::layout::Photometric;

/// Y or R, G, B; then A for alpha, and the number, from 1, of every other sample.
///
/// Three and more bands of heights are R, G, B too, unless the second or third is declared to be alpha. A single sample
/// beside the colours is A whatever it is declared to be: the tag that says so is often missing or unspecific.
pub(super) fn names(
    photometric: &Photometric,
    extra: &[u64],
    samples: usize,
) -> Result<Vec<String>, Fault> {
    // What follows the samples that the photometric interpretation speaks of.
    let declared = match photometric {
        Photometric::Rgb | Photometric::YCbCr => 3,
        Photometric::WhiteIsZero | Photometric::BlackIsZero | Photometric::Palette(_) => 1,
    };
    if samples < declared {
        return Err(Fault::broken(format!(
            "{samples} samples per pixel in a picture of {declared} colours"
        )));
    }
    // 1 is associated alpha, 2 is unassociated.
    let is_alpha = |sample: usize| {
        let extra = sample.checked_sub(declared).and_then(|i| extra.get(i));
        matches!(extra, Some(1 | 2))
    };
    let colors: &[&str] = match declared {
        1 if samples < 3 || is_alpha(1) || is_alpha(2) => &["Y"],
        _ => &["R", "G", "B"],
    };
    let alpha = match samples - colors.len() {
        1 => Some(colors.len()),
        _ => (colors.len()..samples).find(|&sample| is_alpha(sample)),
    };
    let name = |sample: usize| match colors.get(sample) {
        Some(&color) => color.to_owned(),
        None if alpha == Some(sample) => "A".to_owned(),
        None => (sample + 1).to_string(),
    };
    Ok((0..samples).map(name).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_of(photometric: &Photometric, extra: &[u64], samples: usize) -> String {
        names(photometric, extra, samples).unwrap().join(" ")
    }

    #[test]
    fn samples_are_named_by_what_they_are_declared_to_be() {
        let grey = &Photometric::BlackIsZero;
        assert_eq!(names_of(grey, &[], 1), "Y");
        assert_eq!(names_of(grey, &[2], 2), "Y A");
        assert_eq!(names_of(grey, &[0], 2), "Y A");
        assert_eq!(names_of(grey, &[0, 0], 3), "R G B");
        assert_eq!(names_of(grey, &[2, 0], 3), "Y A 3");
        assert_eq!(names_of(grey, &[0, 0, 2], 4), "R G B A");
        assert_eq!(names_of(grey, &[], 6), "R G B 4 5 6");
        let rgb = &Photometric::Rgb;
        assert_eq!(names_of(rgb, &[], 3), "R G B");
        assert_eq!(names_of(rgb, &[0], 4), "R G B A");
        assert_eq!(names_of(rgb, &[0, 1], 5), "R G B 4 A");
        assert!(names(rgb, &[], 2).is_err());
    }
}
