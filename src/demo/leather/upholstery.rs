//! The bench's leather as a function of place: tufts, pleats, buttons, piping, stitches, nails, grain.

use glam::{Vec2, Vec3};

use crate::demo::noise::{Octaves, cellular2, fbm2, gradient2, mix, smoothstep};

/// Where on the bench.
pub struct Place {
    /// Seen from above: x, z.
    pub ground: Vec2,
    /// Length of the profile from the level part of the top down to here; 0 on top.
    pub down: f32,
    /// Arc length around the bench.
    pub around: f32,
}

/// What is there.
pub struct Look {
    /// World units above the base.
    pub height: f32,
    /// Linear albedo.
    pub color: Vec3,
}

/// Thickness of the padding.
const PUFF: f32 = 0.105;
/// Between buttons of a row; the next row stands half a pitch aside and half a pitch away.
const PITCH: f32 = 0.44;
const BUTTON: f32 = 0.043;
/// `Place::down` of the piping between top and sides, of the stitches on both sides of it, and of the nails.
const PIPING: f32 = 0.205;
const PIPING_RADIUS: f32 = 0.019;
const NAILS: f32 = 0.500;
const NAIL_PITCH: f32 = 0.0623;
/// Bins along a unit of length to find pleats in.
const BINS: f32 = 8.0;

/// A crease from a button to its neighbour or to the edge.
#[derive(Clone, Copy)]
struct Pleat {
    from: Vec2,
    to: Vec2,
    /// Runs out on the edge instead of ending at a button.
    open: bool,
}

/// Buttons and pleats, found by place.
pub struct Upholstery {
    pleats: Vec<Pleat>,
    bins: Vec<Vec<u16>>,
    extent: Vec2,
    columns: usize,
    last_row: f32,
    last_column: f32,
}

impl Upholstery {
    /// For a top of half width and depth `top`.
    pub fn new(top: Vec2) -> Self {
        let half = 0.5 * PITCH;
        let mut upholstery = Self {
            pleats: Vec::new(),
            bins: Vec::new(),
            extent: top + 0.25,
            columns: (2.0 * (top.x + 0.25) * BINS).ceil() as usize,
            last_row: (top.y / half).floor() * half,
            last_column: (top.x / half).floor() * half,
        };
        upholstery.add_pleats(half);
        upholstery.fill_bins();
        upholstery
    }

    fn is_button(&self, p: Vec2) -> bool {
        p.x.abs() < self.last_column + 1e-3 && p.y.abs() < self.last_row + 1e-3
    }

    fn add_pleats(&mut self, half: f32) {
        let (ni, nj) = (
            (self.last_column / half) as i32,
            (self.last_row / half) as i32,
        );
        for j in -nj..=nj {
            for i in (-ni..=ni).filter(|i| (i + j) & 1 == 0) {
                let from = half * Vec2::new(i as f32, j as f32);
                for side in [-1.0, 1.0] {
                    let to = from + half * Vec2::new(side, 1.0);
                    if self.is_button(to) {
                        let open = false;
                        self.pleats.push(Pleat { from, to, open });
                    }
                }
                for (outermost, out) in [
                    (j.abs() == nj, Vec2::new(0.0, j as f32)),
                    (i.abs() >= ni - 1 && j.abs() < nj, Vec2::new(i as f32, 0.0)),
                ] {
                    if outermost && out != Vec2::ZERO {
                        let to = from + 0.26 * out.normalize();
                        let open = true;
                        self.pleats.push(Pleat { from, to, open });
                    }
                }
            }
        }
    }

    fn fill_bins(&mut self) {
        let rows = (2.0 * self.extent.y * BINS).ceil() as usize;
        self.bins = vec![Vec::new(); rows * self.columns];
        for (bin, list) in self.bins.iter_mut().enumerate() {
            let corner = Vec2::new((bin % self.columns) as f32, (bin / self.columns) as f32);
            let centre = (corner + 0.5) / BINS - self.extent;
            for (index, pleat) in self.pleats.iter().enumerate() {
                // Half a bin's diagonal, the crease's own reach, and the warp.
                if pleat.nearest(centre).0 < 0.71 / BINS + crease_reach() + 0.02 {
                    list.push(index as u16);
                }
            }
        }
    }

    fn pleats_near(&self, p: Vec2) -> impl Iterator<Item = &Pleat> {
        let q = ((p + self.extent) * BINS).max(Vec2::ZERO);
        let column = (q.x as usize).min(self.columns - 1);
        let bin = (q.y as usize * self.columns + column).min(self.bins.len() - 1);
        self.bins[bin].iter().map(|&k| &self.pleats[k as usize])
    }

    /// The leather at a place.
    pub fn at(&self, place: &Place) -> Look {
        if place.down < PIPING {
            self.top(place)
        } else {
            side(place)
        }
    }

    fn top(&self, place: &Place) -> Look {
        let p = place.ground;
        let warp = Vec2::new(gradient2(1, 5.0 * p), gradient2(2, 5.0 * p));
        let q = p + 0.010 * warp;
        let mut crease = 0.0f32;
        let mut lip = 0.0f32;
        for pleat in self.pleats_near(p) {
            let (depth, fold) = pleat.depth_and_lip(q);
            // Where two meet both count, and neither does beyond its reach.
            crease += depth - crease * depth;
            lip = lip.max(fold);
        }
        let (r, out) = self.nearest_button(p);
        let funnel = (-(r / 0.055).powi(2)).exp();
        let spokes = (11.0 * out.to_angle() + 2.5 * gradient2(3, 9.0 * p)).cos();
        let gather = 0.0045 * spokes * (-((r - 0.05) / 0.035).powi(2)).exp();
        let edge = bulge(((PIPING - place.down) / 0.17).min(1.0));
        let slack = 0.006 * fbm2(4, 4.5 * p, Octaves::new(3));
        let mut puff = PUFF * (1.0 - crease.min(1.0)) * (1.0 - 0.55 * funnel);
        puff += PUFF * 0.09 * lip + gather + slack * (1.0 - crease.min(1.0));
        puff *= mix(0.12, 1.0, edge);
        let worn = smoothstep(0.55, 1.0, puff / PUFF);
        let mut look = leather(p, worn, smoothstep(0.45, 0.0, puff / PUFF));
        look.height += puff;
        if r < BUTTON {
            let dome = (1.0 - (r / BUTTON).powi(2)).sqrt();
            look.height = look.height.max(0.012 + 0.032 * dome + 0.3 * grain(p));
            look.color *= mix(1.0, 2.2, dome);
        }
        add_seam(&mut look, PIPING - place.down, place.around);
        look
    }

    /// Distance to the nearest button, and the way there.
    fn nearest_button(&self, p: Vec2) -> (f32, Vec2) {
        let half = 0.5 * PITCH;
        let (a, b) = ((p.x + p.y) / PITCH, (p.x - p.y) / PITCH);
        let (a, b) = (a.round(), b.round());
        let button = half * Vec2::new(a + b, a - b);
        if self.is_button(button) {
            (p.distance(button), p - button)
        } else {
            (f32::INFINITY, Vec2::X)
        }
    }
}

impl Pleat {
    /// Distance to the segment, how far along the nearest point is (0..1), and on which side `p` lies.
    fn nearest(&self, p: Vec2) -> (f32, f32, f32) {
        let axis = self.to - self.from;
        let along = ((p - self.from).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        let off = p - self.from - along * axis;
        (off.length(), along, axis.perp_dot(off).signum())
    }

    /// How deep the crease is here, 0..1, and the lip of leather folded over one side of it.
    fn depth_and_lip(&self, p: Vec2) -> (f32, f32) {
        let (distance, along, side) = self.nearest(p);
        if distance > crease_reach() {
            return (0.0, 0.0);
        }
        let depth = if self.open {
            mix(1.0, 0.45, smoothstep(0.0, 1.0, along))
        } else {
            mix(0.62, 1.0, (2.0 * along - 1.0).powi(2))
        };
        let fold = (-((distance - 0.016) / 0.010).powi(2)).exp() * 0.5 * (1.0 + side);
        let crease = 1.0 - bulge(distance / crease_reach());
        (
            depth * crease,
            fold * smoothstep(0.0, 0.3, along.min(1.0 - along)),
        )
    }
}

/// From a crease to where a diamond is full: half the distance between parallel pleats.
fn crease_reach() -> f32 {
    0.5 * PITCH * std::f32::consts::FRAC_1_SQRT_2
}

/// The section of a cushion: 0 at its seam with a steep rise, 1 level at `x` = 1.
fn bulge(x: f32) -> f32 {
    let from_middle = 1.0 - x.clamp(0.0, 1.0);
    let round = (1.0 - from_middle * from_middle).sqrt();
    // The power 1.25 leans the section in a little from a circle's.
    round * round.sqrt().sqrt()
}

/// The panels around the bench, below the piping.
fn side(place: &Place) -> Look {
    let below = place.down - PIPING;
    let q = Vec2::new(place.around, place.down);
    let panel =
        bulge((below / 0.10).min(1.0)) * bulge(((0.545 - place.down) / 0.05).clamp(0.0, 1.0));
    let slack = 0.010 * fbm2(5, q * Vec2::new(2.2, 5.0), Octaves::new(4));
    let mut look = leather(q + 7.0, 0.35 * panel, 0.6 * (1.0 - panel));
    look.height += 0.030 * panel + slack * panel;
    add_seam(&mut look, below, place.around);
    add_nail(&mut look, place);
    look
}

/// The piping and, beside it, a row of stitches; `from` is the distance from the piping's middle.
fn add_seam(look: &mut Look, from: f32, around: f32) {
    let cord = from / PIPING_RADIUS;
    if cord < 1.0 {
        let twist = 0.0012 * gradient2(6, Vec2::new(around * 70.0, from * 30.0));
        look.height = 0.012 + PIPING_RADIUS * (1.0 - cord * cord).sqrt() + twist;
        look.color *= mix(1.25, 0.5, cord * cord);
    }
    add_stitch(look, (from - 0.036) / 0.0045, around / 0.030);
}

/// One row of thread: `across` in half widths of the thread, `along` in stitches.
fn add_stitch(look: &mut Look, across: f32, along: f32) {
    let dent = (-(across / 2.2).powi(2)).exp();
    look.height -= 0.0050 * dent;
    let place = along - along.floor() - 0.5;
    let end = (place.abs() / 0.38).powi(4);
    let section = 1.0 - across * across - end;
    if section > 0.0 {
        let strands = (40.0 * place + 2.0 * across).sin();
        look.height += 0.0095 * section.sqrt() + 0.0006 * strands;
        look.color = Vec3::new(0.62, 0.50, 0.33) * (0.8 + 0.15 * strands);
    } else {
        look.color *= mix(1.0, 0.55, dent);
    }
}

/// A row of domed brass nails above the floor.
fn add_nail(look: &mut Look, place: &Place) {
    let count = place.around / NAIL_PITCH;
    let offset = Vec2::new(
        (count - count.floor() - 0.5) * NAIL_PITCH,
        place.down - NAILS,
    );
    let q = offset.length() / (0.40 * NAIL_PITCH);
    if q < 1.0 {
        let hammered = 0.0005 * gradient2(7, 160.0 * Vec2::new(place.around, place.down));
        look.height = look
            .height
            .max(0.016 + 0.016 * (1.0 - q * q).sqrt() + hammered);
        look.color = Vec3::new(0.62, 0.42, 0.16) * mix(1.1, 0.45, q * q);
    } else {
        let press = smoothstep(1.6, 1.0, q);
        look.height -= 0.004 * press;
        look.color *= mix(1.0, 0.5, press);
    }
}

/// Pebbled grain and its wear: `worn` smooths and lightens, `shaded` darkens, both 0..1.
fn leather(p: Vec2, worn: f32, shaded: f32) -> Look {
    let cloud = fbm2(8, 3.0 * p, Octaves::new(5));
    let pebbles = grain(p);
    let deep = Vec3::new(0.115, 0.030, 0.013);
    let bright = Vec3::new(0.31, 0.098, 0.038);
    let tone = (0.38 + 0.42 * worn + 0.5 * cloud).clamp(0.0, 1.0);
    let color = deep.lerp(bright, tone) * mix(0.72, 1.08, pebbles / GRAIN) * mix(1.0, 0.42, shaded);
    Look {
        height: pebbles * mix(1.0, 0.6, worn),
        color,
    }
}

const GRAIN: f32 = 0.0013;

/// Pebbles of two sizes with creases between them, 0..`GRAIN`.
fn grain(p: Vec2) -> f32 {
    let warp = 0.35 * Vec2::new(gradient2(9, 40.0 * p), gradient2(10, 40.0 * p));
    let coarse = cellular2(11, 105.0 * p + warp);
    let fine = gradient2(12, 420.0 * p);
    let pebble = smoothstep(0.0, 0.42, coarse.f2 - coarse.f1);
    GRAIN * (0.82 * pebble + 0.09 * (1.0 + fine)).min(1.0)
}
