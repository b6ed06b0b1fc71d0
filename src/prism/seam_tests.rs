//! Closed seams make solids: lines cross them an even number of times, and nothing gets out of them unseen.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3, vec3};

use super::*;
use crate::surface::{
    Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, UvTransform, Wrap,
};

type Corner = (Vec3, Vec3, Vec2);

/// Numbers in [0, 1).
struct Random(u32);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let x = (self.0 >> ((self.0 >> 28) + 4) ^ self.0).wrapping_mul(277_803_737);
        ((x >> 22 ^ x) >> 8) as f32 / (1 << 24) as f32
    }

    fn signed(&mut self) -> Vec3 {
        vec3(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let d = self.signed();
            if (0.1..1.0).contains(&d.length_squared()) {
                return d;
            }
        }
    }

    /// A line through a box of this half size, from well outside.
    fn line(&mut self, half: f32) -> Ray {
        let direction = self.direction().normalize();
        Ray::new(half * self.signed() - 5.0 * half * direction, direction)
    }
}

fn rough(size: usize, wrap: Wrap) -> DisplacementMap {
    let mut random = Random(size as u32);
    let texels = (0..size * size).map(|_| (random.next() * 65535.0) as u16);
    DisplacementMap::new(size, size, Texels::U16(texels.collect()), wrap).unwrap()
}

fn mesh(corners: &[Corner]) -> MeshBuilder {
    MeshBuilder {
        positions: corners.iter().map(|c| c.0).collect(),
        normals: corners.iter().map(|c| c.1).collect(),
        texcoords: corners.iter().map(|c| c.2).collect(),
        triangles: (0..corners.len() as u32 / 3)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect(),
    }
}

fn surface(
    corners: &[Corner],
    map: DisplacementMap,
    displacement: Displacement,
) -> DisplacedSurface {
    let (mesh, _) = mesh(corners).build(NormalMode::File).unwrap();
    DisplacedSurface::new(Arc::new(mesh), Arc::new(map), displacement).unwrap()
}

fn levels(surface: &DisplacedSurface, seams: Seams) -> Vec<Prisms> {
    let surface = Arc::new(surface.clone().with_seams(seams));
    let prisms = |level| {
        Prisms::new(surface.clone(), March::Exact)
            .unwrap()
            .with_simd(level)
    };
    [SimdLevel::Baseline, SimdLevel::Avx2]
        .into_iter()
        .filter_map(prisms)
        .collect()
}

fn quad<T: Copy>([a, b, c, d]: [T; 4]) -> [T; 6] {
    [a, b, c, a, c, d]
}

const UNIT: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];

/// From -1 to 1, every face with its own normals and the whole map. The normals lean towards the corners by `lean`: else
/// walls below the base would lie in the planes of other faces, on one another.
fn cube(lean: f32) -> Vec<Corner> {
    let mut corners = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let (mut normal, mut s, mut t) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
            normal[axis] = sign;
            s[(axis + 1) % 3] = sign;
            t[(axis + 2) % 3] = 1.0;
            corners.extend(quad(UNIT.map(|c| {
                let (x, y) = (2.0 * c.x - 1.0, 2.0 * c.y - 1.0);
                let p = normal + x * s + y * t;
                (p, (normal + lean * p).normalize(), c)
            })));
        }
    }
    corners
}

/// The unit sphere by longitude and latitude. Coordinates jump behind, and around both poles.
fn sphere(columns: u32, rows: u32) -> Vec<Corner> {
    let corner = |i: u32, j: u32| {
        // Columns 0 and `columns`, and all of a pole, are the same bit for bit.
        let longitude = (i % columns) as f32 / columns as f32 * TAU;
        let latitude = (j as f32 / rows as f32 - 0.5) * PI;
        let p = match j {
            0 => -Vec3::Z,
            _ if j == rows => Vec3::Z,
            _ => vec3(
                latitude.cos() * longitude.cos(),
                latitude.cos() * longitude.sin(),
                latitude.sin(),
            ),
        };
        (
            p,
            p,
            Vec2::new(i as f32 / columns as f32, j as f32 / rows as f32),
        )
    };
    let mut corners = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let [a, b, c, d] =
                [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| corner(i, j));
            if j > 0 {
                corners.extend([a, b, c]);
            }
            if j + 1 < rows {
                corners.extend([a, c, d]);
            }
        }
    }
    corners
}

/// A displacement that no whole number of maps goes around with.
fn jumping(scale: f32, midlevel: f32) -> Displacement {
    Displacement {
        scale,
        midlevel,
        uv: UvTransform {
            scale: Vec2::new(1.37, 1.1),
            rotation: 0.3,
            offset: Vec2::new(0.1, 0.7),
        },
    }
}

fn first(prisms: &Prisms, ray: &Ray) -> Option<PrismHit> {
    (0..prisms.len() as u32)
        .filter_map(|p| prisms.intersect(p, ray))
        .min_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)))
}

/// All crossings, one after the other.
fn crossings(prisms: &Prisms, ray: &Ray) -> Vec<PrismHit> {
    let mut rest = *ray;
    let mut found = Vec::new();
    while let Some(hit) = first(prisms, &rest) {
        // The same root, found from another start, may be rounded the other way.
        rest.tnear = hit.t.next_up();
        found.push(hit);
    }
    let occluded = (0..prisms.len() as u32).any(|p| prisms.occluded(p, ray));
    assert_eq!(occluded, !found.is_empty(), "{ray:?}");
    found
}

/// Whether a wall's point is where the ray meets it.
fn check(prisms: &Prisms, ray: &Ray, hit: &PrismHit) {
    if (hit.prim as usize) < prisms.surface().mesh().triangles().len() {
        return;
    }
    let point = prisms.point(hit.prim, hit.u, hit.v);
    let off = point.position.distance(ray.at(hit.t));
    assert!(off < 2e-5, "{off} off: {hit:?} of {ray:?}");
    assert!(point.geometric_normal.distance(hit.ng) < 1e-3, "{hit:?}");
}

/// How many base triangles a line crosses.
fn base_crossings(surface: &DisplacedSurface, ray: &Ray) -> usize {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let crosses = |triangle: u32| {
        let [a, b, c] = surface
            .mesh()
            .corners(triangle)
            .map(|p| p.as_dvec3() - origin);
        let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|n| n.dot(direction) > 0.0);
        sides == [true; 3] || sides == [false; 3]
    };
    let triangles = surface.mesh().triangles().len() as u32;
    (0..triangles).filter(|&t| crosses(t)).count()
}

/// How many primitives but one are crossed at this t in single precision: who restarts the ray there sees only one of a wall and the
/// surface that it meets within half a unit in the last place.
fn tied(prisms: &Prisms, ray: &Ray, t: f32) -> usize {
    let there = Ray {
        tnear: t.next_down(),
        tfar: t.next_up(),
        ..*ray
    };
    let all = 0..prisms.len() as u32;
    let crossed = all.filter(|&primitive| prisms.intersect(primitive, &there).is_some());
    crossed.count().saturating_sub(1)
}

/// How many of `count` lines cross surface and walls oddly where they cross the base mesh evenly or the other way round,
/// and how often a wall was hit.
fn odd_lines(prisms: &Prisms, count: usize, half: f32) -> (usize, usize) {
    let mut random = Random(1);
    let (mut odd, mut walls) = (0, 0);
    for _ in 0..count {
        let ray = random.line(half);
        let hits = crossings(prisms, &ray);
        hits.iter().for_each(|hit| check(prisms, &ray, hit));
        let base = base_crossings(prisms.surface(), &ray);
        if (hits.len() + base) % 2 == 1 {
            let tied: usize = hits.iter().map(|hit| tied(prisms, &ray, hit.t)).sum();
            odd += (tied + 1) % 2;
        }
        let triangles = prisms.surface().mesh().triangles().len() as u32;
        walls += hits.iter().filter(|hit| hit.prim >= triangles).count();
    }
    (odd, walls)
}

/// Lines cross the closed surface as they cross the base mesh: evenly, if that is closed; the open one not always.
fn is_closed(surface: &DisplacedSurface, half: f32) {
    const LINES: usize = 4000;
    for prisms in levels(surface, Seams::Closed) {
        let (odd, walls) = odd_lines(&prisms, LINES, half);
        assert!(odd == 0, "{odd} of {LINES}");
        assert!(walls > LINES / 100, "{walls}");
    }
    for prisms in levels(surface, Seams::Open) {
        let (odd, walls) = odd_lines(&prisms, LINES, half);
        assert!(odd > LINES / 200 && walls == 0, "{odd} {walls}");
    }
}

/// Sides of the maps of noise.
const NOISE: [usize; 2] = [3, 16];

#[test]
fn a_cube_with_hard_edges_is_a_solid() {
    for (scale, midlevel, lean) in [(0.3, 0.0, 0.0), (0.4, 0.5, 0.1), (-0.3, 0.2, 0.2)] {
        let displacement = Displacement {
            midlevel,
            ..Displacement::new(scale)
        };
        for size in NOISE {
            let surface = surface(&cube(lean), rough(size, Wrap::Clamp), displacement);
            is_closed(&surface, 1.4);
        }
    }
}

#[test]
fn a_sphere_with_a_seam_is_a_solid() {
    for (scale, midlevel) in [(0.2, 0.0), (0.3, 0.5)] {
        for size in NOISE {
            let map = rough(size, Wrap::Repeat);
            let surface = surface(&sphere(12, 8), map, jumping(scale, midlevel));
            is_closed(&surface, 1.2);
        }
    }
}

#[test]
fn a_patch_with_borders_is_closed_down_to_its_base() {
    let at = |x: f32, y: f32| {
        let p = vec3(x, y, 0.2 * (x * y));
        let normal = vec3(-0.3 * y, -0.3 * x, 1.0).normalize();
        (p, normal, Vec2::new(x, y))
    };
    let cell = |x: f32, y: f32| {
        quad([
            at(x, y),
            at(x + 1.0, y),
            at(x + 1.0, y + 1.0),
            at(x, y + 1.0),
        ])
    };
    let cells = [(-1.0, -1.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 0.0)];
    let corners = cells.map(|(x, y)| cell(x, y)).concat();
    for size in NOISE {
        let surface = surface(&corners, rough(size, Wrap::Mirror), jumping(0.5, 0.3));
        is_closed(&surface, 1.1);
    }
}

#[test]
fn nothing_leaves_a_solid_unseen() {
    let cube = surface(&cube(0.0), rough(16, Wrap::Clamp), Displacement::new(0.3));
    let sphere = surface(&sphere(12, 8), rough(32, Wrap::Repeat), jumping(0.3, 0.5));
    for surface in [cube, sphere] {
        for prisms in levels(&surface, Seams::Closed) {
            let mut random = Random(2);
            for _ in 0..4000 {
                let ray = Ray::new(0.3 * random.signed(), random.direction());
                let hits = crossings(&prisms, &ray);
                assert_eq!(hits.len() % 2, 1, "{ray:?}: {hits:?}");
            }
        }
    }
}

#[test]
fn normals_point_out_of_the_solid() {
    let cube = surface(&cube(0.0), rough(16, Wrap::Clamp), Displacement::new(0.3));
    let sphere = surface(&sphere(12, 8), rough(32, Wrap::Repeat), jumping(0.3, 0.5));
    for surface in [cube, sphere] {
        let prisms = &levels(&surface, Seams::Closed)[0];
        let (mut random, mut wrong) = (Random(3), 0);
        for _ in 0..4000 {
            let ray = random.line(1.4);
            let hits = crossings(prisms, &ray);
            let alternate =
                |(k, hit): (usize, &PrismHit)| (hit.ng.dot(ray.direction) > 0.0) == (k % 2 == 1);
            wrong += usize::from(!hits.iter().enumerate().all(alternate));
        }
        assert_eq!(wrong, 0);
    }
}

#[test]
fn rays_along_the_faces_meet_walls_where_they_stand() {
    // Each face moves out by 0.25: a slab between the walls on its edges.
    let map = DisplacementMap::new(1, 1, Texels::F32(vec![1.0]), Wrap::Repeat).unwrap();
    let surface = surface(&cube(0.0), map, Displacement::new(0.25));
    for prisms in levels(&surface, Seams::Closed) {
        let mut random = Random(4);
        for k in 0..300 {
            let axis = k % 3;
            let [x, y] = [(axis + 1) % 3, (axis + 2) % 3];
            let sign = if random.next() < 0.5 { 1.0 } else { -1.0 };
            let (mut origin, mut direction) = (Vec3::ZERO, Vec3::ZERO);
            direction[axis] = sign;
            origin[axis] = -3.0 * sign;
            origin[x] = 1.01 + 0.23 * random.next();
            // Straight along the slab, or askew in its plane.
            origin[y] = 1.2 * (random.next() - 0.5);
            direction[y] = if k % 2 == 0 { 0.0 } else { 0.1 };
            let hits = crossings(&prisms, &Ray::new(origin, direction));
            let at: Vec<f32> = hits.iter().map(|hit| hit.t).collect();
            assert_eq!(at.len(), 2, "{origin} {direction} {hits:?}");
            assert!(
                (at[0] - 2.0).abs() < 1e-6 && (at[1] - 4.0).abs() < 1e-6,
                "{at:?}"
            );
            assert!(hits.iter().all(|hit| hit.prim >= 12));
            let height = origin[x] - 1.0;
            assert!(hits.iter().all(|hit| (4.0 * height - hit.v).abs() < 1e-5));
        }
    }
}

#[test]
fn walls_are_counted_and_open_surfaces_pay_nothing() {
    let surface = surface(&cube(0.0), rough(4, Wrap::Clamp), Displacement::new(0.1));
    let [open, closed] =
        [Seams::Open, Seams::Closed].map(|seams| levels(&surface, seams).remove(0));
    // One primitive for the two walls of each of twelve triangles: its number, and a box.
    assert_eq!(closed.len(), open.len() + 12);
    assert_eq!(closed.bytes(), open.bytes() + 24 * 28 + 12 * (4 + 24));
}

#[test]
fn the_uniform_march_refuses_closed_seams() {
    let surface = surface(&cube(0.0), rough(4, Wrap::Clamp), Displacement::new(0.1));
    let closed = Arc::new(surface.with_seams(Seams::Closed));
    let march = March::Uniform {
        step: Step::Texels(1.0),
        jitter: false,
    };
    assert_eq!(
        Prisms::new(closed, march).err(),
        Some(MarchError::SeamsNeedExact)
    );
}
