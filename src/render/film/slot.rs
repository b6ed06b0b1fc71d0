//! The sums that a pixel keeps, and under which names files have them.

use crate::scene::{Aov, AovSet, Film};

/// What a sum is divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Counts as the filter says: over the sum of the weights.
    Filtered,
    /// A property of points: over the samples that hit anything.
    OfHits,
    /// No sum: the mean of all samples so far, whatever the filter.
    Mean,
    /// Squared deviations from that mean: over one less than the samples.
    Deviations,
}

/// One of the sums.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// The channel, `layer.channel` as OpenEXR has it.
    pub name: &'static str,
    /// What asks for it; `None` for the picture itself.
    pub aov: Option<Aov>,
    /// How it becomes a value.
    pub kind: Kind,
}

/// Number of sums.
pub const SLOTS: usize = ALL.len();
/// The place of the cost in [`ALL`].
pub const COST: usize = 17;
/// The place of the three means in [`ALL`]; their deviations follow.
pub const MEANS: usize = 18;
/// The place of the squared deviations in [`ALL`].
pub const DEVIATIONS: usize = 21;

/// All sums, in the order of [`super::pixel::Pixel`].
pub const ALL: [Slot; 24] = {
    use Kind::{Deviations, Filtered, Mean, OfHits};
    const fn slot(name: &'static str, aov: Option<Aov>, kind: Kind) -> Slot {
        Slot { name, aov, kind }
    }
    [
        slot("R", None, Filtered),
        slot("G", None, Filtered),
        slot("B", None, Filtered),
        slot("A", None, Filtered),
        slot("albedo.R", Some(Aov::Albedo), Filtered),
        slot("albedo.G", Some(Aov::Albedo), Filtered),
        slot("albedo.B", Some(Aov::Albedo), Filtered),
        slot("N.X", Some(Aov::Normal), OfHits),
        slot("N.Y", Some(Aov::Normal), OfHits),
        slot("N.Z", Some(Aov::Normal), OfHits),
        slot("P.X", Some(Aov::Position), OfHits),
        slot("P.Y", Some(Aov::Position), OfHits),
        slot("P.Z", Some(Aov::Position), OfHits),
        slot("Z", Some(Aov::Depth), OfHits),
        slot("UV.U", Some(Aov::Uv), OfHits),
        slot("UV.V", Some(Aov::Uv), OfHits),
        slot("displacement", Some(Aov::Displacement), OfHits),
        slot("cost", Some(Aov::Cost), Filtered),
        slot("mean.R", Some(Aov::Variance), Mean),
        slot("mean.G", Some(Aov::Variance), Mean),
        slot("mean.B", Some(Aov::Variance), Mean),
        slot("variance.R", Some(Aov::Variance), Deviations),
        slot("variance.G", Some(Aov::Variance), Deviations),
        slot("variance.B", Some(Aov::Variance), Deviations),
    ]
};

/// Which sums are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    aovs: AovSet,
    slots: Vec<usize>,
}

impl Layout {
    /// The sums for these AOVs.
    pub fn new(aovs: AovSet) -> Self {
        let kept = |slot: &Slot| slot.aov.is_none_or(|aov| aovs.has(aov));
        let slots = (0..SLOTS).filter(|&index| kept(&ALL[index])).collect();
        Self { aovs, slots }
    }

    /// The sums that a picture of `film` takes: adaptive sampling looks at the variance.
    pub fn of(film: &Film) -> Self {
        Self::new(match film.adaptive {
            Some(_) => film.aovs.with(Aov::Variance),
            None => film.aovs,
        })
    }

    /// What is kept beside the picture.
    pub fn aovs(&self) -> AovSet {
        self.aovs
    }

    /// Indices into [`ALL`] of the sums that are kept, in rising order.
    pub fn slots(&self) -> &[usize] {
        &self.slots
    }
}
