//! A whole pyramid from the texels, on all cores.

use std::num::NonZero;
use std::sync::Arc;
use std::thread;

use super::axis::Axis;
use super::entries::{Entries, Pack};
use super::{Level, Order, reduce};

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
    let mut entries = Vec::new();
    let mut places = Vec::new();
    let mut rows = finest(texels, axes);
    for (level, &[x, y]) in shapes.iter().enumerate() {
        let (order, count) = Order::new(level, x.blocks(), y.blocks());
        let offset = entries.len();
        places.push((offset, order));
        entries.resize(offset + count, T::Packed::default());
        let stored = &mut entries[offset..];
        for (j, row) in rows.chunks_exact(x.blocks()).enumerate() {
            for (i, &pair) in row.iter().enumerate() {
                stored[order.index(i, j)] = pair;
            }
        }
        if level + 1 < shapes.len() {
            rows = coarser::<T>(&rows, [x, y]);
        }
    }
    entries.resize(entries.len() + Entries::TAIL, T::Packed::default());
    let entries = Arc::new(T::entries(entries));
    let levels = shapes.iter().zip(places);
    let level = |([x, y], (offset, order)): (&[Axis; 2], _)| Level {
        shift: [x.shift, y.shift],
        width: x.blocks(),
        height: y.blocks(),
        offset,
        order,
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
