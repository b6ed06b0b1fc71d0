//! A base triangle cut into blocks.
//!
//! Blocks never lie across the edge of a period of the map, and begin where an entry of the map's second table level does; so a
//! block's leaves are the map's, wherever the triangle lies.

use glam::DVec2;

use super::{Block, Record, SIDE};
use crate::surface::{DisplacementMap, Patch};

/// Cuts the triangles of one surface.
pub struct Cutter {
    size: [i64; 2],
}

/// Why a triangle is one primitive, without blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Whole;

/// Blocks that a triangle may have at most.
const MOST_BLOCKS: f64 = 65536.0;

/// Texels across and up at most: places are 16 bits.
const MOST_TEXELS: f64 = 60000.0;

/// Texels that a triangle must have, by its longer side.
const FEWEST_TEXELS: f64 = 3.0;

/// The least height of a triangle of texels, as a part of its longest side: digits that f32 barycentrics may lose.
const THINNEST: f64 = 1e-3;

/// How much a normal may turn from a block's middle to its corners, as a part of its length: the series for 1/|N'| is one in this.
const MOST_TURN: f64 = 0.7;

impl Cutter {
    pub fn new(map: &DisplacementMap) -> Self {
        let (width, height) = map.size();
        Self {
            size: [width as i64, height as i64],
        }
    }

    /// The record of a triangle, and its blocks one by one.
    pub fn cut(
        &self,
        triangle: u32,
        patch: &Patch<'_>,
        offsets: [f32; 2],
        mut block: impl FnMut(Block),
    ) -> Result<Record, Whole> {
        let [a, b, c] = patch.texels;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let size = high - low;
        let longest = size.max_element();
        let height = (b - a).perp_dot(c - a).abs() / longest;
        let fits = (FEWEST_TEXELS..=MOST_TEXELS).contains(&longest)
            && low.abs().max(high.abs()).max_element() <= MOST_TEXELS * 2.0
            && height >= THINNEST * longest
            && self.count(size) <= MOST_BLOCKS
            && turn(patch, (size + 4.0).min(DVec2::splat(SIDE.into()))) <= MOST_TURN;
        if !fits {
            return Err(Whole);
        }
        let corner = Record::corner_of(low);
        let outline = Outline::new([a, b, c]);
        let rows = self.starts(1, low.y, high.y);
        for [y0, y1] in rows {
            for [x0, x1] in self.starts(0, low.x, high.x) {
                if outline.meets([x0, y0], [x1, y1]) {
                    block(Block {
                        triangle,
                        place: [(x0 - corner[0]) as u16, (y0 - corner[1]) as u16],
                    });
                }
            }
        }
        Ok(Record::new(patch, corner, offsets))
    }

    /// About how many blocks cover a rectangle of texels: every period of the map is cut anew.
    fn count(&self, size: DVec2) -> f64 {
        let unit = i64::from(SIDE);
        let along = |axis: usize| {
            let n = self.size[axis];
            size[axis] * ((n + unit - 1) / unit) as f64 / n as f64
        };
        along(0) * along(1)
    }

    /// The intervals of cells that blocks take up along an axis, [from, to).
    fn starts(&self, axis: usize, low: f64, high: f64) -> impl Iterator<Item = [i64; 2]> {
        let (n, unit) = (self.size[axis], i64::from(SIDE));
        let first = low.floor() as i64;
        // Where an entry begins, in the period of the map that the first cell is in.
        let mut from = first - first.rem_euclid(n) % unit;
        let last = high.floor() as i64;
        std::iter::from_fn(move || {
            if from > last {
                return None;
            }
            let edge = from - from.rem_euclid(n) + n;
            let to = edge.min(from + i64::from(SIDE));
            let interval = [from, to];
            from = to;
            Some(interval)
        })
    }
}

/// How much N' changes over half a block, as a part of its least length there.
fn turn(patch: &Patch<'_>, block: DVec2) -> f64 {
    let [p0, p1, p2] = patch.texels;
    let (a, b) = (p1 - p0, p2 - p0);
    let area = a.perp_dot(b);
    let (n1, n2) = (
        patch.normals[1] - patch.normals[0],
        patch.normals[2] - patch.normals[0],
    );
    let across = (b.y * n1 - a.y * n2) / area;
    let up = (a.x * n2 - b.x * n1) / area;
    let change = 0.5 * (block.x * across.length() + block.y * up.length());
    // A block's middle may lie outside the triangle by as much.
    let least = patch.shortest_normal() - change;
    if least > 0.0 {
        change / least
    } else {
        f64::INFINITY
    }
}

/// A triangle of texel coordinates, against boxes of cells.
struct Outline {
    corners: [DVec2; 3],
    slack: f64,
}

impl Outline {
    fn new(corners: [DVec2; 3]) -> Self {
        let size = corners
            .iter()
            .fold(0.0f64, |s, p| s.max(p.abs().max_element()));
        Self {
            corners,
            slack: 1e-6 + 1e-7 * size,
        }
    }

    /// Whether the triangle and a box may meet: by the separating axis theorem, with slack.
    fn meets(&self, low: [i64; 2], high: [i64; 2]) -> bool {
        let low = DVec2::new(low[0] as f64, low[1] as f64) - self.slack;
        let high = DVec2::new(high[0] as f64, high[1] as f64) + self.slack;
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
        let p = self.corners.map(|corner| corner - centre);
        let least = p[0].min(p[1]).min(p[2]);
        let most = p[0].max(p[1]).max(p[2]);
        if least.cmpgt(half).any() || most.cmplt(-half).any() {
            return false;
        }
        (0..3).all(|k| {
            let normal = (p[(k + 1) % 3] - p[k]).perp();
            let along = p.map(|p| normal.dot(p));
            let reach = normal.abs().dot(half);
            let least = along[0].min(along[1]).min(along[2]);
            let most = along[0].max(along[1]).max(along[2]);
            least <= reach && most >= -reach
        })
    }
}
