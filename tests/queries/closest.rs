//! `Prisms::closest` against dense samples of S, refined.

use glam::{Affine3A, DVec3, Mat3A, Quat, Vec2, Vec3};
use prismarch::prism::{March, Prisms, Step};
use prismarch::surface::{
    ClosestPoint, DisplacedSurface, MeshBuilder, PointQuery, UvTransform, Wrap,
};

use super::common::numbers::Numbers;
use super::definition::Definition;
use super::maps;
use super::meshes::{bent, displaced, flat, moved, torus, with_uv};
use super::surfaces::surfaces;

/// S at a lattice of every triangle.
struct Dense<'s> {
    definition: Definition<'s>,
    points: Vec<(u32, f64, f64, DVec3)>,
    step: f64,
}

impl<'s> Dense<'s> {
    fn new(surface: &'s DisplacedSurface, n: u32) -> Self {
        let definition = Definition::new(surface);
        let step = 1.0 / f64::from(n);
        let mut points = Vec::new();
        for prim in 0..surface.mesh().triangles().len() as u32 {
            for i in 0..=n {
                for j in 0..=n - i {
                    let (u, v) = (f64::from(i) * step, f64::from(j) * step);
                    points.push((prim, u, v, definition.position(prim, u, v)));
                }
            }
        }
        Self {
            definition,
            points,
            step,
        }
    }

    /// The distance of a place on S, and no place near one of the nearest samples is nearer.
    fn nearest(&self, to_world: &Affine3A, x: DVec3) -> f64 {
        let place = |p: DVec3| {
            let m = to_world.matrix3;
            let [a, b, c] = [m.x_axis, m.y_axis, m.z_axis].map(|v| Vec3::from(v).as_dvec3());
            a * p.x + b * p.y + c * p.z + to_world.translation.as_dvec3()
        };
        let mut all: Vec<_> = self
            .points
            .iter()
            .map(|&(prim, u, v, p)| (place(p).distance(x), prim, u, v))
            .collect();
        let count = 12.min(all.len() - 1);
        all.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0));
        let refined = all[..count].iter().map(|&(mut best, prim, mut u, mut v)| {
            // Around the best place so far, in ever smaller steps.
            let mut step = self.step;
            while step > 1e-9 {
                let before = best;
                for k in 0..16 {
                    let angle = std::f64::consts::TAU * f64::from(k) / 16.0;
                    let (a, b) = (u + step * angle.cos(), v + step * angle.sin());
                    if a < 0.0 || b < 0.0 || a + b > 1.0 {
                        continue;
                    }
                    let distance = place(self.definition.position(prim, a, b)).distance(x);
                    if distance < best {
                        (best, u, v) = (distance, a, b);
                    }
                }
                if best == before {
                    step *= 0.5;
                }
            }
            best
        });
        refined.fold(f64::INFINITY, f64::min)
    }
}

/// Every primitive asked in turn, the radius shrinking.
fn closest(prisms: &Prisms, query: &PointQuery) -> Option<ClosestPoint> {
    let mut best: Option<ClosestPoint> = None;
    for primitive in 0..prisms.len() as u32 {
        let radius = best.map_or(query.radius, |best| best.distance);
        let found = prisms.closest(primitive, &PointQuery { radius, ..*query });
        assert!(found.is_none_or(|found| found.distance <= radius));
        best = found.or(best);
    }
    best
}

fn prisms(surface: &std::sync::Arc<DisplacedSurface>) -> Prisms {
    Prisms::new(surface.clone(), March::Exact).unwrap()
}

/// No place is nearer than what is found, and what is found is on S at the distance that is told.
fn judge(name: &str, dense: &Dense<'_>, query: &PointQuery, found: &ClosestPoint) {
    let x = query.point.as_dvec3();
    let wanted = dense.nearest(&query.to_world, x);
    let distance = f64::from(found.distance);
    assert!(
        distance <= wanted * (1.0 + 2e-6) + 1e-6,
        "{name}: {distance}, but {wanted} is there; {query:?} {found:?}"
    );
    let told = found.point.as_dvec3().distance(x);
    assert!((told - distance).abs() <= 1e-6 * (1.0 + distance), "{name}");
    let (u, v) = (f64::from(found.u), f64::from(found.v));
    let on_surface = dense.definition.position(found.prim, u, v).as_vec3();
    let off = query
        .to_world
        .transform_point3(on_surface)
        .distance(found.point);
    // (u, v) are of single precision, and a spike's flank is steep.
    assert!(off < 2e-5, "{name}: {off} off S");
}

#[test]
fn nothing_is_nearer_than_the_nearest_point() {
    for (name, surface) in surfaces() {
        let dense = Dense::new(&surface, 40);
        let prisms = prisms(&surface);
        let mut numbers = Numbers::new(4);
        for _ in 0..40 {
            let reach = numbers.between(0.2, 3.0);
            let point = Vec3::new(0.5, 0.5, 0.0) + reach * numbers.number() * numbers.direction();
            let query = PointQuery::new(point, f32::INFINITY);
            let found = closest(&prisms, &query).expect("the radius is infinite");
            judge(name, &dense, &query, &found);
            // All of the surface at once, and prisms that are no clusters.
            let all = 0..surface.mesh().triangles().len() as u32;
            let at_once = surface.closest(all, &query).unwrap();
            assert!((at_once.distance - found.distance).abs() <= 3e-6 * found.distance.max(1.0));
        }
    }
}

#[test]
fn the_uniform_march_has_the_same_nearest_points() {
    let surface = displaced(torus(5), maps::white(16, 16, Wrap::Repeat), 0.2, 0.5);
    let march = March::Uniform {
        step: Step::Texels(1.0),
        jitter: false,
    };
    let [exact, uniform] =
        [March::Exact, march].map(|march| Prisms::new(surface.clone(), march).unwrap());
    let mut numbers = Numbers::new(5);
    for _ in 0..50 {
        let query = PointQuery::new(2.0 * numbers.direction(), 4.0);
        let [a, b] = [&exact, &uniform].map(|prisms| closest(prisms, &query).unwrap().distance);
        assert!((a - b).abs() < 3e-6, "{a} {b}");
    }
}

#[test]
fn transforms_are_the_surfaces() {
    let surface = displaced(bent(3), maps::white(12, 12, Wrap::Mirror), 0.2, 0.3);
    let (dense, prisms) = (Dense::new(&surface, 40), prisms(&surface));
    let turn = Quat::from_rotation_y(0.7);
    let mut sheared = Mat3A::from_quat(turn) * Mat3A::from_diagonal(Vec3::new(2.0, 0.3, -1.0));
    sheared.x_axis += 0.7 * sheared.y_axis;
    let transforms = [
        Affine3A::from_scale_rotation_translation(
            Vec3::splat(2.5),
            turn,
            Vec3::new(1.0, -2.0, 0.5),
        ),
        Affine3A::from_mat3_translation(sheared.into(), Vec3::new(-0.3, 0.2, 0.9)),
        // Flat.
        Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0)),
    ];
    let mut numbers = Numbers::new(6);
    for (k, to_world) in transforms.into_iter().enumerate() {
        for _ in 0..30 {
            let place = Vec3::from(to_world.translation);
            let point = place + 2.0 * numbers.number() * numbers.direction();
            let query = PointQuery {
                to_world,
                ..PointQuery::new(point, f32::INFINITY)
            };
            let found = closest(&prisms, &query).unwrap();
            judge(&format!("transform {k}"), &dense, &query, &found);
        }
    }
}

#[test]
fn a_radius_is_a_limit() {
    let surface = displaced(torus(6), maps::comb(24), 0.2, 0.0);
    let prisms = prisms(&surface);
    let mut numbers = Numbers::new(7);
    for _ in 0..100 {
        let query = PointQuery::new(2.0 * numbers.direction(), f32::INFINITY);
        let found = closest(&prisms, &query).unwrap();
        let within = |radius| closest(&prisms, &PointQuery { radius, ..query });
        assert_eq!(within(found.distance * 0.9999), None);
        assert_eq!(within(0.0), None);
        let again = within(found.distance * 1.001).unwrap();
        assert!((again.distance - found.distance).abs() < 2e-6);
    }
}

#[test]
fn points_on_the_surface_are_at_distance_zero() {
    for (name, surface) in surfaces() {
        let prisms = prisms(&surface);
        let mut numbers = Numbers::new(8);
        for _ in 0..100 {
            let prim = numbers.below(surface.mesh().triangles().len()) as u32;
            let (u, v) = numbers.barycentric();
            let point = surface.point(prim, u, v).position;
            let found = closest(&prisms, &PointQuery::new(point, 0.5)).unwrap();
            assert!(found.distance < 1e-6, "{name}: {found:?}");
            assert!(found.point.distance(point) < 2e-6, "{name}: {found:?}");
        }
    }
}

#[test]
fn points_that_are_none_have_no_neighbour() {
    let surface = displaced(flat(1), maps::ramp(4), 0.2, 0.0);
    let prisms = prisms(&surface);
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut point = Vec3::ZERO;
            point[axis] = x;
            assert_eq!(
                prisms.closest(0, &PointQuery::new(point, f32::INFINITY)),
                None
            );
        }
    }
    for radius in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        assert_eq!(
            prisms.closest(0, &PointQuery::new(Vec3::ZERO, radius)),
            None
        );
    }
    let to_world = Affine3A::from_translation(Vec3::new(f32::NAN, 0.0, 0.0));
    let query = PointQuery {
        to_world,
        ..PointQuery::new(Vec3::ZERO, 1.0)
    };
    assert_eq!(prisms.closest(0, &query), None);
    // Far away is not nowhere.
    let far = PointQuery::new(Vec3::new(0.0, 1e30, 0.0), f32::INFINITY);
    assert!(prisms.closest(0, &far).is_some());
}

/// Where all of the surface is equally near the search must end too.
#[test]
fn the_middle_of_a_ball_is_near_all_of_it() {
    let ball = super::common::scene::sphere(2);
    let scale = 1e-3;
    let ball = MeshBuilder {
        positions: ball.positions().iter().map(|p| scale * p).collect(),
        normals: ball.normals().to_vec(),
        texcoords: ball.texcoords().to_vec(),
        triangles: ball.triangles().to_vec(),
    };
    let surface = displaced(ball, maps::constant(1.0), 1.0, 0.0);
    let found = closest(
        &prisms(&surface),
        &PointQuery::new(Vec3::ZERO, f32::INFINITY),
    )
    .unwrap();
    assert!((found.distance - 1.0).abs() < 2.0 * scale, "{found:?}");
}

/// Slivers, tiny and huge triangles, far from the origin, and maps repeated until the surface fills its prisms.
#[test]
fn hostile_surfaces_have_nearest_points_too() {
    let repeated = |scale: f32| {
        let uv = UvTransform {
            scale: Vec2::splat(scale),
            ..UvTransform::default()
        };
        with_uv(bent(2), maps::white(8, 8, Wrap::Repeat), 0.3, 0.5, uv)
    };
    let placed = |scale: Vec3, shift: Vec3, height: f32| {
        let place = Affine3A::from_scale_rotation_translation(scale, Quat::IDENTITY, shift);
        displaced(
            moved(bent(3), place),
            maps::white(12, 12, Wrap::Clamp),
            height,
            0.5,
        )
    };
    let all = [
        ("repeated 1e3 times", repeated(1e3), Vec3::ZERO, 1.0),
        ("repeated 1e5 times", repeated(1e5), Vec3::ZERO, 1.0),
        (
            "slivers",
            placed(Vec3::new(1.0, 1e-4, 1.0), Vec3::ZERO, 0.1),
            Vec3::ZERO,
            1.0,
        ),
        (
            "tiny",
            placed(Vec3::splat(1e-6), Vec3::ZERO, 1e-7),
            Vec3::ZERO,
            1e-6,
        ),
        (
            "huge",
            placed(Vec3::splat(1e12), Vec3::ZERO, 1e11),
            Vec3::ZERO,
            1e12,
        ),
        (
            "far",
            placed(Vec3::ONE, Vec3::splat(1e4), 0.1),
            Vec3::splat(1e4),
            1.0,
        ),
        (
            "higher than wide",
            placed(Vec3::splat(1e-3), Vec3::ZERO, 3.0),
            Vec3::ZERO,
            1.0,
        ),
    ];
    for (name, surface, middle, size) in all {
        let prisms = prisms(&surface);
        let definition = Definition::new(&surface);
        let mut numbers = Numbers::new(16);
        for _ in 0..10 {
            let point = middle + size * numbers.between(0.1, 2.0) * numbers.direction();
            let found = closest(&prisms, &PointQuery::new(point, f32::INFINITY)).unwrap();
            let distance = f64::from(found.distance);
            for _ in 0..3000 {
                let prim = numbers.below(surface.mesh().triangles().len()) as u32;
                let (u, v) = numbers.barycentric();
                let sample = definition.position(prim, u.into(), v.into());
                let wanted = sample.distance(point.as_dvec3());
                let limit = wanted * (1.0 + 3e-6) + 1e-6 * f64::from(size);
                assert!(
                    distance <= limit,
                    "{name}: {distance}, but {wanted} is there"
                );
            }
        }
    }
}

/// Beyond what numbers can tell apart the search ends all the same.
#[test]
fn maps_repeated_beyond_measure_end_the_search() {
    for scale in [1e5, 4e6] {
        let uv = UvTransform {
            scale: Vec2::splat(scale),
            ..UvTransform::default()
        };
        let surface = with_uv(flat(1), maps::white(8, 8, Wrap::Repeat), 0.3, 0.5, uv);
        let query = PointQuery::new(Vec3::new(0.3, 0.4, 0.5), f32::INFINITY);
        let found = surface.closest([0], &query).unwrap();
        assert!(found.distance > 0.3 && found.distance < 0.5, "{found:?}");
    }
}
