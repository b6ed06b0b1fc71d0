//! Draws docs/images/march.svg, the exact march of one ray through one prism: `cargo run --release --example march_figure`.
//!
//! What is drawn is what the march says it did ([`Prisms::explain`]); only the map and the ray were chosen.

use std::fmt::Write as _;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use prismarch::prism::{Explanation, Fate, March, Prisms, SpanChild};
use prismarch::ray::Ray;
use prismarch::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, Wrap,
};

/// Where the figure is kept.
pub const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/images/march.svg");

/// Texels along the map's sides.
const MAP: u32 = 256;

fn main() -> std::io::Result<()> {
    std::fs::write(PATH, draw())
}

/// The figure, as SVG.
pub fn draw() -> String {
    let prisms = prisms();
    let explanation = prisms.explain(0, &ray()).expect("the ray is inside once");
    Figure::new(prisms.surface().map(), &explanation).svg()
}

/// Grazes the first hills and meets the next.
pub fn ray() -> Ray {
    Ray::new(Vec3::new(-0.25, 0.16, 0.165), Vec3::new(1.3, 0.26, -0.095))
}

/// One base triangle whose normals lean apart, so that the ray's curve over the map is bent.
pub fn prisms() -> Prisms {
    let builder = MeshBuilder {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.5, 0.85, 0.0)],
        normals: vec![
            Vec3::new(-0.45, -0.2, 1.0).normalize(),
            Vec3::new(0.45, -0.2, 1.0).normalize(),
            Vec3::new(0.0, 0.4, 1.0).normalize(),
        ],
        texcoords: vec![Vec2::ZERO, Vec2::X, Vec2::new(0.5, 0.85)],
        triangles: vec![[0, 1, 2]],
    };
    let (mesh, _) = builder.build(NormalMode::File).expect("a sound triangle");
    let texels = (0..MAP * MAP).map(|i| height(i % MAP, i / MAP)).collect();
    let map = DisplacementMap::new(
        MAP as usize,
        MAP as usize,
        Texels::U16(texels),
        Wrap::Repeat,
    );
    let map = Arc::new(map.expect("a full map"));
    let surface = DisplacedSurface::new(Arc::new(mesh), map, Displacement::new(0.16));
    Prisms::new(Arc::new(surface.expect("a sound surface")), March::Exact).expect("no step")
}

/// Hills, and lesser hills on them: sums and products alone, so that every machine has the same.
fn height(x: u32, y: u32) -> u16 {
    let octaves = [(64, 0.62), (32, 0.2), (8, 0.12), (2, 0.06)];
    let sum: f64 = octaves
        .iter()
        .map(|&(cell, part)| part * hills(x, y, cell))
        .sum();
    (sum.clamp(0.0, 1.0) * 65535.0) as u16
}

/// Smooth noise from 0 to 1 with a random height at every `cell` texels.
fn hills(x: u32, y: u32, cell: u32) -> f64 {
    let lattice = |i: u32, j: u32| {
        let n = MAP / cell;
        let mut h = (i % n) * 0x9e37 + (j % n) * 0x79b9 + cell * 0x85eb;
        for _ in 0..3 {
            h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
        }
        f64::from(h >> 8) / f64::from(1 << 24)
    };
    let (i, j) = (x / cell, y / cell);
    let smooth = |r: u32| {
        let f = f64::from(r) / f64::from(cell);
        f * f * (3.0 - 2.0 * f)
    };
    let (fx, fy) = (smooth(x % cell), smooth(y % cell));
    let row = |j: u32| lattice(i, j) + fx * (lattice(i + 1, j) - lattice(i, j));
    row(j) + fy * (row(j + 1) - row(j))
}

/// A point of the curve: how many texels along, the ray's height and the surface's.
#[derive(Clone, Copy)]
struct Place {
    t: f64,
    along: f64,
    ray: f64,
    surface: f64,
}

struct Figure<'a> {
    places: Vec<Place>,
    /// Texels along at which the curve crosses a texel line.
    lines: Vec<f64>,
    explanation: &'a Explanation,
}

/// A part of the plane, and where it is drawn.
struct Panel {
    /// Texels along.
    x: [f64; 2],
    /// Heights.
    y: [f64; 2],
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

const INK: &str = "#2b2b33";

/// Fill, outline and name of a child by its fate.
fn look(fate: Fate) -> (&'static str, &'static str, &'static str) {
    match fate {
        Fate::Skipped => ("#a9cbe8", "#4c86b8", "skipped: above or below all there"),
        Fate::Cut => ("#f7d98a", "#c29416", "cut again"),
        Fate::Walked => ("#f2a07b", "#c2542a", "walked cell by cell"),
        Fate::Behind => ("#dededf", "#a5a5ab", "behind the hit: left"),
    }
}

impl Panel {
    fn x(&self, along: f64) -> f64 {
        self.left + self.width * (along - self.x[0]) / (self.x[1] - self.x[0])
    }

    fn y(&self, height: f64) -> f64 {
        self.top + self.height * (self.y[1] - height) / (self.y[1] - self.y[0])
    }

    fn holds(&self, along: f64) -> bool {
        (self.x[0]..=self.x[1]).contains(&along)
    }
}

impl<'a> Figure<'a> {
    fn new(map: &DisplacementMap, explanation: &'a Explanation) -> Self {
        let (mut places, mut lines, mut along) = (Vec::new(), Vec::new(), 0.0);
        let mut last = explanation.curve[0].texel;
        for point in &explanation.curve {
            let step = point.texel.distance(last);
            for (a, b) in last.to_array().into_iter().zip(point.texel.to_array()) {
                if a.floor() != b.floor() {
                    let line = a.floor().max(b.floor());
                    lines.push(along + step * (line - a) / (b - a));
                }
            }
            along += step;
            last = point.texel;
            places.push(Place {
                t: point.t,
                along,
                ray: point.height,
                surface: map.sample(point.texel).height,
            });
        }
        Self {
            places,
            lines,
            explanation,
        }
    }

    /// The place on the curve at ray parameter `t`.
    fn at(&self, t: f64) -> Place {
        let next = self.places.partition_point(|p| p.t < t);
        let next = next.clamp(1, self.places.len() - 1);
        let (a, b) = (self.places[next - 1], self.places[next]);
        let part = ((t - a.t) / (b.t - a.t)).clamp(0.0, 1.0);
        let mix = |a: f64, b: f64| a + part * (b - a);
        Place {
            t,
            along: mix(a.along, b.along),
            ray: mix(a.ray, b.ray),
            surface: mix(a.surface, b.surface),
        }
    }

    fn svg(&self) -> String {
        let deepest = self
            .explanation
            .children
            .iter()
            .map(|c| c.depth)
            .max()
            .unwrap_or(0);
        let hit = self.at(self.explanation.hit.expect("the ray hits"));
        let whole = Panel {
            x: [0.0, self.places[self.places.len() - 1].along],
            y: [-0.02, 1.02],
            left: 60.0,
            top: 64.0,
            width: 880.0,
            height: 250.0,
        };
        // Close up: from the first child that was cut to the one with the hit.
        let is_cut = |c: &&SpanChild| c.depth == 0 && c.fate == Fate::Cut;
        let mut cut = self.explanation.children.iter().filter(is_cut);
        let first = cut.next().expect("a child was cut");
        let last = cut.next_back().unwrap_or(first);
        let x = [first.t[0], last.t[1]].map(|t| self.at(t).along);
        let inside = self
            .places
            .iter()
            .filter(|p| x[0] <= p.along && p.along <= x[1]);
        let heights = inside.flat_map(|p| [p.ray, p.surface]).chain(first.heights);
        let (low, high) = heights.fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
        let zoomed = Panel {
            x,
            y: [low - 0.02, high + 0.02],
            left: 60.0,
            top: 392.0,
            width: 880.0,
            height: 250.0,
        };
        let mut svg = String::from(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1000 748\" \
             font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\">\n\
             <rect width=\"1000\" height=\"748\" fill=\"#ffffff\"/>\n",
        );
        for (k, panel) in [&whole, &zoomed].into_iter().enumerate() {
            let _ = writeln!(
                svg,
                "<clipPath id=\"panel{k}\"><rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/></clipPath>",
                panel.left, panel.top, panel.width, panel.height
            );
        }
        text(
            &mut svg,
            60.0,
            28.0,
            17.0,
            "A ray through one prism: the first cut",
        );
        text(
            &mut svg,
            60.0,
            49.0,
            13.0,
            "Its curve over the map is cut into 15 children, each held against the map's pyramid.",
        );
        self.panel(&mut svg, &whole, 0, [0, 0]);
        // What is close up below.
        let [a, b] = x.map(|along| whole.x(along));
        let bottom = whole.top + whole.height;
        let _ = writeln!(
            svg,
            "<path d=\"M{a:.1} {bottom:.1}H{b:.1}\" stroke=\"{INK}\" stroke-width=\"5\"/>"
        );
        text(
            &mut svg,
            60.0,
            364.0,
            17.0,
            "The part above the black bar, close up",
        );
        text(
            &mut svg,
            60.0,
            384.0,
            13.0,
            "What was not skipped is cut again, then walked: thin lines are texel lines, between which the surface is solved.",
        );
        self.panel(&mut svg, &zoomed, 1, [1, deepest]);
        for (panel, label) in [(&whole, false), (&zoomed, true)] {
            let (x, y) = (panel.x(hit.along), panel.y(hit.ray));
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"#ffffff\" stroke=\"#b3123f\" stroke-width=\"2.5\"/>"
            );
            if label {
                text(&mut svg, x + 12.0, y - 8.0, 14.0, "hit");
            }
        }
        let mut left = 60.0;
        for fate in [Fate::Skipped, Fate::Cut, Fate::Walked, Fate::Behind] {
            let (fill, line, name) = look(fate);
            let _ = writeln!(
                svg,
                "<rect x=\"{left:.1}\" y=\"690\" width=\"16\" height=\"14\" fill=\"{fill}\" stroke=\"{line}\"/>"
            );
            text(&mut svg, left + 22.0, 702.0, 13.0, name);
            left += 46.0 + 6.3 * name.len() as f64;
        }
        text(
            &mut svg,
            60.0,
            730.0,
            13.0,
            "Red: the ray. Brown: the surface under it. Boxes: from the smallest to the largest height around a child, as the pyramid has it.",
        );
        svg.push_str("</svg>\n");
        svg
    }

    /// Axes, profile, children of some depths, and the ray.
    fn panel(&self, svg: &mut String, panel: &Panel, k: usize, [first, last]: [u32; 2]) {
        let bottom = panel.top + panel.height;
        let _ = writeln!(svg, "<g clip-path=\"url(#panel{k})\">");
        let profile = self.path(panel, |p| p.surface);
        let _ = writeln!(
            svg,
            "<path d=\"{profile}V{:.1}H{:.1}Z\" fill=\"#e5dccd\" stroke=\"none\"/>",
            bottom + 9.0,
            panel.left - 9.0
        );
        for child in &self.explanation.children {
            let [a, b] = child.t.map(|t| self.at(t).along);
            if child.depth < first || child.depth > last || !panel.holds(0.5 * (a + b)) {
                continue;
            }
            let (fill, line, _) = look(child.fate);
            let ([x0, x1], [low, high]) = ([a, b].map(|x| panel.x(x)), child.heights);
            let _ = writeln!(
                svg,
                "<rect x=\"{x0:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\" fill-opacity=\"0.55\" stroke=\"{line}\"/>",
                panel.y(high),
                x1 - x0,
                panel.y(low) - panel.y(high)
            );
            if child.fate == Fate::Walked {
                for &at in self.lines.iter().filter(|&&at| a < at && at < b) {
                    let x = panel.x(at);
                    let _ = writeln!(
                        svg,
                        "<path d=\"M{x:.1} {:.1}V{:.1}\" stroke=\"{line}\" stroke-width=\"0.7\"/>",
                        panel.y(high),
                        panel.y(low)
                    );
                }
            }
        }
        let ray = self.path(panel, |p| p.ray);
        let _ = writeln!(
            svg,
            "<path d=\"{profile}\" fill=\"none\" stroke=\"#7a6748\" stroke-width=\"1.6\"/>\n\
             <path d=\"{ray}\" fill=\"none\" stroke=\"#b3123f\" stroke-width=\"2.2\"/>\n</g>"
        );
        let _ = writeln!(
            svg,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"{INK}\"/>",
            panel.left, panel.top, panel.width, panel.height
        );
        let middle = panel.top + 0.5 * panel.height;
        let _ = writeln!(
            svg,
            "<text x=\"0\" y=\"0\" transform=\"translate(44 {middle:.1}) rotate(-90)\" text-anchor=\"middle\" fill=\"{INK}\">height in the map</text>"
        );
        let step = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0]
            .into_iter()
            .find(|step| (panel.x[1] - panel.x[0]) / step <= 12.0)
            .unwrap_or(100.0);
        let mut at = (panel.x[0] / step).ceil() * step;
        while at <= panel.x[1] {
            let x = panel.x(at);
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {bottom:.1}v5\" stroke=\"{INK}\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"11\" fill=\"{INK}\">{at}</text>",
                bottom + 17.0
            );
            at += step;
        }
        let _ = writeln!(
            svg,
            "<text x=\"940\" y=\"{:.1}\" text-anchor=\"end\" font-size=\"11\" fill=\"{INK}\">texels along the curve</text>",
            bottom + 31.0
        );
    }

    fn path(&self, panel: &Panel, height: impl Fn(&Place) -> f64) -> String {
        let mut d = String::new();
        // One place more on either side, for the lines to leave the panel.
        let from = self
            .places
            .partition_point(|p| p.along < panel.x[0])
            .saturating_sub(1);
        let to = self.places.partition_point(|p| p.along <= panel.x[1]) + 1;
        for (i, p) in self.places[from..to.min(self.places.len())]
            .iter()
            .enumerate()
        {
            let letter = if i == 0 { 'M' } else { 'L' };
            let _ = write!(
                d,
                "{letter}{:.1} {:.1}",
                panel.x(p.along),
                panel.y(height(p))
            );
        }
        d
    }
}

fn text(svg: &mut String, x: f64, y: f64, size: f64, words: &str) {
    let weight = if size > 16.0 { "600" } else { "400" };
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" font-weight=\"{weight}\" fill=\"{INK}\">{words}</text>"
    );
}
