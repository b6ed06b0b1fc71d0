//! Pixar's tags for subdivision: `t crease 2/1/0 0 1 2.5`, `t corner 1/1/0 7 10`.
//!
//! A tag's name is followed by how many whole numbers, numbers and words there are. Vertices count from 0, as nowhere else in the format. A crease may
//! go over more than two vertices, and has one sharpness for all of its edges or one for each.

use glam::Vec3;

use super::super::{FileSharpness, text};

/// Adds what a tag says; `None` if it cannot be read. Tags of other names say nothing here.
pub(super) fn read(tag: &[u8], positions: &[Vec3], sharpness: &mut FileSharpness) -> Option<()> {
    let (name, rest) = text::split_word(tag);
    if name != b"crease" && name != b"corner" {
        return Some(());
    }
    let (counts, rest) = text::split_word(rest);
    let mut counts = counts.split(|&b| b == b'/').map(text::parse::<usize>);
    let (vertices, numbers) = (counts.next()??, counts.next()??);
    let mut words = text::words(rest);
    let mut ends = Vec::new();
    for _ in 0..vertices {
        ends.push(*positions.get(text::parse::<usize>(words.next()?)?)?);
    }
    let mut values = Vec::new();
    for _ in 0..numbers {
        values.push(text::parse(words.next()?).filter(|s: &f32| *s >= 0.0)?);
    }
    let of = |place: usize| values.get(place).or(values.first()).copied();
    if name == b"corner" {
        for (place, &vertex) in ends.iter().enumerate() {
            sharpness.corners.push((vertex, of(place)?));
        }
    } else {
        for (place, pair) in ends.windows(2).enumerate() {
            sharpness.creases.push(([pair[0], pair[1]], of(place)?));
        }
    }
    Some(())
}
