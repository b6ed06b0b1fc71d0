//! How far a map displaces a mesh, where nobody said.

use crate::surface::{DisplacementMap, TexelKind};

/// A scale, the height that stays on the mesh, and why, if they were guessed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    /// World units from height 0 to height 1.
    pub scale: f32,
    pub midlevel: f32,
    pub why: Option<String>,
}

/// The part of the mesh's size that its relief is guessed to have.
const PART: f32 = 0.05;

/// The scale for a mesh of this size (its box's diagonal) under a map that the command line has `repeats` times on it; what is `given` is kept.
///
/// Heights from 0 to 1 mean no lengths: the difference of the highest and the lowest becomes 5 % of the size, over the repeats, since a map that is
/// laid on smaller has smaller features. Floats beyond are lengths,
/// as sculpting programs write them, if they make a relief of a sensible size; else (an elevation model in metres on a
/// plane of size 1) they are taken like any other heights, from the lowest up.
pub(super) fn guess(
    map: &DisplacementMap,
    size: f32,
    repeats: f32,
    given: (Option<f32>, Option<f32>),
) -> Scale {
    /// Parts of the size that the relief and the heights of lengths have.
    const SENSIBLE: std::ops::RangeInclusive<f32> = 1e-3..=0.5;
    let (scale, midlevel) = given;
    let (low, high) = map.range();
    if let Some(scale) = scale {
        return Scale {
            scale,
            midlevel: midlevel.unwrap_or(0.0),
            why: None,
        };
    }
    let relief = high - low;
    let beyond = map.kind() == TexelKind::F32 && (low < 0.0 || high > 1.0);
    let reach = low.abs().max(high.abs());
    if beyond && SENSIBLE.contains(&(relief / size)) && reach <= size {
        return Scale {
            scale: 1.0,
            midlevel: midlevel.unwrap_or(0.0),
            why: Some("guessed: the map's heights go beyond 0 to 1, so they are lengths".into()),
        };
    }
    // A flat map has no relief that could be scaled.
    let relief = if relief > 0.0 { relief } else { 1.0 };
    let lifted = beyond && !(low..=high).contains(&0.0);
    let usual = if lifted { low } else { 0.0 };
    let mut why = "guessed: relief of 5 % of the mesh's size".to_owned();
    if repeats > 1.0 {
        why += &format!(" over {repeats} repeats");
    }
    if lifted && midlevel.is_none() {
        why += ", from the lowest height up";
    }
    Scale {
        scale: two_digits(PART * size / (relief * repeats.max(1.0))),
        midlevel: midlevel.unwrap_or(usual),
        why: Some(why),
    }
}

/// Rounded for who reads it.
fn two_digits(x: f32) -> f32 {
    let rounded = format!("{x:.1e}").parse().ok();
    rounded.filter(|r: &f32| r.is_normal()).unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Texels, Wrap};

    fn map(texels: Texels) -> DisplacementMap {
        DisplacementMap::new(2, 1, texels, Wrap::Repeat).unwrap()
    }

    #[test]
    fn relief_is_a_part_of_the_size_whatever_heights_are_used() {
        let whole = guess(&map(Texels::U16(vec![0, 65535])), 2.0, 1.0, (None, None));
        assert_eq!((whole.scale, whole.midlevel), (0.1, 0.0));
        let often = guess(&map(Texels::U16(vec![0, 65535])), 2.0, 4.0, (None, None));
        assert_eq!(often.scale, 0.025);
        assert!(often.why.is_some_and(|why| why.contains("4 repeats")));
        let half = guess(&map(Texels::F32(vec![0.25, 0.75])), 2.0, 1.0, (None, None));
        assert_eq!(half.scale, 0.2);
        let flat = guess(&map(Texels::U8(vec![9, 9])), 2.0, 1.0, (None, Some(0.5)));
        assert_eq!((flat.scale, flat.midlevel), (0.1, 0.5));
    }

    #[test]
    fn floats_beyond_fractions_are_lengths_if_that_is_sensible() {
        let sculpted = guess(&map(Texels::F32(vec![-0.1, 0.2])), 2.0, 1.0, (None, None));
        assert_eq!((sculpted.scale, sculpted.midlevel), (1.0, 0.0));
        let metres = guess(
            &map(Texels::F32(vec![1000.0, 2000.0])),
            2.0,
            1.0,
            (None, None),
        );
        assert_eq!((metres.scale, metres.midlevel), (1e-4, 1000.0));
        let given = guess(
            &map(Texels::F32(vec![1000.0, 2000.0])),
            2.0,
            1.0,
            (Some(0.5), None),
        );
        assert_eq!((given.scale, given.midlevel, given.why), (0.5, 0.0, None));
    }
}
