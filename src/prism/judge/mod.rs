//! The judge: exactly where a ray meets S over one base triangle, or over a rectangle of its texel cells.
//!
//! Fast paths decide what they can prove. What they cannot is decided here, in f64, on the ray's own curve through the prism
//! ([`curve`](crate::prism::curve)): it is cut where it crosses texel lines ([`cuts`]), and the signs of g = w |N'| - D at both
//! ends of a part between two cuts say whether it crosses the surface; a bracketed Newton iteration finds where ([`roots`]).
//! So a spike one texel wide is found.
//!
//! **Nothing falls between two cells.** The curve, and the pieces that a grazing ray's is made of ([`pieces`]), are those of the whole
//! triangle, whichever cells are asked about. A part between two cuts belongs to the cell that its middle is in, and so to one alone; the cells at both its
//! ends take the same sign there, of the same digits. Whoever asks cell by cell finds each crossing once, and has in all what who asks for the whole
//! triangle has. Between triangles, curves end at the same w ([`View`]).

mod cuts;
mod hull;
mod pieces;
mod roots;
mod search;
#[cfg(test)]
mod tests;
mod walls;

use super::curve::{Corners, Curve, Cut, Stretch, View};
use super::ray_frame::RayFrame;
use super::simd::{Lanes, Quad, Task};
use crate::surface::Patch;
use pieces::Piece;
use search::{Along, Search};
pub use walls::walls;

/// What is asked about one base triangle.
#[derive(Clone, Copy)]
pub struct Question<'a> {
    /// S over the triangle.
    pub patch: &'a Patch<'a>,
    /// Holds w = D/|N'|; the same whichever cells are asked about.
    pub range: [f64; 2],
    /// The ray.
    pub frame: &'a RayFrame,
    /// The open interval of ray parameters.
    pub interval: [f32; 2],
    /// Whether any crossing will do.
    pub any: bool,
}

impl Question<'_> {
    #[inline(always)]
    fn accepts(&self, t: f64) -> bool {
        let t = t as f32;
        t > self.interval[0] && t < self.interval[1]
    }

    /// Whether no t of these is in the interval.
    #[inline(always)]
    fn is_outside(&self, [low, high]: [f64; 2]) -> bool {
        high as f32 <= self.interval[0] || low as f32 >= self.interval[1]
    }

    /// The prism as the ray sees it.
    #[inline(always)]
    fn view<Q: Quad>(&self) -> View<Q> {
        let [low, high] = self.range;
        let corners = Corners::new(self.patch, self.frame.axes);
        View::new(&corners, self.frame, low.abs().max(high.abs()))
    }
}

/// A rectangle of cells, in the patch's texel coordinates: the first and the last one along each axis. Cell i is [i, i + 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    pub x: [i64; 2],
    pub y: [i64; 2],
}

impl Cells {
    /// All that the triangle has.
    pub const ALL: Self = Self {
        x: [i64::MIN, i64::MAX],
        y: [i64::MIN, i64::MAX],
    };
}

/// A crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Ray parameter.
    pub t: f64,
    /// Barycentric coordinate of vertex 1.
    pub u: f64,
    /// Barycentric coordinate of vertex 2.
    pub v: f64,
}

impl Found {
    #[inline(always)]
    fn at<Q: Quad>(curve: &Curve<Q>, s: f64) -> Self {
        let [t, u, v] = curve.seen(s);
        Self { t, u, v }
    }
}

/// The nearest crossing in some cells, or any.
#[inline(always)]
pub fn within<L: Lanes>(question: &Question<'_>, cells: &Cells) -> Option<Found> {
    L::outline(Within { question, cells })
}

struct Within<'a> {
    question: &'a Question<'a>,
    cells: &'a Cells,
}

impl<L: Lanes> Task<L> for Within<'_> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run(self) -> Option<Found> {
        let Self { question, cells } = self;
        let mut search = Search::new(question, cells);
        let view = question.view::<L::Quad>();
        let stretch = match view.cut(question.range) {
            Cut::One(stretch) => Some(stretch),
            Cut::None if !pieces::is_edge_on(&view, question.range) => return None,
            _ => None,
        };
        if let Some(stretch) = &stretch {
            let curve = Curve::new(&view, &question.patch.texels, stretch, question.frame);
            if pieces::is_even(&curve) {
                L::outline(Along {
                    search: &mut search,
                    curve: &curve,
                });
                return search.nearest();
            }
        }
        L::outline(Rare {
            search: &mut search,
            view: &view,
            stretch,
        });
        search.nearest()
    }
}

/// The few rays that are inside a prism more than once, graze it, or lie in the planes of its triangles.
struct Rare<'s, 'a, Q> {
    search: &'s mut Search<'a>,
    view: &'s View<Q>,
    /// The one stretch, where there is one.
    stretch: Option<Stretch>,
}

impl<L: Lanes<Quad = Q>, Q: Quad> Task<L> for Rare<'_, '_, Q> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { search, view, .. } = self;
        let question = search.question;
        if pieces::is_edge_on(view, question.range) {
            return edge_on::<L>(search);
        }
        if let Some(stretch) = &self.stretch {
            return piece_by_piece::<L>(search, view, stretch);
        }
        // A loop, not an iterator: lanes must not pass through functions that lack the kernel's instruction set.
        for stretch in view.stretches(question.range).as_slice() {
            piece_by_piece::<L>(search, view, stretch);
        }
    }
}

/// The ray lies in the planes of the prism's triangles: it meets them at the one or few w whose plane holds it.
#[inline(always)]
fn edge_on<L: Lanes>(search: &mut Search<'_>) {
    let Question {
        patch,
        range,
        frame,
        ..
    } = *search.question;
    let (heights, count) = pieces::planes_that_hold(patch, frame, range);
    for &w in &heights[..count] {
        if let Some(curve) = pieces::flat::<L::Quad>(patch, frame, w) {
            L::outline(Along {
                search,
                curve: &curve,
            });
        }
    }
}

/// One stretch of the curve.
#[inline(always)]
fn piece_by_piece<L: Lanes>(search: &mut Search<'_>, view: &View<L::Quad>, stretch: &Stretch) {
    let Question { patch, frame, .. } = *search.question;
    let curve = Curve::new(view, &patch.texels, stretch, frame);
    let mut pieces = pieces::Pieces::new(&curve, view);
    let mut before = None;
    while let Some(piece) = pieces.next() {
        let part = match piece {
            Piece::Even(part) => Some(part),
            Piece::Flat(w) => pieces::flat(patch, frame, w),
        };
        let Some(part) = part else { continue };
        if let Some(before) = &before {
            search.joint(before, &part);
        }
        L::outline(Along {
            search,
            curve: &part,
        });
        if search.is_done() {
            return;
        }
        before = Some(part);
    }
}
