//! Draws docs/images/march.svg, the exact march of one ray over one base triangle: `cargo run --release --example march_figure`.
//!
//! What is drawn is what the march says it did ([`Prisms::explain`]); only the map and the ray were chosen.

use std::fmt::Write as _;
use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3};
use prismarch::prism::{
    BlockTold, CellFate, Explanation, Fate, LeafTold, March, PathPoint, Prisms,
};
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
    let explanation = prisms.explain(0, &ray()).expect("a triangle with blocks");
    let map = prisms.surface().map();
    Figure {
        map,
        explanation: &explanation,
    }
    .svg()
}

/// Grazes the first hills and meets the next.
pub fn ray() -> Ray {
    Ray::new(Vec3::new(-0.25, 0.16, 0.175), Vec3::new(1.3, 0.26, -0.125))
}

/// One base triangle whose normals lean apart, so that the ray's path over the map is bent.
pub fn prisms() -> Prisms {
    let builder = MeshBuilder {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.5, 0.85, 0.0)],
        normals: vec![
            Vec3::new(-0.45, -0.2, 1.0).normalize(),
            Vec3::new(0.45, -0.2, 1.0).normalize(),
            Vec3::new(0.0, 0.4, 1.0).normalize(),
        ],
        texcoords: vec![
            Vec2::new(0.02, 0.03),
            Vec2::new(0.42, 0.05),
            Vec2::new(0.2, 0.38),
        ],
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
    let octaves = [(32, 0.58), (16, 0.2), (8, 0.12), (4, 0.07), (2, 0.03)];
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

struct Figure<'a> {
    map: &'a DisplacementMap,
    explanation: &'a Explanation,
}

/// A part of the plane, and where it is drawn.
struct Panel {
    x: [f64; 2],
    y: [f64; 2],
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

const INK: &str = "#2b2b33";
const RAY: &str = "#b3123f";
const GROUND: &str = "#7a6748";

/// Fill and outline of a part by its fate.
fn look(fate: Fate) -> (&'static str, &'static str) {
    match fate {
        Fate::Missed => ("#c3dbef", "#7ba3c8"),
        Fate::Entered => ("#f2a07b", "#c2542a"),
        Fate::Judged => ("#c9a6e4", "#7d4bb0"),
        Fate::Behind => ("#dededf", "#a5a5ab"),
    }
}

/// The same of a cell.
fn look_of_cell(fate: CellFate) -> (&'static str, &'static str) {
    match fate {
        CellFate::Missed => ("#f7d98a", "kept by its box, then certainly missed"),
        CellFate::Hit => ("#f2a07b", "certainly hit: Newton lands it"),
        CellFate::Judged => ("#c9a6e4", "left to the judge"),
    }
}

impl Panel {
    /// A square around some points.
    fn square(points: impl Iterator<Item = DVec2>, [left, top, size]: [f64; 3]) -> Self {
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (low, high) = points.fold(start, |(l, h), p| (l.min(p), h.max(p)));
        let (middle, half) = (0.5 * (low + high), 0.53 * (high - low));
        Self {
            x: [middle.x - half.x, middle.x + half.x],
            y: [middle.y - half.y, middle.y + half.y],
            left,
            top,
            width: size,
            height: size,
        }
    }

    /// As high as wide in its own units.
    fn unstretched(self) -> Self {
        let half = 0.5 * (self.x[1] - self.x[0]).max(self.y[1] - self.y[0]);
        let around = |[low, high]: [f64; 2]| {
            let middle = 0.5 * (low + high);
            [middle - half, middle + half]
        };
        Self {
            x: around(self.x),
            y: around(self.y),
            ..self
        }
    }

    fn x(&self, x: f64) -> f64 {
        self.left + self.width * (x - self.x[0]) / (self.x[1] - self.x[0])
    }

    fn y(&self, y: f64) -> f64 {
        self.top + self.height * (self.y[1] - y) / (self.y[1] - self.y[0])
    }

    fn polygon(&self, svg: &mut String, points: &[DVec2], style: &str) {
        let mut list = String::new();
        for p in points {
            let _ = write!(list, "{:.1},{:.1} ", self.x(p.x), self.y(p.y));
        }
        let _ = writeln!(svg, "<polygon points=\"{}\" {style}/>", list.trim_end());
    }

    fn rectangle(&self, svg: &mut String, [low, high]: [DVec2; 2], style: &str) {
        let (left, top) = (self.x(low.x), self.y(high.y));
        let (width, height) = (self.x(high.x) - left, self.y(low.y) - top);
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" {style}/>"
        );
    }

    fn line(&self, svg: &mut String, points: impl Iterator<Item = DVec2>, style: &str) {
        let mut list = String::new();
        for p in points {
            let _ = write!(list, "{:.1},{:.1} ", self.x(p.x), self.y(p.y));
        }
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" {style}/>",
            list.trim_end()
        );
    }

    /// What is drawn until `</g>` stays inside.
    fn clip(&self, svg: &mut String, name: &str) {
        let Self {
            left,
            top,
            width,
            height,
            ..
        } = self;
        let _ = writeln!(
            svg,
            "<clipPath id=\"{name}\"><rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"/></clipPath>\n\
             <g clip-path=\"url(#{name})\">"
        );
    }

    fn frame(&self, svg: &mut String) {
        let Self {
            left,
            top,
            width,
            height,
            ..
        } = self;
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" stroke=\"{INK}\"/>"
        );
    }

    fn ring(&self, svg: &mut String, at: DVec2) {
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"5\" fill=\"#ffffff\" stroke=\"{RAY}\" stroke-width=\"2.5\"/>",
            self.x(at.x),
            self.y(at.y)
        );
    }
}

impl Figure<'_> {
    fn svg(&self) -> String {
        let mut svg = String::from(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1000 940\" \
             font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\">\n\
             <rect width=\"1000\" height=\"940\" fill=\"#ffffff\"/>\n",
        );
        self.over_the_map(&mut svg);
        self.along_the_ray(&mut svg);
        self.along_the_path(&mut svg);
        svg.push_str("</svg>\n");
        svg
    }

    fn hit(&self) -> PathPoint {
        self.explanation.hit.expect("the ray hits")
    }

    fn leaves(&self) -> impl Iterator<Item = &LeafTold> {
        self.explanation
            .blocks
            .iter()
            .flat_map(|block| &block.leaves)
    }

    /// The leaf with the hit.
    fn last_leaf(&self) -> &LeafTold {
        let at = self.hit().texel;
        let holds = |leaf: &&LeafTold| {
            let [low, high] = leaf.part.texels;
            leaf.part.fate == Fate::Entered && at.cmpge(low).all() && at.cmple(high).all()
        };
        self.leaves().find(holds).expect("a leaf was looked at")
    }

    /// The triangle in texel coordinates.
    fn over_the_map(&self, svg: &mut String) {
        let Explanation {
            corners,
            path,
            blocks,
            ..
        } = self.explanation;
        text(svg, 40.0, 28.0, 17.0, "1. Over the map");
        text(
            svg,
            40.0,
            48.0,
            13.0,
            "The base triangle in texel coordinates; red: the ray's path.",
        );
        let ends = blocks.iter().flat_map(|block| block.texels);
        let panel = Panel::square(ends, [40.0, 60.0, 440.0]).unstretched();
        panel.clip(svg, "map");
        for block in blocks {
            for part in &block.parts {
                panel.rectangle(svg, part.texels, &style(part.fate, 0.35, 0.6));
            }
            for leaf in &block.leaves {
                panel.rectangle(svg, leaf.part.texels, &style(leaf.part.fate, 0.95, 0.6));
            }
        }
        for BlockTold { texels, fate, .. } in blocks {
            let fill = match fate {
                Fate::Missed => "#ffffff",
                Fate::Behind => "#dededf",
                _ => "none",
            };
            let style = format!(
                "fill=\"{fill}\" fill-opacity=\"0.7\" stroke=\"{INK}\" stroke-width=\"1.2\""
            );
            panel.rectangle(svg, *texels, &style);
        }
        panel.polygon(
            svg,
            corners,
            &format!("fill=\"none\" stroke=\"{GROUND}\" stroke-width=\"2.5\""),
        );
        let style = format!("stroke=\"{RAY}\" stroke-width=\"2.2\"");
        panel.line(svg, path.iter().map(|p| p.texel), &style);
        svg.push_str("</g>\n");
        panel.ring(svg, self.hit().texel);
        panel.frame(svg);
        let top = 520.0;
        legend(
            svg,
            [40.0, top],
            ("#e6f0f8", "#7ba3c8"),
            "part of 16x8 cells: culled",
        );
        legend(
            svg,
            [40.0, top + 20.0],
            look(Fate::Missed),
            "leaf of 8x4 cells: culled",
        );
        legend(
            svg,
            [40.0, top + 40.0],
            look(Fate::Entered),
            "leaf: looked at",
        );
        legend(svg, [280.0, top], ("#ffffff", INK), "block: box not met");
        legend(
            svg,
            [280.0, top + 20.0],
            look(Fate::Behind),
            "behind the hit",
        );
    }

    /// The leaf with the hit, seen along the ray.
    fn along_the_ray(&self, svg: &mut String) {
        let leaf = self.last_leaf();
        text(svg, 520.0, 28.0, 17.0, "2. Along the ray");
        text(
            svg,
            520.0,
            48.0,
            13.0,
            "The leaf with the hit, as the ray sees it; stretched.",
        );
        // Normals go up.
        let vertices: Vec<DVec2> = leaf.vertices.iter().map(|p| DVec2::new(p.y, p.x)).collect();
        let panel = Panel::square(vertices.iter().copied(), [520.0, 60.0, 440.0]);
        panel.clip(svg, "leaf");
        let vertex = |i: usize, j: usize| vertices[9 * j + i];
        let cell = |[i, j]: [usize; 2]| {
            [
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ]
        };
        for j in 0..4 {
            for i in 0..8 {
                let style =
                    "fill=\"#efe9df\" fill-opacity=\"0.6\" stroke=\"#a08f72\" stroke-width=\"0.8\"";
                panel.polygon(svg, &cell([i, j]), style);
            }
        }
        for told in &leaf.cells {
            let (fill, _) = look_of_cell(told.fate);
            let corners = cell(told.cell);
            let style = format!(
                "fill=\"{fill}\" fill-opacity=\"0.8\" stroke=\"{INK}\" stroke-width=\"1.4\""
            );
            panel.polygon(svg, &corners, &style);
            let low = corners.into_iter().fold(DVec2::INFINITY, DVec2::min);
            let high = corners.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
            let style = format!(
                "fill=\"none\" stroke=\"{INK}\" stroke-width=\"0.8\" stroke-dasharray=\"4 3\""
            );
            panel.rectangle(svg, [low, high], &style);
        }
        svg.push_str("</g>\n");
        panel.ring(svg, DVec2::ZERO);
        panel.frame(svg);
        let mut top = 520.0;
        for fate in [CellFate::Missed, CellFate::Hit, CellFate::Judged] {
            if leaf.cells.iter().any(|cell| cell.fate == fate) {
                let (fill, name) = look_of_cell(fate);
                legend(svg, [520.0, top], (fill, INK), name);
                top += 20.0;
            }
        }
        text(
            svg,
            520.0,
            top + 11.0,
            13.0,
            "Dashed: boxes that hold the ray, which is the ring.",
        );
    }

    /// Heights along the path.
    fn along_the_path(&self, svg: &mut String) {
        text(svg, 40.0, 610.0, 17.0, "3. From the side");
        text(
            svg,
            40.0,
            630.0,
            13.0,
            "Heights along the path: the ray (red), the surface (brown), and the range of heights of each leaf that the path crosses.",
        );
        let path = &self.explanation.path;
        let mut along = vec![0.0];
        for pair in path.windows(2) {
            along.push(along[along.len() - 1] + pair[1].texel.distance(pair[0].texel));
        }
        let panel = Panel {
            x: [0.0, along[along.len() - 1]],
            y: [-0.02, 1.02],
            left: 60.0,
            top: 644.0,
            width: 900.0,
            height: 240.0,
        };
        panel.clip(svg, "side");
        let line = |height: &dyn Fn(&PathPoint) -> f64| -> Vec<DVec2> {
            let points = path.iter().zip(&along);
            points.map(|(p, &x)| DVec2::new(x, height(p))).collect()
        };
        let surface = line(&|p| self.map.sample(p.texel).height);
        let mut ground = surface.clone();
        ground.extend([DVec2::new(panel.x[1], -1.0), DVec2::new(0.0, -1.0)]);
        panel.polygon(svg, &ground, "fill=\"#e5dccd\"");
        for leaf in self.leaves() {
            let [low, high] = leaf.part.texels;
            let inside: Vec<f64> = path
                .iter()
                .zip(&along)
                .filter(|(p, _)| p.texel.cmpge(low).all() && p.texel.cmple(high).all())
                .map(|(_, &x)| x)
                .collect();
            if let (Some(&from), Some(&to)) = (inside.first(), inside.last()) {
                let [bottom, top] = leaf.part.heights;
                let ends = [DVec2::new(from, bottom), DVec2::new(to, top)];
                panel.rectangle(svg, ends, &style(leaf.part.fate, 0.7, 1.0));
            }
        }
        let style = format!("stroke=\"{GROUND}\" stroke-width=\"1.6\"");
        panel.line(svg, surface.into_iter(), &style);
        let style = format!("stroke=\"{RAY}\" stroke-width=\"2.2\"");
        panel.line(svg, line(&|p| p.height).into_iter(), &style);
        svg.push_str("</g>\n");
        let hit = self.hit();
        let next = path
            .partition_point(|p| p.t < hit.t)
            .clamp(1, path.len() - 1);
        let part = (hit.t - path[next - 1].t) / (path[next].t - path[next - 1].t);
        let at = along[next - 1] + part * (along[next] - along[next - 1]);
        panel.ring(svg, DVec2::new(at, hit.height));
        panel.frame(svg);
        let _ = writeln!(
            svg,
            "<text transform=\"translate(50 764) rotate(-90)\" text-anchor=\"middle\" font-size=\"11\" fill=\"{INK}\">height in the map</text>"
        );
        let mut at = 0.0;
        while at <= panel.x[1] {
            let x = panel.x(at);
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} 884v5\" stroke=\"{INK}\"/>\
                 <text x=\"{x:.1}\" y=\"901\" text-anchor=\"middle\" font-size=\"11\" fill=\"{INK}\">{at}</text>"
            );
            at += 10.0;
        }
        let _ = writeln!(
            svg,
            "<text x=\"960\" y=\"917\" text-anchor=\"end\" font-size=\"11\" fill=\"{INK}\">texels along the path</text>"
        );
    }
}

/// Of a part.
fn style(fate: Fate, opacity: f64, width: f64) -> String {
    let (fill, line) = look(fate);
    format!("fill=\"{fill}\" fill-opacity=\"{opacity}\" stroke=\"{line}\" stroke-width=\"{width}\"")
}

fn legend(svg: &mut String, [x, y]: [f64; 2], (fill, line): (&str, &str), name: &str) {
    let _ = writeln!(
        svg,
        "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"16\" height=\"13\" fill=\"{fill}\" stroke=\"{line}\"/>"
    );
    text(svg, x + 23.0, y + 11.0, 13.0, name);
}

fn text(svg: &mut String, x: f64, y: f64, size: f64, words: &str) {
    let weight = if size > 16.0 { "600" } else { "400" };
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" font-weight=\"{weight}\" fill=\"{INK}\">{words}</text>"
    );
}
