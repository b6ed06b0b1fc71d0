//! Triangles of all kinds with S over them in f64, and rays that see their blocks.

use std::sync::Arc;

use glam::{DVec2, DVec3, Quat, Vec2, Vec3};

use crate::prism::block::leaf::Leaf;
use crate::prism::block::middle::{Heights, Middle};
use crate::prism::block::place::Place;
use crate::prism::block::tests::Random;
use crate::prism::block::view::View;
use crate::prism::block::{Block, Cutter, LEAF, Record};
use crate::prism::judge::Cells;
use crate::prism::ray_frame::{RayFrame, axes};
use crate::prism::simd::Portable;
use crate::ray::Ray;
use crate::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Patch, Texels, Wrap,
};

impl Random {
    /// Between `low` and 1, and often one of these.
    pub fn end(&mut self, low: f32) -> f32 {
        let between = low + (1.0 - low) * self.next();
        self.of(&[between, low, 1.0])
    }

    pub fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[((self.next() * all.len() as f32) as usize).min(all.len() - 1)]
    }
}

/// What a triangle is like.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Texels across and up.
    pub texels: [f32; 2],
    /// How far normals lean apart.
    pub lean: f32,
    /// Of its sides, how far from the origin it lies in these, and how high its surface.
    pub size: f32,
    pub away: f32,
    pub height: f32,
}

impl Kind {
    fn any(random: &mut Random) -> Self {
        let long = random.of(&[4.0, 9.0, 30.0, 90.0, 300.0, 1500.0]);
        Self {
            texels: [long, long * random.of(&[1.0, 1.0, 0.1])],
            lean: random.of(&[0.0, 0.01, 0.1, 0.4, 1.0]),
            size: random.of(&[1e-4, 1.0, 1e4]),
            away: random.of(&[0.0, 1.0, 1e3]),
            height: random.of(&[0.001, 0.05, 0.5]),
        }
    }

    fn surface(self, random: &mut Random) -> DisplacedSurface {
        let size = || 40 + (random.0 >> 20) as usize % 60;
        let (width, height) = (size(), size());
        let turn = Quat::from_scaled_axis(3.0 * random.vector());
        let at = self.away * self.size * random.vector();
        let place = |p: [f32; 3]| turn * (self.size * Vec3::from(p)) + at;
        let mut corner = || turn * (Vec3::Z + self.lean * random.vector()).normalize();
        let normals = vec![corner(), corner(), corner()];
        let signs = Vec2::new(random.of(&[1.0, -1.0]), random.of(&[1.0, -1.0]));
        let across = signs * Vec2::from(self.texels) / Vec2::new(width as f32, height as f32);
        let st = Vec2::new(random.next(), random.next()) * 2.0 - 0.5;
        let builder = MeshBuilder {
            positions: vec![
                place([0.0; 3]),
                place([1.0, 0.1, 0.0]),
                place([0.2, 0.9, 0.1]),
            ],
            normals,
            texcoords: vec![
                st,
                st + across * Vec2::new(1.0, 0.3 * random.signed()),
                st + across * Vec2::new(0.3 * random.signed(), 1.0),
            ],
            triangles: vec![[0, 1, 2]],
        };
        let mesh = builder.build(NormalMode::File).unwrap().0;
        let count = width * height;
        let rough = random.of(&[1.0, 0.1]);
        let mut texel = || rough * random.next();
        let texels = match count % 3 {
            0 => Texels::U8((0..count).map(|_| (texel() * 255.0) as u8).collect()),
            1 => Texels::U16((0..count).map(|_| (texel() * 65535.0) as u16).collect()),
            _ => Texels::F32((0..count).map(|_| 3.0 * texel() - 1.0).collect()),
        };
        let wrap = random.of(&[Wrap::Repeat, Wrap::Clamp, Wrap::Mirror]);
        let map = DisplacementMap::new(width, height, texels, wrap).unwrap();
        let displacement = Displacement {
            midlevel: random.of(&[0.0, 0.5]),
            ..Displacement::new(self.height * self.size * random.signed())
        };
        DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap()
    }
}

/// A triangle that has blocks.
pub struct Case {
    pub kind: Kind,
    pub surface: DisplacedSurface,
    pub record: Record,
    pub blocks: Vec<Block>,
}

impl Case {
    pub fn new(kind: Kind, random: &mut Random) -> Option<Self> {
        let surface = kind.surface(random);
        let patch = surface.patch(0);
        let offsets = patch.offsets_of(surface.displacements(0));
        let mut blocks = Vec::new();
        let cut = Cutter::new(surface.map()).cut(0, &patch, offsets, |b| blocks.push(b));
        let record = cut.ok()?;
        Some(Self {
            kind,
            surface,
            record,
            blocks,
        })
    }

    pub fn truth(&self) -> Truth<'_> {
        let patch = self.surface.patch(0);
        let [p0, p1, p2] = patch.texels;
        Truth {
            sides: [p1 - p0, p2 - p0],
            patch,
        }
    }

    pub fn heights(&self) -> Heights {
        Heights::new(&self.surface)
    }

    pub fn place(&self, block: Block) -> Place<'_> {
        Place::new(self.surface.map(), &self.record, block)
    }

    /// A ray to a texel coordinate, from near or from far, often along the surface.
    fn ray(&self, random: &mut Random, texel: DVec2) -> Ray {
        let truth = self.truth();
        let to = truth.point(texel);
        let mut direction = random.vector().as_dvec3();
        if random.next() < 0.3 {
            let normal = truth.normal(texel).normalize();
            direction -= normal * (normal.dot(direction) * random.of(&[0.99, 0.9]));
        }
        let away = f64::from(self.kind.size * random.of(&[0.3, 2.0, 2.0, 1e4]));
        let origin = (to - away * direction.normalize()).as_vec3();
        let long = random.of(&[1.0, 1e-3, 1e3]);
        let direction = (to - origin.as_dvec3()).as_vec3() * long;
        let mut ray = Ray::new(origin, direction);
        if random.next() < 0.5 {
            ray.tnear = random.of(&[0.0, 0.5, 0.999, 1.0]) / long;
            ray.tfar = random.of(&[1.0, 1.000_01, 1.5, f32::INFINITY]) / long;
        }
        ray
    }

    fn first(&self, block: Block) -> DVec2 {
        let first = self.place(block).first;
        DVec2::new(first[0] as f64, first[1] as f64)
    }

    /// A texel coordinate in a block and in the triangle.
    fn texel(&self, random: &mut Random, block: Block) -> Option<DVec2> {
        let truth = self.truth();
        let Cells { x, y } = self.place(block).all();
        let mut along = |[a, b]: [i64; 2]| a as f64 + f64::from(random.next()) * (b - a + 1) as f64;
        (0..8)
            .map(|_| DVec2::new(along(x), along(y)))
            .find(|&texel| truth.is_inside(texel))
    }
}

/// S over the plane of texel coordinates, in f64.
pub struct Truth<'a> {
    pub patch: Patch<'a>,
    pub sides: [DVec2; 2],
}

impl Truth<'_> {
    pub fn uv(&self, texel: DVec2) -> [f64; 2] {
        let ([a, b], from) = (self.sides, texel - self.patch.texels[0]);
        let area = a.perp_dot(b);
        [from.perp_dot(b) / area, a.perp_dot(from) / area]
    }

    pub fn is_inside(&self, texel: DVec2) -> bool {
        let [u, v] = self.uv(texel);
        u.min(v).min(1.0 - u - v) >= 0.0
    }

    pub fn normal(&self, texel: DVec2) -> DVec3 {
        let [u, v] = self.uv(texel);
        self.patch.normal(u, v)
    }

    pub fn height(&self, texel: DVec2) -> f64 {
        let patch = &self.patch;
        patch.scale * (patch.map.sample(texel).height - patch.midlevel)
    }

    pub fn point(&self, texel: DVec2) -> DVec3 {
        self.raised(texel, self.height(texel))
    }

    pub fn raised(&self, texel: DVec2, height: f64) -> DVec3 {
        let [u, v] = self.uv(texel);
        self.patch.base(u, v) + height * self.patch.normal(u, v).normalize()
    }

    /// dP/dx and dP/dy, dN'/dx and dN'/dy.
    pub fn slopes(&self) -> [[DVec3; 2]; 2] {
        let zero = DVec2::ZERO;
        let along =
            |of: &dyn Fn(DVec2) -> DVec3| [of(DVec2::X) - of(zero), of(DVec2::Y) - of(zero)];
        let base = |texel: DVec2| {
            let [u, v] = self.uv(texel);
            self.patch.base(u, v)
        };
        [along(&base), along(&|texel| self.normal(texel))]
    }
}

/// Points of S as a ray sees them: lateral coordinates turned as the view's are, and the ray parameter.
pub struct Eye {
    pub frame: RayFrame,
    pub turn: DVec2,
}

impl Eye {
    fn new(frame: RayFrame, view: &View<'_>, truth: &Truth<'_>) -> Self {
        let mut eye = Self {
            frame,
            turn: DVec2::X,
        };
        // As the longer one of two vectors that both see.
        let [[ps, pt], _] = truth.slopes();
        let seen = [(view.x.p.s, view.y.p.s, ps), (view.x.p.t, view.y.p.t, pt)].map(|(x, y, p)| {
            let from = eye.lateral(p);
            (DVec2::new(x.into(), y.into()), from)
        });
        let (to, from) = if seen[0].1.length() > seen[1].1.length() {
            seen[0]
        } else {
            seen[1]
        };
        eye.turn = DVec2::new(from.dot(to), from.perp_dot(to)).normalize();
        eye
    }

    pub fn lateral(&self, v: DVec3) -> DVec2 {
        let [x, y, z] = self.frame.axes;
        DVec2::new(v[x], v[y]) - v[z] * DVec2::from(self.frame.shear)
    }

    pub fn sees(&self, point: DVec3) -> DVec3 {
        let RayFrame {
            axes: [x, y, z],
            origin,
            shear,
            per_depth,
        } = self.frame;
        let depth = point[z] - origin[2];
        let lateral =
            DVec2::new(point[x] - origin[0], point[y] - origin[1]) - depth * DVec2::from(shear);
        let turned = self.turn.rotate(lateral);
        turned.extend(depth * per_depth)
    }
}

/// Thousands of texels over one triangle, or thin ones: texel coordinates and barycentrics have few digits left, and most where a corner
/// is, far from where texels are counted from.
fn corners_of_large(random: &mut Random, k: usize) -> Option<Case> {
    let kind = Kind {
        texels: [
            [3000.0, 3000.0],
            [7000.0, 7000.0],
            [50000.0, 900.0],
            [50000.0, 20.0],
            [5000.0, 3.0],
        ][k % 5],
        ..Kind::any(random)
    };
    let mut case = Case::new(kind, random)?;
    let corners = case.truth().patch.texels;
    let far = |block: &Block| {
        let from = case.first(*block);
        let off = corners.map(|corner| (corner - from).abs().max_element());
        off[0].min(off[1]).min(off[2])
    };
    let near: Vec<Block> = case
        .blocks
        .iter()
        .copied()
        .filter(|b| far(b) < 80.0)
        .collect();
    case.blocks = near;
    Some(case)
}

/// A leaf of one of a triangle's blocks, as a ray sees it.
pub struct Sight<'a> {
    pub case: &'a Case,
    pub truth: Truth<'a>,
    pub block: Block,
    pub place: Place<'a>,
    pub heights: Heights,
    /// The leaf's first cell.
    pub at: [u32; 2],
    pub leaf: Leaf,
    pub ray: Ray,
    pub view: View<'a>,
    pub eye: Eye,
}

impl Sight<'_> {
    /// The texel coordinates of a point of the leaf, from its first texel.
    pub fn texel(&self, from: DVec2) -> DVec2 {
        let [x, y] = [0, 1].map(|k: usize| (self.place.first[k] + i64::from(self.at[k])) as f64);
        DVec2::new(x, y) + from
    }
}

/// Leaves of many triangles, each seen along a ray.
pub fn leaves(
    seed: u32,
    cases: usize,
    per_case: usize,
    mut look: impl FnMut(&mut Random, &Sight<'_>),
) {
    let mut random = Random(seed);
    for _ in 0..cases {
        let kind = Kind::any(&mut random);
        if let Some(case) = Case::new(kind, &mut random) {
            leaves_on(&mut random, &case, per_case, &mut look);
        }
    }
}

/// Leaves of large triangles, about their corners.
pub fn leaves_of_large(
    seed: u32,
    cases: usize,
    per_case: usize,
    mut look: impl FnMut(&mut Random, &Sight<'_>),
) {
    let mut random = Random(seed);
    for k in 0..cases {
        if let Some(case) = corners_of_large(&mut random, k) {
            leaves_on(&mut random, &case, per_case, &mut look);
        }
    }
}

/// The same of one triangle.
pub fn leaves_on(
    random: &mut Random,
    case: &Case,
    count: usize,
    look: &mut impl FnMut(&mut Random, &Sight<'_>),
) {
    for _ in 0..count {
        let (heights, truth) = (case.heights(), case.truth());
        let block = random.of(&case.blocks);
        let Some(texel) = case.texel(random, block) else {
            continue;
        };
        let exact = random.next() < 0.3;
        let ray = case.ray(random, if exact { texel.round() } else { texel });
        let frame = RayFrame::new(&ray, axes(&ray));
        let place = case.place(block);
        let middle = Middle::new::<Portable>(&case.record, block, &heights);
        let view = View::new::<Portable>(&case.record, &middle, &frame, &ray);
        if !view.is_sound {
            continue;
        }
        let cell = texel.floor();
        let at = [0, 1].map(|k: usize| {
            let n = (cell[k] as i64 - place.first[k]) as u32;
            n / LEAF[k] * LEAF[k]
        });
        let [s, t] = place.middle_of(view.middle, at, LEAF);
        let Some(leaf) = Leaf::new(&view, &heights, s, t) else {
            continue;
        };
        let eye = Eye::new(frame, &view, &truth);
        let sight = Sight {
            case,
            truth,
            block,
            place,
            heights,
            at,
            leaf,
            ray,
            view,
            eye,
        };
        look(random, &sight);
    }
}
