//! A whole pyramid from the texels, on all cores.

use std::num::NonZero;
use std::sync::Arc;
use std::thread;

use super::axis::Axis;
use super::entries::{Entries, Pack};
use super::{Level, reduce};

/// Below so many entries a level is made on one thread.
const PARALLEL: usize = (256 / reduce::WIDTH) * (256 / reduce::HEIGHT);

/// The levels over texels of sides `x` and `y`, whose shifts are those of the finest level. On how many threads
/// they are made changes nothing in them.
pub fn levels<T: Pack>(texels: &[T], axes: [Axis; 2]) -> Vec<Level> {
    let mut shapes = vec![axes];
    let mut last = axes;
    while last.map(Axis::blocks) != [1, 1] {
        last = last.map(Axis::coarser);
        shapes.push(last);
    }
    let size = |[x, y]: &[Axis; 2]| x.blocks() * y.blocks();
    let mut entries = Vec::with_capacity(shapes.iter().map(size).sum::<usize>() + Entries::TAIL);
    entries.extend(finest(texels, axes));
    let mut offsets = vec![0];
    for (axes, finer) in shapes[1..].iter().zip(&shapes) {
        let offset = entries.len();
        let next = coarser::<T>(&entries[offset - size(finer)..], *finer);
        debug_assert_eq!(next.len(), size(axes));
        entries.extend(next);
        offsets.push(offset);
    }
    entries.resize(entries.len() + Entries::TAIL, T::Packed::default());
    let entries = Arc::new(T::entries(entries));
    let levels = shapes.iter().zip(offsets);
    let level = |([x, y], offset): (&[Axis; 2], usize)| Level {
        shift: [x.shift, y.shift],
        width: x.blocks(),
        height: y.blocks(),
        offset,
        entries: entries.clone(),
    };
    levels.map(level).collect()
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
            for (i, out) in row.iter_mut().enumerate() {
                *out = T::pack(reduce::coarser(axes, (i, j), entry));
            }
        }
    })
}

/// The entries of a level; `fill` is given a first row and a slice of whole rows, in parallel.
fn in_bands<E: Copy + Default + Send>(
    [x, y]: [Axis; 2],
    fill: impl Fn(usize, &mut [E]) + Sync,
) -> Vec<E> {
    let (width, height) = (x.blocks(), y.blocks());
    let count = width * height;
    let mut entries = vec![E::default(); count];
    let threads = if count < PARALLEL {
        1
    } else {
        thread::available_parallelism().map_or(1, NonZero::get)
    };
    if threads == 1 {
        fill(0, &mut entries);
        return entries;
    }
    let rows = height.div_ceil(threads);
    thread::scope(|scope| {
        let bands = entries.chunks_mut(rows * width);
        for (k, band) in bands.enumerate() {
            let fill = &fill;
            scope.spawn(move || fill(k * rows, band));
        }
    });
    entries
}
