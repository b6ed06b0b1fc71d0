//! How far D and its slopes can go over a rectangle of texel coordinates, by looking at every cell.

use glam::DVec2;
use prismarch::surface::{DisplacedSurface, Wrap};

use super::interval::Interval;

/// Rectangles of more cells than this get the bounds of the whole map.
const MOST_CELLS: i64 = 64;

/// Cells that a rectangle misses by less than this count too: whoever samples rounds.
const SLACK: f64 = 1e-9;

/// D at the texel centres of one period of the map.
pub struct Heights {
    wrap: Wrap,
    /// Columns and rows of a period; with wrap mode clamp those of the map.
    columns: i64,
    rows: i64,
    displacements: Vec<f64>,
    everywhere: Bounds,
}

/// Bounds of D and of its derivatives by the texel coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub d: Interval,
    pub dx: Interval,
    pub dy: Interval,
}

impl Heights {
    pub fn new(surface: &DisplacedSurface) -> Self {
        let (map, displacement) = (surface.map(), surface.displacement());
        let (width, height) = map.size();
        let periods = if map.wrap() == Wrap::Mirror { 2 } else { 1 };
        let (columns, rows) = ((periods * width) as i64, (periods * height) as i64);
        let at = |k: i64| {
            let centre = DVec2::new((k % columns) as f64, (k / columns) as f64);
            f64::from(displacement.scale)
                * (map.sample(centre).height - f64::from(displacement.midlevel))
        };
        let mut heights = Self {
            wrap: map.wrap(),
            columns,
            rows,
            displacements: (0..columns * rows).map(at).collect(),
            everywhere: NOWHERE,
        };
        heights.everywhere = heights.scan([0, columns - 1], [0, rows - 1], None);
        heights
    }

    /// The range of D anywhere.
    pub fn range(&self) -> Interval {
        self.everywhere.d
    }

    /// Bounds over the rectangle of `radius` around `middle`.
    pub fn bounds(&self, middle: DVec2, radius: DVec2) -> Bounds {
        let (low, high) = (middle - radius - SLACK, middle + radius + SLACK);
        let cells = (high.floor() - low.floor() + 1.0).element_product();
        if cells > MOST_CELLS as f64 {
            return self.everywhere;
        }
        let range = |low: f64, high: f64| [low.floor() as i64, high.floor() as i64];
        self.scan(
            range(low.x, high.x),
            range(low.y, high.y),
            Some([low, high]),
        )
    }

    /// Bounds over cells, or over the part of them inside a rectangle. D itself is bounded over whole cells.
    fn scan(&self, columns: [i64; 2], rows: [i64; 2], rectangle: Option<[DVec2; 2]>) -> Bounds {
        let mut bounds = NOWHERE;
        let part = |cell: i64, low: f64, high: f64| {
            let part = |x: f64| (x - cell as f64).clamp(0.0, 1.0);
            [part(low), part(high)]
        };
        for j in rows[0]..=rows[1] {
            let mut left = [self.at(columns[0], j), self.at(columns[0], j + 1)];
            for i in columns[0]..=columns[1] {
                let right = [self.at(i + 1, j), self.at(i + 1, j + 1)];
                let (xs, ys) = rectangle.map_or(([0.0, 1.0], [0.0, 1.0]), |[low, high]| {
                    (part(i, low.x, high.x), part(j, low.y, high.y))
                });
                for h in [left[0], left[1], right[0], right[1]] {
                    bounds.d = bounds.d.including(h);
                }
                for [x, y] in [[xs[0], ys[0]], [xs[1], ys[1]]] {
                    let (bottom, top) = (right[0] - left[0], right[1] - left[1]);
                    bounds.dx = bounds.dx.including(bottom + y * (top - bottom));
                    let (west, east) = (left[1] - left[0], right[1] - right[0]);
                    bounds.dy = bounds.dy.including(west + x * (east - west));
                }
                left = right;
            }
        }
        bounds
    }

    fn at(&self, i: i64, j: i64) -> f64 {
        let (i, j) = if self.wrap == Wrap::Clamp {
            (i.clamp(0, self.columns - 1), j.clamp(0, self.rows - 1))
        } else {
            (i.rem_euclid(self.columns), j.rem_euclid(self.rows))
        };
        self.displacements[(j * self.columns + i) as usize]
    }
}

const NOWHERE: Bounds = Bounds {
    d: Interval::NONE,
    dx: Interval::NONE,
    dy: Interval::NONE,
};
