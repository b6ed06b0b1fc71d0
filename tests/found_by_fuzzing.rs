//! What the fuzzer of fuzz/ has found, and what resembles it: odd meshes, maps and rays keep the laws of hits.

use std::sync::Arc;

use glam::{Vec2, Vec3, vec2, vec3};
use prismarch::prism::{EditBounds, Lod, March, PrismOptions, Prisms, SimdLevel, Step};
use prismarch::ray::Ray;
use prismarch::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, TexelRect, Texels,
    UvTransform, Wrap,
};

struct Scene {
    mesh: MeshBuilder,
    mode: NormalMode,
    map: Arc<DisplacementMap>,
    displacement: Displacement,
    options: PrismOptions,
}

impl Scene {
    fn exact(mesh: MeshBuilder, map: DisplacementMap, scale: f32, midlevel: f32) -> Self {
        Self {
            mesh,
            mode: NormalMode::File,
            map: Arc::new(map),
            displacement: Displacement {
                midlevel,
                ..Displacement::new(scale)
            },
            options: PrismOptions {
                lod: Lod::Off,
                march: March::Exact,
                edit_bounds: EditBounds::Tight,
            },
        }
    }

    /// At every SIMD level.
    fn prisms(&self) -> Vec<Prisms> {
        let (mesh, _) = self.mesh.clone().build(self.mode).unwrap();
        let surface =
            DisplacedSurface::new(Arc::new(mesh), self.map.clone(), self.displacement).unwrap();
        let surface = Arc::new(surface);
        [SimdLevel::Baseline, SimdLevel::Avx2]
            .into_iter()
            .filter_map(|level| {
                let prisms = Prisms::new(surface.clone(), self.options).unwrap();
                prisms.with_simd(level)
            })
            .collect()
    }
}

/// How many hits the rays have, all of them sound.
#[track_caller]
fn hits(prisms: &Prisms, rays: &[Ray]) -> usize {
    let mut count = 0;
    for ray in rays {
        for primitive in 0..prisms.len() as u32 {
            let hit = prisms.intersect(primitive, ray);
            assert_eq!(prisms.occluded(primitive, ray), hit.is_some(), "{ray:?}");
            let Some(hit) = hit else { continue };
            assert!(ray.tnear < hit.t && hit.t < ray.tfar, "{hit:?}");
            assert!(hit.u >= 0.0 && hit.v >= 0.0, "{hit:?}");
            assert!(hit.u + hit.v <= 1.000_001, "{hit:?}");
            assert!((hit.ng.length() - 1.0).abs() < 1e-4, "{hit:?}");
            let point = prisms.point(hit.prim, hit.u, hit.v);
            assert!(point.position.is_finite(), "{hit:?} {point:?}");
            count += 1;
        }
    }
    count
}

fn mesh(corners: [(Vec3, Vec3, Vec2); 3]) -> MeshBuilder {
    MeshBuilder {
        positions: corners.map(|c| c.0).to_vec(),
        normals: corners.map(|c| c.1).to_vec(),
        texcoords: corners.map(|c| c.2).to_vec(),
        triangles: vec![[0, 1, 2]],
    }
}

/// Rays from all around towards points near the origin.
fn around(distance: f32, spread: f32) -> Vec<Ray> {
    (0..200)
        .map(|k| {
            let (a, z) = (2.399_963 * k as f32, (k as f32 + 0.5) / 100.0 - 1.0);
            let r = (1.0 - z * z).sqrt();
            let from = vec3(r * a.cos(), r * a.sin(), z);
            let target = spread * vec3((1.7 * a).sin(), (2.3 * a).cos(), (0.9 * a).sin());
            Ray::new(distance * from, target - distance * from)
        })
        .collect()
}

/// Any crossing and the first one are looked for by different ways through the same cells.
#[test]
fn what_occludes_is_a_hit() {
    let tiny = 2.621_399_8e-5;
    let mesh = mesh([
        (vec3(0.0, 0.0, 0.125), Vec3::ZERO, vec2(0.5, 0.0)),
        (
            vec3(-0.000_122_070_31, 3.218_628, tiny),
            vec3(f32::EPSILON, -1.0, -1.0),
            vec2(tiny, 1.300_8e-5),
        ),
        (
            vec3(-3.137_329, -3.418_579, -3.137_329),
            vec3(-3.137_329, -3.137_329, tiny),
            vec2(-3.137_329, -3.137_329),
        ),
    ]);
    let mut texels = vec![102; 49];
    texels[11] = 93;
    texels[25..40].copy_from_slice(&[49, 49, 48, 10, 142, 46, 142, 142, 126, 50, 50, 78, 0, 0, 0]);
    let map = DisplacementMap::new(7, 7, Texels::U8(texels), Wrap::Repeat).unwrap();
    let scene = Scene::exact(mesh, map, tiny, tiny);
    let mut rays = around(5.0, 2.0);
    rays.push(Ray::new(
        vec3(tiny, tiny, -3.137_329),
        vec3(-3.137_355_3, -3.137_355_3, 3.781_25),
    ));
    for prisms in scene.prisms() {
        assert!(hits(&prisms, &rays) > 0);
    }
}

/// A map that is repeated over a thousand times along one side, of a triangle with a normal of zero and one of 10^15.
#[test]
fn maps_repeated_a_thousand_times() {
    let mesh = mesh([
        (Vec3::ZERO, Vec3::ZERO, vec2(0.125, 1000.0)),
        (Vec3::splat(-1.0), vec3(-1.0, 1e15, 0.0), Vec2::splat(-1.0)),
        (
            vec3(0.0, -7.125, -3.547_119_1),
            vec3(0.0, 0.0, -7.125),
            Vec2::ZERO,
        ),
    ]);
    let texels = Texels::U16(vec![11918, 36494, 12926]);
    let map = DisplacementMap::new(1, 3, texels, Wrap::Clamp).unwrap();
    let mut scene = Scene::exact(mesh, map, -3.0, 0.5);
    scene.options.edit_bounds = EditBounds::Range;
    let mut rays = around(8.0, 3.0);
    rays.push(Ray {
        tnear: 1.0,
        tfar: 1.8125,
        ..Ray::new(vec3(-1.0, -1.0, 0.0), vec3(-1.0, 0.596_069_34, 0.0))
    });
    for prisms in scene.prisms() {
        assert!(hits(&prisms, &rays) > 0);
    }
}

/// No ray hangs on as many texels.
#[test]
fn texture_coordinates_of_ten_million() {
    for coordinate in [1e6, 1.6e7] {
        let mesh = mesh([
            (Vec3::ZERO, Vec3::Z, vec2(0.0, 1.0)),
            (vec3(-3.545_166, 0.017_334, 0.0), Vec3::Z, Vec2::ZERO),
            (
                vec3(0.0, 1.0, -3.576_416),
                Vec3::Z,
                vec2(0.017_334, coordinate),
            ),
        ]);
        let map =
            DisplacementMap::new(2, 2, Texels::U8(vec![0, 255, 90, 7]), Wrap::Repeat).unwrap();
        let scene = Scene::exact(mesh, map, -1.192_260_7, 0.5);
        let rays = &around(5.0, 2.0)[..2];
        for prisms in scene.prisms() {
            hits(&prisms, rays);
        }
    }
}

/// A ray on a plateau of a map that is repeated a million times is on neither side of any cell of it: no ray hangs on that.
#[test]
fn rays_on_a_plateau_of_a_map_repeated_a_million_times() {
    let mesh = mesh([
        (Vec3::ZERO, Vec3::Z, Vec2::ZERO),
        (Vec3::X, Vec3::Z, vec2(1e6, 0.0)),
        (Vec3::Y, Vec3::Z, vec2(0.0, 1e6)),
    ]);
    let texels = Texels::F32(vec![0.5, 0.5, 0.5, 0.5, 0.5, 1.0]);
    let map = DisplacementMap::new(3, 2, texels, Wrap::Mirror).unwrap();
    let scene = Scene::exact(mesh, map, 0.25, 0.0);
    let rays =
        [0.0, 1e-9, -1e-9].map(|slope| Ray::new(vec3(-1.0, 0.25, 0.125), vec3(1.0, 1e-3, slope)));
    for prisms in scene.prisms() {
        hits(&prisms, &rays);
    }
}

/// A triangle of 10^-17 under a displacement of 1/4: both tangents run along N to all digits.
#[test]
fn normals_of_triangles_tiny_beside_the_displacement() {
    let size = 5.459_277e-19;
    let mesh = mesh([
        (Vec3::ZERO, Vec3::splat(size), vec2(1000.0, 0.25)),
        (
            vec3(3.493_937e-17, size, 0.0),
            Vec3::Z,
            vec2(-1.0, -0.000_122),
        ),
        (
            vec3(1.397_574_8e-16, size, size),
            Vec3::ZERO,
            vec2(0.5, 0.0),
        ),
    ]);
    let mut texels = vec![0; 22];
    texels[..12].copy_from_slice(&[33, 0, 0, 255, 255, 15, 33, 33, 33, 10, 33, 33]);
    texels[16..].fill(13);
    let map = DisplacementMap::new(11, 2, Texels::U8(texels), Wrap::Repeat).unwrap();
    let mut scene = Scene::exact(mesh, map, 0.25, 0.25);
    scene.mode = NormalMode::Smooth { crease_angle: 0.0 };
    scene.options.edit_bounds = EditBounds::Range;
    let rays: Vec<Ray> = (1..40)
        .map(|k| {
            Ray::new(
                Vec3::new(size, size, 0.05 * k as f32 * size),
                size * Vec3::X,
            )
        })
        .collect();
    for prisms in scene.prisms() {
        assert!(hits(&prisms, &rays) > 0);
    }
}

/// A curve that begins a thousand times the size of a clamped map beside it, and comes back.
#[test]
fn clamped_maps_seen_from_far_beside_them() {
    let mesh = MeshBuilder {
        positions: vec![
            vec3(0.0, 0.0, -3.074_585),
            vec3(0.0, 1.0, 1.056_1e-5),
            Vec3::ZERO,
            vec3(3.846_271e-11, 3.756_124e-14, 3.756_124e-14),
        ],
        normals: vec![
            vec3(-3.082_397_5, -3.074_585, -0.012_084_961),
            vec3(5.188_226e-19, 7.758_099e-33, -7.8125),
            vec3(1e15, 0.25, 5.459_277e-19),
            vec3(3.756_124e-14, 8.075_089_5e-38, 0.0),
        ],
        texcoords: vec![
            Vec2::splat(-3.074_585),
            vec2(2.666_626, 1000.0),
            Vec2::ZERO,
            Vec2::splat(3.756_124e-14),
        ],
        triangles: vec![[0, 1, 2], [3, 0, 2]],
    };
    let mut texels = vec![1028; 64];
    texels[..32].fill(38807);
    for (k, texel) in [
        (5, 18247),
        (6, 18247),
        (18, 21780),
        (30, 21655),
        (31, 21845),
        (32, 85),
    ] {
        texels[k] = texel;
    }
    texels[19..22].fill(21845);
    texels[33..37].copy_from_slice(&[0, 38656, 24471, 104]);
    texels[37] = 1123;
    texels[51..].fill(65535);
    let map = DisplacementMap::new(8, 8, Texels::U16(texels), Wrap::Clamp).unwrap();
    let mut scene = Scene::exact(mesh, map, -3.074_585, -3.074_585);
    scene.options.edit_bounds = EditBounds::Range;
    let mut rays = around(20.0, 5.0);
    rays.push(Ray::new(vec3(-3.074_585, 0.0, 4.4375), Vec3::splat(4.4375)));
    for prisms in scene.prisms() {
        hits(&prisms, &rays);
    }
}

/// Ray parameters that are above tnear in double precision and round to it.
#[test]
fn ray_parameters_that_round_to_zero() {
    let mesh = MeshBuilder {
        positions: vec![
            vec3(0.0, 0.0, 0.031_25),
            vec3(0.0, 0.0, -0.062_622_07),
            vec3(-0.000_122_070_31, -0.000_122_070_31, 2.101_928_7),
        ],
        normals: Vec::new(),
        texcoords: vec![
            Vec2::ZERO,
            Vec2::splat(-0.000_122_070_31),
            Vec2::splat(4.1875),
        ],
        triangles: vec![[0, 1, 2]],
    };
    let map = DisplacementMap::new(1, 1, Texels::U8(vec![33]), Wrap::Repeat).unwrap();
    let scene = Scene::exact(mesh, map, 9.9e-8, 0.0);
    let origin = Vec3::splat(5.459_277e-19);
    let toward = |x: f32| Ray::new(origin, vec3(x, -0.000_122_070_31, -0.000_122_070_31));
    let rays = [-2.141_777_2e38, -1e37, -1e30, -1e20, 1e30].map(toward);
    for prisms in scene.prisms() {
        hits(&prisms, &rays);
    }
}

/// The ray meets the middle of a side between two opposed normals, where there is none: whatever is hit nearby is sound.
#[test]
fn beside_where_normals_cancel() {
    let tiny = -0.000_122_070_31;
    let mesh = MeshBuilder {
        positions: vec![
            vec3(f32::EPSILON, 0.0, tiny),
            vec3(0.25, 0.25, 2.446_719e-12),
            vec3(-3.906_372, tiny, tiny),
        ],
        normals: vec![Vec3::splat(0.25), Vec3::splat(tiny), Vec3::splat(0.25)],
        texcoords: vec![vec2(tiny, 0.25), vec2(0.0, -1000.0), vec2(tiny, 0.25)],
        triangles: vec![[0, 1, 2]],
    };
    let march = March::Uniform {
        step: Step::Texels(0.25),
        jitter: false,
    };
    for (march, texel) in [march, March::Exact].into_iter().zip([255, 8]) {
        let map = DisplacementMap::new(1, 1, Texels::U8(vec![texel]), Wrap::Repeat).unwrap();
        let mut scene = Scene::exact(mesh.clone(), map, f32::EPSILON, 1e15);
        scene.options.march = march;
        let mut rays = around(9.0, 3.0);
        rays.push(Ray::new(vec3(-0.125_122_07, tiny, tiny), Vec3::splat(tiny)));
        for prisms in scene.prisms() {
            hits(&prisms, &rays);
        }
    }
}

/// Where D is 0 the surface is there even where opposed normals cancel: the ray stays at one w and crosses it there. Hits have some normal.
#[test]
fn normals_where_vertex_normals_cancel() {
    let mesh = mesh([
        (Vec3::ZERO, Vec3::Z, vec2(0.0, 0.25)),
        (Vec3::X, Vec3::Z, vec2(0.0, 0.25)),
        (Vec3::Y, -Vec3::Z, vec2(0.0, 0.75)),
    ]);
    let map = DisplacementMap::new(1, 2, Texels::U8(vec![0, 255]), Wrap::Clamp).unwrap();
    let scene = Scene::exact(mesh, map, 1.0, 0.5);
    let rays: Vec<Ray> = (1..9)
        .map(|k| {
            let rise = 0.0625 * k as f32;
            Ray::new(vec3(0.25, -0.5, -rise), vec3(0.0, 1.0, rise))
        })
        .collect();
    for prisms in scene.prisms() {
        assert!(hits(&prisms, &rays) > 0);
    }
}

/// A surface that a huge displacement shrinks to a line has no normal: the uniform march hits nothing there.
#[test]
fn surfaces_shrunk_to_a_line() {
    let tiny = -0.000_122_070_31;
    let mesh = mesh([
        (vec3(0.0, 0.0, tiny), Vec3::NEG_ONE, Vec2::splat(tiny)),
        (
            vec3(-2.949_096_7, 0.0, 0.0),
            vec3(0.0, 0.0, -0.0),
            Vec2::ZERO,
        ),
        (Vec3::ZERO, Vec3::ZERO, Vec2::ZERO),
    ]);
    let map = DisplacementMap::new(1, 1, Texels::U8(vec![0]), Wrap::Repeat).unwrap();
    let mut scene = Scene::exact(mesh, map, 1e9, 1e9);
    scene.options.march = March::Uniform {
        step: Step::Texels(0.25),
        jitter: false,
    };
    let ray = Ray {
        tnear: 3.8125,
        ..Ray::new(
            vec3(-0.125_122_07, 1.913_696_3, 3.8125),
            Vec3::splat(3.8125),
        )
    };
    for prisms in scene.prisms() {
        hits(&prisms, &[ray]);
        let rect = TexelRect {
            x: 0,
            y: 0,
            width: 1,
            height: 1,
        };
        scene.map.update(rect, &Texels::U8(vec![26])).unwrap();
        prisms.map_edited(rect);
        assert_eq!(hits(&prisms, &[ray]), 0);
    }
}

/// Directions whose length is 0 in single precision, to hits whose ray parameters are at the end of its range and beyond it.
#[test]
fn ray_parameters_beyond_single_precision() {
    let mesh = mesh([
        (Vec3::ZERO, Vec3::Z, Vec2::ZERO),
        (Vec3::X, Vec3::Z, Vec2::X),
        (Vec3::Y, Vec3::Z, Vec2::Y),
    ]);
    let texels = Texels::F32((0..64).map(|k| 0.01 * (k * 7 % 13) as f32).collect());
    let map = DisplacementMap::new(8, 8, texels, Wrap::Repeat).unwrap();
    let mut scene = Scene::exact(mesh, map, 1.0, 0.0);
    let from = |height: f32| {
        let direction = vec3(1e-41, 0.0, -1e-39);
        Ray::new(vec3(0.2, 0.2, height), direction)
    };
    for lod in [Lod::Off, Lod::Cone] {
        scene.options.lod = lod;
        for prisms in scene.prisms() {
            prisms.set_spread(0.003);
            assert_eq!(hits(&prisms, &[from(0.3), from(0.25)]), 2);
            assert_eq!(hits(&prisms, &[from(0.6), from(1.0)]), 0);
        }
    }
}

/// Edits of a map of which a triangle reads one point.
#[test]
fn boxes_hold_the_surface_after_edits() {
    let mesh = mesh([
        (vec3(0.0, 3.125, 3.125), Vec3::Z, Vec2::splat(3.125)),
        (vec3(3.125, 3.125, 0.037_353_516), Vec3::Z, Vec2::ZERO),
        (Vec3::ZERO, Vec3::Z, Vec2::Y),
    ]);
    for march in [
        March::Exact,
        March::Uniform {
            step: Step::Texels(0.25),
            jitter: true,
        },
    ] {
        let texels = Texels::F32(vec![-2.5, 0.0, 0.0]);
        let map = DisplacementMap::new(1, 3, texels, Wrap::Mirror).unwrap();
        let mut scene = Scene::exact(mesh.clone(), map, 1.8125, 0.25);
        scene.mode = NormalMode::Smooth { crease_angle: 0.0 };
        scene.options.march = march;
        scene.displacement.uv = UvTransform {
            scale: Vec2::ZERO,
            rotation: 0.0,
            offset: vec2(0.0, -1e-39),
        };
        for prisms in scene.prisms() {
            for (y, texels) in [
                (1, vec![0.25, -1e-39]),
                (1, vec![0.0]),
                (0, vec![-0.94, 0.25]),
            ] {
                let rect = TexelRect {
                    x: 0,
                    y,
                    width: 1,
                    height: texels.len(),
                };
                scene.map.update(rect, &Texels::F32(texels)).unwrap();
                prisms.map_edited(rect);
                let bounds = prisms.bounds(0);
                let patch = prisms.surface().patch(0);
                for (u, v) in [(0.3, 0.3), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.5, 0.5)] {
                    let p = patch.point(u, v).position.as_vec3();
                    let slack = 1e-5 * (bounds.max - bounds.min).max_element();
                    let inside = (bounds.min - slack).cmple(p) & (bounds.max + slack).cmpge(p);
                    assert!(inside.all(), "{p} {bounds:?}");
                }
                hits(&prisms, &around(6.0, 2.0));
            }
        }
    }
}
