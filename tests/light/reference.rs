//! What prismarch's pictures are held to: S cut into flat triangles in f64, lit by a plain path tracer in f64 with its own numbers.
//!
//! Nothing is shared with the renderer but the definition of S and the scene's numbers: no hit test, no shading normal, no sampling.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use prismarch::surface::DisplacedSurface;

/// How the surface scatters.
#[derive(Clone, Copy)]
pub enum Matter {
    /// Lambert's, by its albedo.
    Chalk(f64),
    /// GGX with Schlick's reflectance, by alpha and its reflectance at normal incidence.
    Metal { alpha: f64, reflectance: f64 },
    /// A smooth dielectric.
    Glass { index: f64 },
}

/// What shines. A point of it is found by looking (`Sky`, `Rectangle`) or by sampling alone.
#[derive(Clone, Copy)]
pub enum Lamp {
    /// Radiance 1 from all around.
    Sky,
    /// From far away: towards it, and the irradiance of a surface that faces it.
    Sun { to: DVec3, irradiance: f64 },
    /// Radiant intensity.
    Point { at: DVec3, intensity: f64 },
    /// Shines to the side of the product of its edges.
    Rectangle {
        corner: DVec3,
        edges: [DVec3; 2],
        radiance: f64,
    },
}

/// Triangles and what finds them.
pub struct Facets {
    triangles: Vec<[DVec3; 3]>,
    nodes: Vec<Node>,
}

struct Node {
    low: DVec3,
    high: DVec3,
    /// Triangles of a leaf, from and to; of an inner node its second child and 0, the first follows it.
    from: usize,
    to: usize,
}

struct Met {
    t: f64,
    /// Unit, outward.
    normal: DVec3,
}

const LEAF: usize = 4;

impl Facets {
    /// Every base triangle of the surface in `n` x `n` triangles.
    pub fn new(surface: &DisplacedSurface, n: usize) -> Self {
        let mut triangles = Vec::new();
        for prim in 0..surface.mesh().triangles().len() as u32 {
            let patch = surface.patch(prim);
            let at = |i: usize, j: usize| {
                patch
                    .point(i as f64 / n as f64, j as f64 / n as f64)
                    .position
            };
            for j in 0..n {
                for i in 0..n - j {
                    triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                    if i + j + 1 < n {
                        triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                    }
                }
            }
        }
        let mut nodes = Vec::new();
        let len = triangles.len();
        build(&mut triangles, 0, len, &mut nodes);
        Self { triangles, nodes }
    }

    fn meet(&self, origin: DVec3, direction: DVec3, most: f64) -> Option<Met> {
        let inverse = 1.0 / direction;
        let mut met: Option<(f64, usize)> = None;
        let mut stack = vec![0];
        while let Some(k) = stack.pop() {
            let node = &self.nodes[k];
            let limit = met.map_or(most, |(t, _)| t);
            let (a, b) = (
                (node.low - origin) * inverse,
                (node.high - origin) * inverse,
            );
            let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
            if near > far || far < 0.0 || near > limit {
                continue;
            }
            if node.to == 0 {
                stack.extend([node.from, k + 1]);
                continue;
            }
            for i in node.from..node.to {
                if let Some(t) = cross(&self.triangles[i], origin, direction)
                    && t < met.map_or(most, |(t, _)| t)
                {
                    met = Some((t, i));
                }
            }
        }
        met.map(|(t, i)| {
            let [a, b, c] = self.triangles[i];
            let normal = (b - a).cross(c - a).normalize();
            Met { t, normal }
        })
    }

    /// The mean radiance along rays from `eye` through uniform points of a square film around the origin, over those that meet the surface. `fov`
    /// is that of the film's height, radians. And how far off that mean may be: its standard error.
    pub fn mean(&self, eye: DVec3, fov: f64, matter: Matter, lamp: Lamp, paths: u32) -> [f64; 2] {
        let view = -eye.normalize();
        let right = view.cross(DVec3::Y).normalize();
        let up = right.cross(view);
        let half = (0.5 * fov).tan();
        let mut numbers = Numbers(7);
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0u32);
        for _ in 0..paths {
            let film = half * (2.0 * numbers.point() - 1.0);
            let direction = (view + film.x * right + film.y * up).normalize();
            if let Some(met) = self.meet(eye, direction, f64::INFINITY) {
                let radiance = self.radiance(eye, direction, met, matter, lamp, &mut numbers);
                sum += radiance;
                squares += radiance * radiance;
                count += 1;
            }
        }
        let count = f64::from(count);
        let mean = sum / count;
        [mean, ((squares / count - mean * mean) / count).sqrt()]
    }

    /// Along a ray that met the surface.
    fn radiance(
        &self,
        mut origin: DVec3,
        mut direction: DVec3,
        mut met: Met,
        matter: Matter,
        lamp: Lamp,
        numbers: &mut Numbers,
    ) -> f64 {
        let (mut sum, mut throughput) = (0.0, 1.0);
        for bounce in 0.. {
            let outside = met.normal.dot(direction) < 0.0;
            let normal = if outside { met.normal } else { -met.normal };
            let point = origin + met.t * direction;
            let (next, weight, samples_lamp) = match matter {
                Matter::Chalk(albedo) => {
                    sum += throughput * albedo / PI * self.sampled(point, normal, lamp, numbers);
                    (around(normal, cosine(numbers.point())), albedo, true)
                }
                Matter::Metal { alpha, reflectance } => {
                    let (next, weight) = metal(normal, -direction, alpha, reflectance, numbers);
                    (next, weight, false)
                }
                Matter::Glass { index } => {
                    let eta = if outside { index } else { 1.0 / index };
                    (glass(normal, direction, eta, numbers.number()), 1.0, false)
                }
            };
            throughput *= weight;
            let stays = if bounce < 4 {
                1.0
            } else {
                throughput.min(0.95)
            };
            if throughput <= 0.0 || numbers.number() >= stays {
                break;
            }
            throughput /= stays;
            // On the side where the ray goes.
            origin = point + 1e-7 * normal * normal.dot(next).signum();
            direction = next;
            let found = self.meet(origin, direction, f64::INFINITY);
            if !(samples_lamp && matches!(lamp, Lamp::Rectangle { .. })) {
                let reach = found.as_ref().map_or(f64::INFINITY, |met| met.t);
                sum += throughput * seen(lamp, origin, direction, reach);
            }
            let Some(found) = found else { break };
            met = found;
        }
        sum
    }

    /// The irradiance of one lamp by sampling it; 0 for what is found by looking.
    fn sampled(&self, point: DVec3, normal: DVec3, lamp: Lamp, numbers: &mut Numbers) -> f64 {
        let (to, distance, strength) = match lamp {
            Lamp::Sky => return 0.0,
            Lamp::Sun { to, irradiance } => (to, f64::INFINITY, irradiance),
            Lamp::Point { at, intensity } => {
                let to = at - point;
                (to.normalize(), to.length(), intensity / to.length_squared())
            }
            Lamp::Rectangle {
                corner,
                edges: [a, b],
                radiance,
            } => {
                let u = numbers.point();
                let to = corner + u.x * a + u.y * b - point;
                let facing = -to.normalize().dot(a.cross(b));
                let strength = radiance * facing.max(0.0) / to.length_squared();
                (to.normalize(), to.length(), strength)
            }
        };
        let cos = normal.dot(to);
        if cos <= 0.0 || strength == 0.0 {
            return 0.0;
        }
        let hidden = self.meet(point + 1e-7 * normal, to, distance * (1.0 - 1e-9));
        if hidden.is_some() {
            0.0
        } else {
            cos * strength
        }
    }
}

/// Radiance of what a ray sees of a lamp before `reach`.
fn seen(lamp: Lamp, origin: DVec3, direction: DVec3, reach: f64) -> f64 {
    match lamp {
        Lamp::Sky if reach == f64::INFINITY => 1.0,
        Lamp::Rectangle {
            corner,
            edges: [a, b],
            radiance,
        } => {
            let normal = a.cross(b);
            let t = (corner - origin).dot(normal) / direction.dot(normal);
            let at = origin + t * direction - corner;
            let (u, v) = (
                at.dot(a) / a.length_squared(),
                at.dot(b) / b.length_squared(),
            );
            let inside = (0.0..1.0).contains(&u) && (0.0..1.0).contains(&v);
            let shines = t > 0.0 && t < reach && direction.dot(normal) < 0.0;
            if inside && shines { radiance } else { 0.0 }
        }
        _ => 0.0,
    }
}

/// Where light goes on from a rough metal, and its weight: a walk from facet to facet until it leaves, so that nothing is lost (Heitz et al., "Multiple-
/// Scattering Microfacet BSDFs with the Smith Model", SIGGRAPH 2016, section 4), facets at uniform heights in -1 .. 1.
fn metal(
    normal: DVec3,
    v: DVec3,
    alpha: f64,
    reflectance: f64,
    numbers: &mut Numbers,
) -> (DVec3, f64) {
    let x = normal.any_orthonormal_vector();
    let axes = [x, normal.cross(x), normal];
    let mut way = -DVec3::from_array(axes.map(|axis| axis.dot(v)));
    let mut weight = 1.0;
    let mut below: f64 = 1.0; // part of the heights below
    loop {
        // Light that goes straight up or down meets every height, or none.
        let tan2 = (1.0 - way.z * way.z) / (way.z * way.z);
        let root = (1.0 + alpha * alpha * tan2).sqrt();
        let lambda = 0.5 * (way.z.signum() * root - 1.0);
        let u = numbers.number();
        let free = below.powf(lambda);
        if way.z > 0.0 && (u <= free || lambda < 1e-12) {
            return (around(normal, way), weight);
        }
        below /= (1.0 - if way.z > 0.0 { u } else { u.min(1.0 - 1e-12) }).powf(1.0 / lambda);
        below = below.clamp(1e-12, 1.0);
        let half = facet(-way, alpha, numbers.point());
        let cos = -way.dot(half);
        weight *= reflectance + (1.0 - reflectance) * (1.0 - cos).clamp(0.0, 1.0).powi(5);
        way = (way + 2.0 * cos * half).normalize();
    }
}

/// A facet as it is seen from `v` (Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023).
fn facet(v: DVec3, alpha: f64, u: DVec2) -> DVec3 {
    let stretched = DVec3::new(alpha * v.x, alpha * v.y, v.z).normalize();
    let z = (1.0 - u.x) * (1.0 + stretched.z) - stretched.z;
    let (sin, turn) = ((1.0 - z * z).max(0.0).sqrt(), TAU * u.y);
    let half = DVec3::new(sin * turn.cos(), sin * turn.sin(), z) + stretched;
    DVec3::new(alpha * half.x, alpha * half.y, half.z.max(0.0)).normalize()
}

/// Mirrored or bent by Fresnel's chance.
fn glass(normal: DVec3, direction: DVec3, eta: f64, choice: f64) -> DVec3 {
    let cos = -normal.dot(direction);
    let mirrored = direction + 2.0 * cos * normal;
    let beyond2 = 1.0 - (1.0 - cos * cos) / (eta * eta);
    if beyond2 <= 0.0 {
        return mirrored;
    }
    let beyond = beyond2.sqrt();
    let [s, p] = [
        (cos - eta * beyond) / (cos + eta * beyond),
        (eta * cos - beyond) / (eta * cos + beyond),
    ];
    if choice < 0.5 * (s * s + p * p) {
        return mirrored;
    }
    ((direction + cos * normal) / eta - beyond * normal).normalize()
}

fn cosine(u: DVec2) -> DVec3 {
    let (radius, turn) = (u.x.sqrt(), TAU * u.y);
    DVec3::new(radius * turn.cos(), radius * turn.sin(), (1.0 - u.x).sqrt())
}

/// From the axes of a normal to the world's.
fn around(normal: DVec3, local: DVec3) -> DVec3 {
    let x = normal.any_orthonormal_vector();
    local.x * x + local.y * normal.cross(x) + local.z * normal
}

fn cross([a, b, c]: &[DVec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    let (e1, e2) = (*b - *a, *c - *a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let s = (origin - *a) / determinant;
    let u = s.dot(p);
    let q = s.cross(e1);
    let v = direction.dot(q);
    let t = e2.dot(q);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

fn build(triangles: &mut [[DVec3; 3]], from: usize, to: usize, nodes: &mut Vec<Node>) {
    let own = &mut triangles[from..to];
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in own.iter().flatten() {
        (low, high) = (low.min(*p), high.max(*p));
    }
    let index = nodes.len();
    nodes.push(Node {
        low,
        high,
        from,
        to,
    });
    if own.len() <= LEAF {
        return;
    }
    let axis = (0..3)
        .max_by(|&i, &j| (high - low)[i].total_cmp(&(high - low)[j]))
        .unwrap();
    let middle = own.len() / 2;
    let place = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
    own.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
    build(triangles, from, from + middle, nodes);
    (nodes[index].from, nodes[index].to) = (nodes.len(), 0);
    build(triangles, from + middle, to, nodes);
}

/// SplitMix64.
struct Numbers(u64);

impl Numbers {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn point(&mut self) -> DVec2 {
        DVec2::new(self.number(), self.number())
    }
}
