//! How the dragon's parts share one map: bands across it, each a tube's full turn of u.
//!
//! All body segments share three bands in turn. Heights are constant near both ends of a band and between
//! the bands' inner edges and their gutters, so that neighbouring segments agree on the ring where they meet.

use glam::Vec2;

use crate::demo::sweep::Chart;

/// A part of the map with a pattern of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Band {
    /// One segment of the body; three variants.
    Body(u32),
    /// Segments of the tail, and the legs: the same pattern, shallower.
    Tail(u32),
    /// The upper head, from the neck to the snout.
    Skull,
    /// The lower jaw.
    Jaw,
    /// Horns, spines, teeth and such: cells along u.
    Trim,
}

/// What a cell of the trim band is for; its heights depend on v alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trim {
    /// Ringed ivory.
    Horn,
    /// Crimson, paler at the tip.
    Spine,
    /// Polished white.
    Tooth,
    /// Golden threads.
    Whisker,
    /// White, iris, pupil, from back to front.
    Eye,
    /// Red and smooth.
    Tongue,
    /// The pearl that the dragon is after.
    Pearl,
    /// Dark claws.
    Claw,
}

const TRIMS: [Trim; 8] = [
    Trim::Horn,
    Trim::Spine,
    Trim::Tooth,
    Trim::Whisker,
    Trim::Eye,
    Trim::Tongue,
    Trim::Pearl,
    Trim::Claw,
];

/// Bands from the bottom of the map upward, with their upper ends.
const BANDS: [(Band, f32); 8] = [
    (Band::Body(0), 0.18),
    (Band::Body(1), 0.36),
    (Band::Body(2), 0.54),
    (Band::Tail(0), 0.62),
    (Band::Tail(1), 0.67),
    (Band::Skull, 0.85),
    (Band::Jaw, 0.93),
    (Band::Trim, 1.0),
];

/// Kept free on every side of a chart.
const GUTTER: f32 = 0.004;

fn range(band: Band) -> [f32; 2] {
    let index = BANDS.iter().position(|&(b, _)| b == band).unwrap_or(0);
    let low = if index == 0 { 0.0 } else { BANDS[index - 1].1 };
    [low + GUTTER, BANDS[index].1 - GUTTER]
}

/// The chart of a full band.
pub(super) fn chart(band: Band) -> Chart {
    Chart {
        u: [0.0, 1.0],
        v: range(band),
    }
}

/// The chart of a cell of the trim band.
pub(super) fn trim_chart(trim: Trim) -> Chart {
    let cell = 1.0 / TRIMS.len() as f32;
    let index = TRIMS.iter().position(|&t| t == trim).unwrap_or(0) as f32;
    Chart {
        u: [cell * index + GUTTER, cell * (index + 1.0) - GUTTER],
        v: range(Band::Trim),
    }
}

/// Which band a point of the map lies in, and how far along it: 0 at its chart's start, 1 at its end,
/// held there in the gutters.
pub(super) fn locate(st: Vec2) -> (Band, f32) {
    let band = BANDS
        .iter()
        .find(|&&(_, end)| st.y < end)
        .map_or(Band::Trim, |&(band, _)| band);
    let [low, high] = range(band);
    (band, ((st.y - low) / (high - low)).clamp(0.0, 1.0))
}

/// Which trim a column of the trim band belongs to.
pub(super) fn trim_at(u: f32) -> Trim {
    let count = TRIMS.len();
    TRIMS[((u * count as f32) as usize).min(count - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_lie_where_they_are_located() {
        for (band, _) in BANDS {
            let v = chart(band).v;
            for (v, along) in [(v[0], 0.0), (v[1], 1.0)] {
                let (found, t) = locate(Vec2::new(0.3, v));
                assert_eq!(found, band);
                assert!((t - along).abs() < 1e-4);
            }
        }
        for trim in TRIMS {
            let u = trim_chart(trim).u;
            assert_eq!((trim_at(u[0]), trim_at(u[1])), (trim, trim));
        }
    }
}
