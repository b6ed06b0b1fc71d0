//! The channels of a frame's file: how each is named, taken from a pixel, and put into one.

use super::pixel::{OBJECTS, Pixel, Share};
use super::slot::{ALL, Kind, Layout};
use crate::scene::Aov;

/// The Cryptomatte layer.
pub const OBJECT_LAYER: &str = "CryptoObject";

/// One channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// `samples.count`: samples in the means.
    Samples,
    /// `samples.hits`: those of them that hit anything.
    Hits,
    /// `samples.weight`: the sum of their signs.
    Weight,
    /// `samples.dropped`: samples left out.
    Dropped,
    /// The value of a sum.
    Value(usize),
    /// The upper half of the bits of a sum.
    High(usize),
    /// The lower half.
    Low(usize),
    /// Base triangle.
    Prim,
    /// Hash of the object of this rank.
    Hash(usize),
    /// What it covers of the pixel.
    Coverage(usize),
}

impl Column {
    /// The channels of a file, counts first: all else is read by them. `sums` adds the sums themselves.
    pub fn all(layout: &Layout, sums: bool) -> Vec<Self> {
        let mut all = vec![Self::Samples, Self::Hits, Self::Weight, Self::Dropped];
        let slots = layout.slots();
        let values = slots.iter().filter(|&&slot| ALL[slot].kind != Kind::Mean);
        all.extend(values.map(|&slot| Self::Value(slot)));
        if layout.aovs().has(Aov::Prim) {
            all.push(Self::Prim);
        }
        if layout.aovs().has(Aov::Object) {
            all.extend((0..OBJECTS).flat_map(|rank| [Self::Hash(rank), Self::Coverage(rank)]));
        }
        if sums {
            all.extend(
                slots
                    .iter()
                    .flat_map(|&slot| [Self::High(slot), Self::Low(slot)]),
            );
        }
        all
    }

    /// The channel's name.
    pub fn name(self) -> String {
        // Two objects per layer, each as hash and coverage.
        let object = |rank: usize, channel: [&str; 2]| {
            format!("{OBJECT_LAYER}{:02}.{}", rank / 2, channel[rank % 2])
        };
        match self {
            Self::Samples => "samples.count".into(),
            Self::Hits => "samples.hits".into(),
            Self::Weight => "samples.weight".into(),
            Self::Dropped => "samples.dropped".into(),
            Self::Value(slot) => ALL[slot].name.into(),
            Self::High(slot) => format!("sums.{}.hi", ALL[slot].name),
            Self::Low(slot) => format!("sums.{}.lo", ALL[slot].name),
            Self::Prim => "prim".into(),
            Self::Hash(rank) => object(rank, ["R", "B"]),
            Self::Coverage(rank) => object(rank, ["G", "A"]),
        }
    }

    /// Whether it is a channel of whole numbers.
    pub fn is_integer(self) -> bool {
        matches!(self, Self::High(_) | Self::Low(_) | Self::Prim)
    }

    /// A pixel's value, the bits of a float for channels of floats.
    pub fn get(self, pixel: &Pixel) -> u32 {
        let counts = &pixel.counts;
        let float = match self {
            Self::High(slot) => return (pixel.sums[slot].to_bits() >> 32) as u32,
            Self::Low(slot) => return pixel.sums[slot].to_bits() as u32,
            Self::Prim => return pixel.prim,
            Self::Hash(rank) => return pixel.objects[rank].object,
            Self::Coverage(rank) => pixel.objects[rank].hits as f32 / counts.samples.max(1) as f32,
            Self::Samples => counts.samples as f32,
            Self::Hits => counts.hits as f32,
            Self::Weight => counts.weight as f32,
            Self::Dropped => counts.dropped as f32,
            Self::Value(slot) => pixel.value(slot),
        };
        float.to_bits()
    }

    /// Puts a value into a pixel that has those of all columns before. `None` for a count that is none.
    pub fn set(self, bits: u32, pixel: &mut Pixel) -> Option<()> {
        /// Every whole number up to here is a float.
        const MOST: f32 = (1 << 24) as f32;
        let float = f32::from_bits(bits);
        let signed = || (float.fract() == 0.0 && float.abs() <= MOST).then_some(float as i32);
        let count = || u32::try_from(signed()?).ok();
        let half = |sum: f64, shift: u32| {
            let kept = sum.to_bits() & !(u64::from(u32::MAX) << shift);
            f64::from_bits(kept | u64::from(bits) << shift)
        };
        match self {
            Self::Samples => pixel.counts.samples = count()?,
            Self::Hits => pixel.counts.hits = count()?,
            Self::Weight => pixel.counts.weight = signed()?,
            Self::Dropped => pixel.counts.dropped = count()?,
            Self::Value(slot) => pixel.set_value(slot, float),
            Self::High(slot) => pixel.sums[slot] = half(pixel.sums[slot], 32),
            Self::Low(slot) => pixel.sums[slot] = half(pixel.sums[slot], 0),
            Self::Prim => pixel.prim = bits,
            Self::Hash(rank) => {
                pixel.objects[rank] = Share {
                    object: bits,
                    hits: 0,
                };
            }
            Self::Coverage(rank) => {
                let hits = (float.min(1.0) * pixel.counts.samples as f32).round();
                pixel.objects[rank].hits = hits as u32;
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::AovSet;

    const EVERY: AovSet = AovSet::ALL.with(Aov::Cost);

    #[test]
    fn names_are_those_of_the_documentation() {
        let docs = include_str!("../../../docs/render.md");
        let layout = Layout::new(EVERY);
        for column in Column::all(&layout, false) {
            let name = column.name();
            let (layer, channel) = name.rsplit_once('.').unwrap_or(("", &name));
            let layer = layer.replace("00", "").replace("01", "").replace("02", "");
            assert!(docs.contains(&layer) && docs.contains(channel), "{name}");
        }
    }

    #[test]
    fn names_differ() {
        let all = Column::all(&Layout::new(EVERY), true);
        let names: std::collections::HashSet<_> = all.iter().map(|c| c.name()).collect();
        assert_eq!(names.len(), all.len());
    }
}
