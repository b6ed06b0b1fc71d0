//! A picture in the making: the sums of all its pixels.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use glam::{UVec2, Vec3};

use super::error::FrameError;
use super::objects::Objects;
use super::pixel::{Counts, OBJECTS, Pixel, Share};
use super::slot::Layout;
use crate::scene::{Adaptive, Aov, Film, Window};

/// A picture in the making. It can be put down at any sample of any pixel, and taken up again to end in the same bits.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    window: Window,
    samples: Range<u32>,
    adaptive: Option<Adaptive>,
    layout: Arc<Layout>,
    objects: Arc<Objects>,
    counts: Vec<Counts>,
    /// Per pixel, the sums that the layout keeps.
    sums: Vec<f64>,
    /// Empty where the layout keeps none.
    shares: Vec<[Share; OBJECTS]>,
    prims: Vec<u32>,
}

impl Frame {
    /// The window of `film` without any sample; it will get those of numbers `samples`, which is not empty.
    pub fn new(film: &Film, samples: Range<u32>, objects: Objects) -> Self {
        let layout = Arc::new(Layout::of(film));
        Self::empty(
            film.window(),
            samples,
            film.adaptive,
            layout,
            Arc::new(objects),
        )
    }

    pub(super) fn empty(
        window: Window,
        samples: Range<u32>,
        adaptive: Option<Adaptive>,
        layout: Arc<Layout>,
        objects: Arc<Objects>,
    ) -> Self {
        let pixels = window.pixels();
        let none = Pixel::default();
        let aovs = layout.aovs();
        let kept = |aov| if aovs.has(aov) { pixels } else { 0 };
        Self {
            counts: vec![none.counts; pixels],
            sums: vec![0.0; pixels * layout.slots().len()],
            shares: vec![none.objects; kept(Aov::Object)],
            prims: vec![none.prim; kept(Aov::Prim)],
            window,
            samples,
            adaptive,
            layout,
            objects,
        }
    }

    /// The same, of another window, without samples.
    pub(super) fn empty_part(&self, window: Window) -> Self {
        Self::empty(
            window,
            self.samples.clone(),
            self.adaptive,
            self.layout.clone(),
            self.objects.clone(),
        )
    }

    /// The pixels there are.
    pub fn window(&self) -> Window {
        self.window
    }

    /// The numbers of the samples that every pixel is to get.
    pub fn samples(&self) -> &Range<u32> {
        &self.samples
    }

    pub(super) fn layout(&self) -> &Layout {
        &self.layout
    }

    pub(super) fn objects(&self) -> &Objects {
        &self.objects
    }

    pub(super) fn set_samples(&mut self, samples: Range<u32>) {
        self.samples = samples;
    }

    /// Takes a frame that was read from a file up again, for the film and the objects it was begun with.
    pub fn go_on_with(&mut self, film: &Film, objects: Objects) {
        self.adaptive = film.adaptive;
        self.objects = Arc::new(objects);
    }

    /// Fails unless the frame of the file at `path` keeps the same sums as `other`.
    pub(super) fn check_channels(
        &self,
        path: &Path,
        other: &Self,
        other_path: &Path,
    ) -> Result<(), FrameError> {
        if self.layout == other.layout {
            return Ok(());
        }
        Err(FrameError::Differs {
            path: path.to_owned(),
            other: other_path.to_owned(),
            what: "aovs".into(),
            found: self.layout.aovs().to_string(),
            expected: other.layout.aovs().to_string(),
        })
    }

    /// Whether every pixel has what it is to get.
    pub fn is_complete(&self) -> bool {
        (0..self.counts.len()).all(|index| self.next_sample(&self.pixel(index)).is_none())
    }

    /// The number of the sample that `pixel` is to get next.
    pub(super) fn next_sample(&self, pixel: &Pixel) -> Option<u32> {
        let next = self.samples.start + pixel.counts.taken();
        let ends = |adaptive| super::adaptive::converged(pixel, adaptive);
        (self.samples.contains(&next) && !self.adaptive.as_ref().is_some_and(ends)).then_some(next)
    }

    /// Samples taken, over all pixels.
    pub fn taken(&self) -> u64 {
        self.counts.iter().map(|c| u64::from(c.taken())).sum()
    }

    /// Samples of these numbers that pixels have not got, over all pixels; those that converged pixels will not get are among them.
    pub fn lacks(&self, samples: &Range<u32>) -> u64 {
        let lack = |counts: &Counts| {
            let next = self.samples.start + counts.taken();
            u64::from(samples.end.saturating_sub(next.max(samples.start)))
        };
        self.counts.iter().map(lack).sum()
    }

    /// Samples that were NaN or infinite.
    pub fn dropped(&self) -> u64 {
        self.counts.iter().map(|c| u64::from(c.dropped)).sum()
    }

    /// Linear radiance of the pixels, row by row from the top; black where there is none.
    pub fn radiance(&self) -> Vec<Vec3> {
        // Every layout begins with these three.
        let sums = self.sums.chunks_exact(self.layout.slots().len());
        let pixels = self.counts.iter().zip(sums);
        let radiance = |(counts, sums): (&Counts, &[f64])| {
            Vec3::from([0, 1, 2].map(|slot| counts.value(slot, sums[slot])))
        };
        pixels.map(radiance).collect()
    }

    /// Samples in the means of the pixels, row by row from the top.
    pub fn sample_counts(&self) -> Vec<u32> {
        self.counts.iter().map(|counts| counts.samples).collect()
    }

    /// Takes all samples away.
    pub(in crate::render) fn clear(&mut self) {
        let none = Pixel::default();
        self.counts.fill(none.counts);
        self.sums.fill(0.0);
        self.shares.fill(none.objects);
        self.prims.fill(none.prim);
    }

    /// The pixel of this index, row by row from the top.
    pub(in crate::render) fn pixel(&self, index: usize) -> Pixel {
        let mut pixel = Pixel {
            counts: self.counts[index],
            ..Pixel::default()
        };
        let slots = self.layout.slots();
        let sums = &self.sums[index * slots.len()..][..slots.len()];
        for (&slot, &sum) in slots.iter().zip(sums) {
            pixel.sums[slot] = sum;
        }
        if let Some(shares) = self.shares.get(index) {
            pixel.objects = *shares;
        }
        if let Some(prim) = self.prims.get(index) {
            pixel.prim = *prim;
        }
        pixel
    }

    pub(super) fn set_pixel(&mut self, index: usize, pixel: &Pixel) {
        self.counts[index] = pixel.counts;
        let slots = self.layout.slots();
        let sums = &mut self.sums[index * slots.len()..][..slots.len()];
        for (&slot, sum) in slots.iter().zip(sums) {
            *sum = pixel.sums[slot];
        }
        if let Some(shares) = self.shares.get_mut(index) {
            *shares = pixel.objects;
        }
        if let Some(prim) = self.prims.get_mut(index) {
            *prim = pixel.prim;
        }
    }

    /// A copy of what it has of `window`, which is inside its own.
    pub(in crate::render) fn part(&self, window: Window) -> Self {
        let mut part = self.empty_part(window);
        for (index, pixel) in pixels(window).enumerate() {
            if let Some(here) = self.window.index(pixel) {
                part.set_pixel(index, &self.pixel(here));
            }
        }
        part
    }

    /// Takes over the pixels of a part.
    pub(in crate::render) fn place(&mut self, part: &Self) {
        for (index, pixel) in pixels(part.window).enumerate() {
            if let Some(here) = self.window.index(pixel) {
                self.set_pixel(here, &part.pixel(index));
            }
        }
    }

    /// Adds the samples of another frame, which come after those of this one, pixel by pixel.
    pub(super) fn merge(&mut self, other: &Self) {
        for (index, pixel) in pixels(other.window).enumerate() {
            if let Some(here) = self.window.index(pixel) {
                let mut merged = self.pixel(here);
                merged.merge(&other.pixel(index));
                self.set_pixel(here, &merged);
            }
        }
    }
}

#[cfg(test)]
impl Frame {
    /// Whether all sums and counts are the same, to the bit.
    pub(super) fn sums_are(&self, other: &Self) -> bool {
        self.counts == other.counts && self.sums == other.sums && self.prims == other.prims
    }
}

/// The pixels of a window, row by row from the top.
pub(super) fn pixels(window: Window) -> impl Iterator<Item = UVec2> {
    (window.start.y..window.end.y)
        .flat_map(move |y| (window.start.x..window.end.x).map(move |x| UVec2::new(x, y)))
}
