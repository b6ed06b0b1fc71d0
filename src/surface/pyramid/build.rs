//! A whole pyramid from the texels, on all cores.

use std::num::NonZero;
use std::thread;

use super::axis::Axis;
use super::entries::{Entries, Pack};
use super::{Level, reduce};

/// Below so many entries a level is made on one thread.
const PARALLEL: usize = (256 / reduce::SIDE) * (256 / reduce::SIDE);

/// The levels over texels of sides `x` and `y`, whose shifts are those of the finest level. On how many threads
/// they are made changes nothing in them.
pub fn levels<T: Pack>(texels: &[T], axes: [Axis; 2]) -> Vec<Level> {
    let mut axes = axes;
    let mut last = finest(texels, axes);
    let mut levels = Vec::new();
    while axes.map(Axis::blocks) != [1, 1] {
        let next = coarser::<T>(&last, axes);
        levels.push(level::<T>(last, axes));
        (last, axes) = (next, axes.map(Axis::coarser));
    }
    levels.push(level::<T>(last, axes));
    levels
}

fn level<T: Pack>(packed: Vec<T::Packed>, [x, y]: [Axis; 2]) -> Level {
    Level {
        shift: x.shift,
        width: x.blocks(),
        height: y.blocks(),
        entries: T::entries(packed),
    }
}

fn finest<T: Pack>(texels: &[T], [x, y]: [Axis; 2]) -> Vec<T::Packed> {
    let row = |j: usize| {
        let start = y.wrap.texel(j as i64, y.texels) * x.texels;
        &texels[start..start + x.texels]
    };
    let length = reduce::columns(x.blocks());
    let source = |i: usize| x.wrap.texel(i as i64, x.texels);
    in_bands([x, y], |first, band: &mut [T::Packed]| {
        let rows = first..first + band.len() / x.blocks();
        reduce::finest(rows, length, row, source, |j, strip| {
            let out = &mut band[(j - first) * x.blocks()..][..x.blocks()];
            for (out, bounds) in out.iter_mut().zip(strip.entries()) {
                *out = T::pack(bounds);
            }
        });
    })
}

fn coarser<T: Pack>(finer: &[T::Packed], axes: [Axis; 2]) -> Vec<T::Packed> {
    let width = axes[0].blocks();
    let next = axes.map(Axis::coarser);
    in_bands(next, |first, band: &mut [T::Packed]| {
        for (j, row) in (first..).zip(band.chunks_mut(next[0].blocks())) {
            let entry = |i: usize, j: usize| T::unpack(finer[j * width + i]);
            reduce::coarser_row(axes, j, entry, row);
        }
    })
}

/// The entries of a level and its tail; `fill` is given a first row and a slice of whole rows, in parallel.
fn in_bands<E: Copy + Default + Send>(
    [x, y]: [Axis; 2],
    fill: impl Fn(usize, &mut [E]) + Sync,
) -> Vec<E> {
    let (width, height) = (x.blocks(), y.blocks());
    let count = width * height;
    let mut entries = Vec::with_capacity(count + Entries::TAIL);
    entries.resize(count + Entries::TAIL, E::default());
    let threads = if count < PARALLEL {
        1
    } else {
        thread::available_parallelism().map_or(1, NonZero::get)
    };
    if threads == 1 {
        fill(0, &mut entries[..count]);
        return entries;
    }
    let rows = height.div_ceil(threads);
    thread::scope(|scope| {
        let bands = entries[..count].chunks_mut(rows * width);
        for (k, band) in bands.enumerate() {
            let fill = &fill;
            scope.spawn(move || fill(k * rows, band));
        }
    });
    entries
}
