use std::collections::HashMap;

use super::limit::Limit;
use super::*;
use glam::{DVec3, vec3};

/// OpenSubdiv's standard shapes with their vertices after refinements, as its regression suite publishes them
/// (regression/shapes and regression/hbr_regression/baseline), six digits each.
const OPENSUBDIV: &str = include_str!("tests/opensubdiv.txt");

fn cage(positions: &[[f32; 3]], faces: &[&[u32]]) -> Cage {
    Cage {
        positions: positions.iter().map(|&p| p.into()).collect(),
        sizes: faces.iter().map(|f| f.len() as u32).collect(),
        corners: faces.concat(),
        ..Cage::default()
    }
}

/// The level 0 of a cage, with its creases.
fn level(cage: &Cage) -> Level {
    let mut surface = cage.surface();
    surface.crease(cage, std::f32::consts::PI);
    surface.shape
}

fn limit(level: &Level, vertex: usize, scheme: Scheme) -> Limit {
    level.limit(level.corners_at_vertices().of(vertex), scheme)
}

fn cube() -> Cage {
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|b| b as f32 * 2.0 - 1.0);
    let positions: Vec<_> = (0..8).map(corner).collect();
    let faces: [&[u32]; 6] = [
        &[0, 2, 3, 1],
        &[4, 5, 7, 6],
        &[0, 1, 5, 4],
        &[2, 6, 7, 3],
        &[0, 4, 6, 2],
        &[1, 3, 7, 5],
    ];
    cage(&positions, &faces)
}

fn octahedron() -> Cage {
    let mut positions = Vec::new();
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        positions.extend([axis.to_array(), (-axis).to_array()]);
    }
    let faces: [&[u32]; 8] = [
        &[0, 2, 4],
        &[2, 1, 4],
        &[1, 3, 4],
        &[3, 0, 4],
        &[2, 0, 5],
        &[1, 2, 5],
        &[3, 1, 5],
        &[0, 3, 5],
    ];
    cage(&positions, &faces)
}

/// A bumpy grid of triangles or quads, open on all sides.
fn sheet(n: u32, scheme: Scheme) -> Cage {
    let mut positions = Vec::new();
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for y in 0..=n {
        for x in 0..=n {
            let height = ((x * 7 + y * 5) % 4) as f32 * 0.3;
            positions.push([x as f32, y as f32, height]);
            if x < n && y < n {
                let a = y * (n + 1) + x;
                let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
                match scheme {
                    Scheme::CatmullClark => faces.push(vec![a, b, c, d]),
                    // Fans of all sizes.
                    Scheme::Loop if (x + y) % 3 == 0 => {
                        faces.extend([vec![a, b, c], vec![a, c, d]])
                    }
                    Scheme::Loop => faces.extend([vec![a, b, d], vec![b, c, d]]),
                }
            }
        }
    }
    let faces: Vec<&[u32]> = faces.iter().map(|f| &f[..]).collect();
    cage(&positions, &faces)
}

/// Cages with every kind of vertex there is.
fn samples() -> Vec<(Cage, Scheme)> {
    let mut samples = Vec::new();
    for (closed, scheme) in [
        (cube(), Scheme::CatmullClark),
        (octahedron(), Scheme::CatmullClark),
        (octahedron(), Scheme::Loop),
        (sheet(5, Scheme::CatmullClark), Scheme::CatmullClark),
        (sheet(5, Scheme::Loop), Scheme::Loop),
    ] {
        let first = closed.corners[0];
        let next = closed.corners[1];
        let infinite = Cage {
            creases: vec![([first, next], 10.0)],
            ..closed.clone()
        };
        let around = closed.corners[..closed.sizes[0] as usize].to_vec();
        let pairs = (0..around.len()).map(|i| [around[i], around[(i + 1) % around.len()]]);
        let ring = Cage {
            creases: pairs.clone().map(|pair| (pair, 10.0)).collect(),
            ..closed.clone()
        };
        let soft = Cage {
            creases: pairs.zip([1.7, 0.4, 2.3, 1.0]).collect(),
            sharp_vertices: vec![(next, 1.4)],
            ..closed.clone()
        };
        let pinned = Cage {
            sharp_vertices: vec![(first, 12.0)],
            ..closed.clone()
        };
        let all = [closed, infinite, ring, soft, pinned];
        samples.extend(all.map(|cage| (cage, scheme)));
    }
    samples
}

struct Published {
    name: String,
    cage: Cage,
    levels: Vec<(usize, Vec<DVec3>)>,
}

fn published() -> Vec<Published> {
    let mut shapes: Vec<Published> = Vec::new();
    for line in OPENSUBDIV.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let numbers =
            |words: &[&str]| -> Vec<f64> { words.iter().map(|w| w.parse().unwrap()).collect() };
        if words[0] == "shape" {
            shapes.push(Published {
                name: words[1].to_owned(),
                cage: Cage::default(),
                levels: Vec::new(),
            });
            continue;
        }
        let shape = shapes.last_mut().unwrap();
        match words[0] {
            "v" => {
                let p = numbers(&words[1..]);
                shape.cage.positions.push(DVec3::from_slice(&p).as_vec3());
            }
            "f" => {
                shape.cage.sizes.push(words.len() as u32 - 1);
                let corners = words[1..].iter().map(|w| w.parse::<u32>().unwrap());
                shape.cage.corners.extend(corners);
            }
            "crease" => {
                let n = numbers(&words[1..]);
                let pair = [n[0] as u32, n[1] as u32];
                shape.cage.creases.push((pair, n[2] as f32));
            }
            "corner" => {
                let n = numbers(&words[1..]);
                shape.cage.sharp_vertices.push((n[0] as u32, n[1] as f32));
            }
            "level" => shape.levels.push((words[1].parse().unwrap(), Vec::new())),
            _ => {
                let point = DVec3::from_slice(&numbers(&words));
                shape.levels.last_mut().unwrap().1.push(point);
            }
        }
    }
    shapes
}

#[test]
fn refined_vertices_are_those_that_opensubdiv_publishes() {
    let shapes = published();
    assert!(shapes.len() >= 12);
    for Published { name, cage, levels } in shapes {
        let scheme = match name.starts_with("loop") {
            true => Scheme::Loop,
            false => Scheme::CatmullClark,
        };
        let mut level = level(&cage);
        let mut at = 0;
        for (number, expected) in levels {
            while at < number {
                level = level.refined(scheme);
                at += 1;
            }
            // Coincident vertices are published once.
            let near = |p: DVec3, all: &[DVec3]| {
                let distances = all.iter().map(|q| p.distance(*q));
                distances.fold(f64::INFINITY, f64::min)
            };
            for &p in &level.points {
                let off = near(p, &expected);
                assert!(off < 2e-5, "{name} level {number}: {p} is {off} from any");
            }
            for &p in &expected {
                let off = near(p, &level.points);
                assert!(off < 2e-5, "{name} level {number}: none at {p} ({off})");
            }
        }
    }
}

#[test]
fn the_limit_does_not_depend_on_the_level() {
    for (number, (cage, scheme)) in samples().into_iter().enumerate() {
        let mut level = level(&cage).refined(scheme);
        for _ in 0..2 {
            let next = level.refined(scheme);
            for vertex in 0..level.points.len() {
                let (a, b) = (limit(&level, vertex, scheme), limit(&next, vertex, scheme));
                let off = a.point.distance(b.point);
                assert!(off < 1e-12, "sample {number}, vertex {vertex}: {off}");
                assert_eq!(a.sectors, b.sectors, "sample {number}, vertex {vertex}");
                // A corner in the midst of smooth faces is the tip of a cone.
                let is_tip =
                    a.sectors.iter().all(|&s| s == 0) && level.vertex_sharpness[vertex] > 0.0;
                for (a, b) in a.normals.iter().zip(&b.normals).filter(|_| !is_tip) {
                    let off = a.distance(*b);
                    assert!(off < 1e-7, "sample {number}, vertex {vertex}: {a} {b}");
                }
            }
            level = next;
        }
    }
}

#[test]
fn limits_are_those_of_the_literature() {
    // Halstead, Kass and DeRose 1993: (n^2 v + 4 sum e + sum f) / (n (n + 5)), of a vertex among quads.
    let smooth = level(&cube());
    let expected = (9.0 * DVec3::splat(-1.0)
        + 4.0 * DVec3::new(-1.0, -1.0, -1.0)
        + DVec3::new(1.0, 1.0, -1.0)
        + DVec3::new(1.0, -1.0, 1.0)
        + DVec3::new(-1.0, 1.0, 1.0))
        / 24.0;
    let found = limit(&smooth, 0, Scheme::CatmullClark);
    assert!(found.point.distance(expected) < 1e-15);
    assert!(found.normals[0].distance(expected.normalize()) < 1e-15);
    // Loop 1987: 1/(n + 3/(8 beta)) of each neighbour; beta = 31/256 for four (5/8 - (3/8)^2 = 31/64).
    let found = limit(&level(&octahedron()), 0, Scheme::Loop);
    let neighbour = 1.0 / (4.0 + 3.0 * 256.0 / (8.0 * 31.0));
    let expected = DVec3::X * (1.0 - 4.0 * neighbour);
    assert!(found.point.distance(expected) < 1e-15, "{found:?}");
    assert!(found.normals[0].distance(DVec3::X) < 1e-15);
    // A border is a cubic B-spline: 1/6, 2/3, 1/6 (Biermann, Levin and Zorin 2000).
    for scheme in [Scheme::CatmullClark, Scheme::Loop] {
        let sheet = sheet(4, scheme);
        let open = level(&sheet);
        let p = |i: usize| sheet.positions[i].as_dvec3();
        let point = |at: DVec3| open.points.iter().position(|&q| q == at).unwrap();
        let found = limit(&open, point(p(2)), scheme).point;
        assert!(found.distance((p(1) + 4.0 * p(2) + p(3)) / 6.0) < 1e-14);
        // A vertex of one face stays.
        if scheme == Scheme::CatmullClark {
            assert_eq!(limit(&open, point(p(0)), scheme).point, p(0));
        }
    }
}

/// For each vertex of a level the largest angle between a normal there and the triangles at that corner, after more refinements.
fn normals_off(coarse: &Level, more: usize, scheme: Scheme) -> Vec<f64> {
    let mut fine = coarse.clone();
    for _ in 0..more {
        fine = fine.refined(scheme);
    }
    let at_fine = fine.corners_at_vertices();
    let at_coarse = coarse.corners_at_vertices();
    let limits: Vec<DVec3> = (0..fine.points.len())
        .map(|v| fine.limit(at_fine.of(v), scheme).point)
        .collect();
    let vertices = 0..coarse.points.len();
    let off = |vertex: usize| {
        let found = coarse.limit(at_coarse.of(vertex), scheme);
        // The vertex keeps its number, and its faces their order.
        let corners = at_fine.of(vertex).iter().zip(&found.sectors);
        let angles = corners.map(|(&corner, &sector)| {
            let size = scheme.corners();
            let corner = corner as usize;
            let place = |i: usize| {
                let c = corner - corner % size + (corner + i) % size;
                limits[fine.corners[c] as usize]
            };
            let normal = (place(1) - place(0)).cross(place(size - 1) - place(0));
            normal.angle_between(found.normals[sector])
        });
        angles.fold(0.0, f64::max)
    };
    vertices.map(off).collect()
}

#[test]
fn normals_are_those_of_the_surface_refined_further() {
    for (number, (cage, scheme)) in samples().into_iter().enumerate() {
        let coarse = level(&cage).refined(scheme);
        let few = normals_off(&coarse, 2, scheme);
        let many = normals_off(&coarse, 5, scheme);
        for (vertex, (few, many)) in few.into_iter().zip(many).enumerate() {
            // At the tip of a cone there is none.
            let is_pinned = coarse.vertex_sharpness[vertex] > 0.0;
            let is_nearer = many < 0.03 || many < 0.7 * few;
            assert!(
                is_pinned || is_nearer,
                "sample {number}, vertex {vertex}: {few} {many}"
            );
        }
    }
}

#[test]
fn refining_is_affine_and_keeps_every_point_a_mean() {
    let matrix = glam::DMat3::from_cols_array(&[2.0, 0.3, -0.1, 0.7, 1.5, 0.2, -0.4, 0.1, 0.9]);
    let map = |p: DVec3| matrix * p + DVec3::new(30.0, -7.0, 11.0);
    for (cage, scheme) in samples() {
        let mut plain = level(&cage);
        let mut mapped = plain.clone();
        mapped.points.iter_mut().for_each(|p| *p = map(*p));
        for _ in 0..2 {
            (plain, mapped) = (plain.refined(scheme), mapped.refined(scheme));
        }
        for vertex in 0..plain.points.len() {
            let expected = map(limit(&plain, vertex, scheme).point);
            let found = limit(&mapped, vertex, scheme).point;
            assert!(found.distance(expected) < 1e-12, "{found} {expected}");
        }
    }
}

/// Faces of every edge by the positions of its ends, with signs by direction: all 0 where the surface has no border.
fn open_edges(refined: &Refined, size: usize) -> usize {
    let bits = |i: u32| refined.positions[i as usize].to_array().map(f32::to_bits);
    let mut edges: HashMap<_, i32> = HashMap::new();
    for face in refined.corners.chunks(size) {
        for (k, &a) in face.iter().enumerate() {
            let (a, b) = (bits(a), bits(face[(k + 1) % size]));
            *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    edges.values().filter(|&&n| n != 0).count()
}

#[test]
fn copies_of_a_vertex_are_at_one_place_and_texture_charts_keep_their_borders() {
    // Every side of the cube has its own vertices, and a square of the map alone.
    let cube = cube();
    let square = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let corners = cube.corners.iter();
    let unwelded = Cage {
        positions: corners.map(|&i| cube.positions[i as usize]).collect(),
        texcoords: (0..24)
            .map(|i| square[i % 4] + Vec2::X * (2 * (i / 4)) as f32)
            .collect(),
        corners: (0..24).collect(),
        ..cube.clone()
    };
    let none = std::f32::consts::PI;
    let refined = unwelded.subdivide(Scheme::CatmullClark, 3, none).unwrap();
    assert_eq!(open_edges(&refined, 4), 0);
    assert_eq!(refined.corners.len(), 4 * 6 * 64);
    // 81 pairs of coordinates a side, on a grid: alone in its chart, a quad is bilinear.
    assert_eq!(refined.positions.len(), 6 * 81);
    for st in &refined.texcoords {
        assert_eq!((*st * 8.0).fract(), Vec2::ZERO, "{st}");
    }
    // No crease: one normal at each place, and the shape is that without texture coordinates.
    let bare = cube.subdivide(Scheme::CatmullClark, 3, none).unwrap();
    assert_eq!(bare.positions.len(), 6 * 64 + 2);
    let bits = |p: Vec3| p.to_array().map(f32::to_bits);
    let normals = bare
        .positions
        .iter()
        .map(|&p| bits(p))
        .zip(bare.normals.iter().map(|&n| bits(n)));
    let known: HashMap<_, _> = normals.collect();
    for (&p, &n) in refined.positions.iter().zip(&refined.normals) {
        assert_eq!(known[&bits(p)], bits(n));
    }
    assert_eq!(
        refined.origins.chunks(64).map(|o| o[0]).collect::<Vec<_>>(),
        [0, 1, 2, 3, 4, 5]
    );
}

#[test]
fn texture_coordinates_are_smooth_inside_of_a_chart() {
    // One vertex inside of a sheet moved in the map: its coordinates spread as positions do.
    let mut sheet = sheet(4, Scheme::CatmullClark);
    for p in &mut sheet.positions {
        p.z = 0.0;
    }
    sheet.texcoords = sheet.positions.iter().map(|p| p.truncate()).collect();
    sheet.positions[12] += vec3(0.2, 0.1, 0.0);
    sheet.texcoords[12] += Vec2::new(0.2, 0.1);
    let refined = sheet.subdivide(Scheme::CatmullClark, 2, 3.2).unwrap();
    let far = |p: &&Vec3| p.truncate().min_element() > 1.0 && p.truncate().max_element() < 3.0;
    assert!(refined.positions.iter().filter(far).count() > 40);
    for (p, st) in refined.positions.iter().zip(&refined.texcoords) {
        if far(&p) {
            assert!(p.truncate().distance(*st) < 1e-6, "{p} {st}");
        }
    }
}

#[test]
fn a_crease_angle_keeps_a_cube_a_cube() {
    let refined = cube().subdivide(Scheme::CatmullClark, 2, 1.0).unwrap();
    assert_eq!(open_edges(&refined, 4), 0);
    for (p, n) in refined.positions.iter().zip(&refined.normals) {
        assert_eq!(p.abs().max_element(), 1.0);
        assert_eq!(n.abs(), n.abs().max_element() * n.abs());
        assert_eq!(p.dot(*n), 1.0, "{p} {n}");
    }
}

#[test]
fn odd_faces_are_taken_as_they_are() {
    let none = std::f32::consts::PI;
    // Three faces at one edge, two that wind against one another, two that touch in a point, a corner twice, all in one place, and a vertex of no face.
    let positions = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [-1.0, 0.0, 0.0],
        [-1.0, 1.0, 0.0],
        [-1.0, -1.0, 0.0],
        [0.0, -1.0, 0.0],
        [9.0, 9.0, 9.0],
    ];
    let faces: [&[u32]; 7] = [
        &[0, 1, 2, 3],
        &[0, 4, 5, 3],
        &[0, 6, 7, 3],
        &[0, 8, 9],
        &[1, 1, 2, 3],
        &[4, 4, 4],
        &[0, 1, 2, 0, 3, 7],
    ];
    let odd = cage(&positions, &faces);
    for crease_angle in [none, 0.5] {
        let refined = odd
            .subdivide(Scheme::CatmullClark, 3, crease_angle)
            .unwrap();
        assert_eq!(refined.left_out, 1);
        assert!(refined.positions.iter().all(|p| p.is_finite() && p.x < 2.0));
        assert!(refined.normals.iter().all(|n| n.is_finite()));
    }
    let triangles = cage(
        &positions,
        &[
            &[0, 1, 3],
            &[0, 3, 1],
            &[0, 4, 3],
            &[0, 8, 9],
            &[4, 5, 4],
            &[0, 1, 3],
        ],
    );
    let refined = triangles.subdivide(Scheme::Loop, 3, none).unwrap();
    assert!(refined.normals.iter().all(|n| n.is_finite()));
}

#[test]
fn what_is_no_cage_is_refused() {
    let none = std::f32::consts::PI;
    let refused = |cage: &Cage, scheme, levels| {
        let refined = cage.subdivide(scheme, levels, none);
        refined.map(|_| ()).unwrap_err()
    };
    let quads = Scheme::CatmullClark;
    assert_eq!(refused(&cube(), quads, 0), SubdivideError::NoLevels);
    assert_eq!(refused(&Cage::default(), quads, 1), SubdivideError::NoFaces);
    for levels in [11, 33, u32::MAX] {
        let error = refused(&cube(), quads, levels);
        assert!(matches!(error, SubdivideError::TooLarge { .. }), "{error}");
    }
    let error = refused(&cube(), Scheme::Loop, 1);
    assert_eq!(
        error,
        SubdivideError::NotATriangle {
            face: 0,
            corners: 4
        }
    );
    let beyond = Cage {
        creases: vec![([0, 8], 1.0)],
        ..cube()
    };
    let index = SubdivideError::IndexOutOfRange {
        index: 8,
        vertices: 8,
    };
    assert_eq!(refused(&beyond, quads, 1), index);
    let mut short = cube();
    short.corners.pop();
    let length = SubdivideError::WrongLength {
        found: 23,
        expected: 24,
    };
    assert_eq!(refused(&short, quads, 1), length);
    let mut nan = cube();
    nan.positions[3].y = f32::NAN;
    let what = "position";
    assert_eq!(
        refused(&nan, quads, 1),
        SubdivideError::BadNumber { what, vertex: 3 }
    );
}

#[test]
fn no_faces_are_too_odd() {
    let mut state = 1_u64;
    let mut random = |below: u32| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as u32 % below
    };
    for round in 0..2000 {
        let scheme = match round % 2 {
            0 => Scheme::CatmullClark,
            _ => Scheme::Loop,
        };
        // Few places: most faces share edges with several, many fold back on themselves.
        let vertices = 4 + random(6);
        let place = |i: u32| vec3((i % 3) as f32, (i / 3 % 2) as f32, (i / 4) as f32);
        let mut cage = Cage {
            positions: (0..vertices).map(|_| place(random(9))).collect(),
            ..Cage::default()
        };
        if round % 3 == 0 {
            cage.texcoords = (0..vertices).map(|_| place(random(5)).truncate()).collect();
        }
        for _ in 0..1 + random(9) {
            let size = match scheme {
                Scheme::CatmullClark => 3 + random(4),
                Scheme::Loop => 3,
            };
            cage.sizes.push(size);
            cage.corners.extend((0..size).map(|_| random(vertices)));
        }
        for _ in 0..random(5) {
            let sharpness = [0.3, 1.0, 2.6, 10.0][random(4) as usize];
            let pair = [random(vertices), random(vertices)];
            cage.creases.push((pair, sharpness));
            cage.sharp_vertices.push((random(vertices), sharpness));
        }
        let crease_angle = [0.4, std::f32::consts::PI][random(2) as usize];
        match cage.subdivide(scheme, 1 + random(2), crease_angle) {
            Ok(refined) => {
                let inside = |p: &Vec3| p.min_element() > -9.0 && p.max_element() < 9.0;
                let odd = refined.positions.iter().find(|p| !inside(p));
                assert_eq!(odd, None, "round {round}");
                let is_unit = |n: &Vec3| *n == Vec3::ZERO || n.is_normalized();
                assert!(refined.normals.iter().all(is_unit), "round {round}");
                assert_eq!(
                    refined.corners.len(),
                    refined.origins.len() * scheme.corners()
                );
            }
            Err(error) => assert_eq!(error, SubdivideError::NoFaces, "round {round}"),
        }
    }
}
