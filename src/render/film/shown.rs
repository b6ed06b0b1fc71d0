//! What a viewer is shown of a picture in the making.

use super::frame::Frame;
use super::slot::{ALL, Slot};
use crate::scene::Aov;

impl Frame {
    /// The channels that a viewer is shown, under the names that EXR files have for them: radiance and alpha, then albedo and normals
    /// where those are kept.
    pub fn shown_channels(&self) -> Vec<&'static str> {
        self.shown_slots().map(|slot| ALL[slot].name).collect()
    }

    /// The values of these channels as an EXR file would have them, pixel after pixel, row by row from the top.
    pub fn shown_values(&self) -> Vec<f32> {
        let slots: Vec<usize> = self.shown_slots().collect();
        let pixels = self.window().pixels();
        let mut values = Vec::with_capacity(pixels * slots.len());
        for index in 0..pixels {
            let pixel = self.pixel(index);
            values.extend(slots.iter().map(|&slot| pixel.value(slot)));
        }
        values
    }

    fn shown_slots(&self) -> impl Iterator<Item = usize> {
        let is_shown =
            |slot: &Slot| matches!(slot.aov, None | Some(Aov::Albedo) | Some(Aov::Normal));
        let slots = self.layout().slots().iter().copied();
        slots.filter(move |&slot| is_shown(&ALL[slot]))
    }
}
