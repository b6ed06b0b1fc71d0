use std::f32::consts::TAU;

use super::*;
use glam::{Quat, Vec2};

fn cut(corners: &[Vec3]) -> (Vec<[u32; 3]>, bool) {
    let mut triangulator = Triangulator::new(false);
    let triangles = triangulator.cut(corners).to_vec();
    (triangles, triangulator.warning().is_some())
}

fn flat(points: &[[f32; 2]]) -> Vec<Vec3> {
    points.iter().map(|&p| Vec2::from(p).extend(0.0)).collect()
}

/// Twice the area vector of each triangle along the polygon's own, as shares of it.
fn shares(corners: &[Vec3], triangles: &[[u32; 3]]) -> Vec<f64> {
    let normal = newell(corners);
    let corner = |i: u32| corners[i as usize].as_dvec3();
    let area = |t: &[u32; 3]| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0]));
    triangles
        .iter()
        .map(|t| area(t).dot(normal) / normal.length_squared())
        .collect()
}

/// n - 2 triangles that wind as the polygon does and together have its area: they neither overlap nor leave a gap.
fn assert_triangulation(corners: &[Vec3]) {
    let (triangles, warned) = cut(corners);
    assert!(!warned);
    assert_eq!(triangles.len(), corners.len() - 2);
    let shares = shares(corners, &triangles);
    assert!(shares.iter().all(|&s| s > -1e-9), "{shares:?}");
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-6);
}

/// Every turn of the corners, both windings, and from every side.
fn all_ways(points: &[[f32; 2]], check: impl Fn(&[Vec3])) {
    let mut corners = flat(points);
    for _ in 0..2 {
        for turn in 0..corners.len() {
            corners.rotate_left(1);
            for (axis, far) in [
                (Vec3::X, 0.0),
                (Vec3::new(1.0, 2.0, 3.0), 1000.0),
                (Vec3::Y, -5.0),
            ] {
                let rotation = Quat::from_axis_angle(axis.normalize(), turn as f32 + far);
                let placed: Vec<_> = corners.iter().map(|&p| rotation * p + far).collect();
                check(&placed);
            }
        }
        corners.reverse();
    }
}

#[test]
fn concave_polygons_are_covered_once() {
    let star: Vec<_> = (0..20)
        .map(|i| [1.0, 0.3][i % 2] * Vec2::from_angle(i as f32 * TAU / 20.0))
        .map(|p| p.to_array())
        .collect();
    let u = [
        [0.0, 0.0],
        [3.0, 0.0],
        [3.0, 3.0],
        [2.0, 3.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [0.0, 3.0],
    ];
    let arrow = [[0.0, 0.0], [4.0, 1.0], [0.0, 2.0], [1.0, 1.5], [1.0, 0.5]];
    for points in [&star[..], &u, &arrow] {
        all_ways(points, assert_triangulation);
    }
}

#[test]
fn darts_are_cut_inside() {
    all_ways(
        &[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 3.0]],
        assert_triangulation,
    );
}

#[test]
fn quads_take_the_shorter_diagonal_and_the_first_of_equal_ones() {
    let grid = flat(&[[0.1, 0.7], [0.2, 0.7], [0.2, 0.9], [0.1, 0.9]]);
    assert_eq!(cut(&grid).0, [[0, 1, 2], [0, 2, 3]]);
    let kite = flat(&[[-3.0, 0.0], [0.0, -1.0], [3.0, 0.0], [0.0, 1.0]]);
    assert_eq!(cut(&kite).0, [[0, 1, 3], [1, 2, 3]]);
    // A square that is turned in space has equal diagonals up to rounding.
    all_ways(
        &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        |corners| {
            assert_eq!(cut(corners).0, [[0, 1, 2], [0, 2, 3]]);
        },
    );
}

#[test]
fn convex_polygons_stay_fans() {
    let corners: Vec<_> = (0..1000)
        .map(|i| Vec2::from_angle(i as f32 * TAU / 1000.0).extend(2.0))
        .collect();
    let (triangles, warned) = cut(&corners);
    assert!(!warned);
    let fan: Vec<_> = (1..999).map(|i| [0, i, i + 1]).collect();
    assert_eq!(triangles, fan);
}

#[test]
fn corners_on_straight_edges_are_kept() {
    // From any corner, a fan would have triangles without area.
    all_ways(
        &[
            [0.0, 0.0],
            [1.0, 0.0],
            [2.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 1.0],
        ],
        |corners| {
            let (triangles, warned) = cut(corners);
            assert!(!warned);
            let mut used: Vec<_> = triangles.concat();
            used.sort_unstable();
            used.dedup();
            assert_eq!(used.len(), corners.len());
        },
    );
}

#[test]
fn a_hole_joined_by_a_slit_stays_a_hole() {
    let keyhole = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [3.0, 3.0],
        [3.0, 1.0],
        [1.0, 1.0],
    ];
    let corners = flat(&keyhole);
    let (triangles, warned) = cut(&corners);
    assert!(!warned);
    let shares = shares(&corners, &triangles);
    assert!(shares.iter().all(|&s| s >= 0.0));
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
}

#[test]
fn repeated_corners_are_passed_over() {
    let corners = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    assert_eq!(cut(&corners), (vec![[0, 1, 3]], false));
    let corners = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]);
    assert_eq!(cut(&corners).0.len(), 2);
}

#[test]
fn what_has_no_triangulation_is_cut_from_its_first_corner_and_told() {
    let bow_tie = flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
    let line = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [1.5, 0.0]]);
    let pentagram: Vec<_> = (0..5)
        .map(|i| Vec2::from_angle(i as f32 * 2.0 * TAU / 5.0).extend(0.0))
        .collect();
    for corners in [bow_tie, line, pentagram] {
        let (triangles, warned) = cut(&corners);
        assert!(warned);
        assert_eq!(triangles.len(), corners.len() - 2);
        assert!(triangles.iter().all(|t| t[0] == 0));
    }
}

#[test]
fn odd_polygons_do_no_harm() {
    let p = Vec3::new(1.0, 2.0, 3.0);
    let nan = Vec3::new(f32::NAN, 0.0, 0.0);
    let huge = Vec3::splat(f32::MAX);
    for n in 0..9 {
        for corners in [vec![p; n], vec![nan; n], vec![huge; n]] {
            cut(&corners);
        }
        for odd in [
            nan,
            huge,
            -huge,
            Vec3::splat(f32::INFINITY),
            Vec3::splat(f32::from_bits(1)),
        ] {
            let mut corners = flat(&[[0.0, 0.0], [2.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 2.0]]);
            corners.insert(n % 5, odd);
            for triangle in cut(&corners).0 {
                assert!(triangle.iter().all(|&i| (i as usize) < corners.len()));
            }
        }
    }
}

/// Takes as long as it has corners, not their square or cube.
#[test]
fn large_polygons_are_cut() {
    let n = 20_000;
    let around = |i: usize, r: f32| r * Vec2::from_angle(i as f32 * TAU / n as f32);
    let star: Vec<_> = (0..n).map(|i| around(i, [1.0, 0.9][i % 2])).collect();
    let comb = (0..n).map(|i| Vec2::new(i as f32, [100.0, 1.0][i % 2]));
    let comb: Vec<_> = comb.chain([Vec2::new(n as f32, 0.0), Vec2::ZERO]).collect();
    for outline in [star, comb] {
        let rotation = Quat::from_axis_angle(Vec3::X, 1.0);
        let corners: Vec<_> = outline.iter().map(|p| rotation * p.extend(3.0)).collect();
        assert_triangulation(&corners);
    }
}

#[test]
fn a_hole_in_a_large_polygon_stays_a_hole() {
    let n = 500;
    let ring = |r: f32, turn: f32| {
        (0..=n).map(move |i| (r * Vec2::from_angle(turn * i as f32 * TAU / n as f32)).extend(0.0))
    };
    // The last corner of a ring is not quite the first again: the slit is made of the same two corners.
    let mut corners: Vec<_> = ring(2.0, 1.0).take(n).collect();
    corners.push(corners[0]);
    let start = corners.len();
    corners.extend(ring(1.0, -1.0).take(n));
    corners.push(corners[start]);
    let (triangles, warned) = cut(&corners);
    assert!(!warned);
    assert_eq!(triangles.len(), 2 * n);
    let shares = shares(&corners, &triangles);
    assert!(shares.iter().all(|&s| s > 0.0));
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
}

#[test]
fn large_polygons_that_cannot_be_cut_are_told() {
    let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    let wound = square.repeat(10_000);
    let mut state = 1_u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32
    };
    let random: Vec<_> = (0..5000).map(|_| Vec3::new(next(), next(), 0.0)).collect();
    for corners in [wound, random] {
        let (triangles, warned) = cut(&corners);
        assert!(warned);
        assert_eq!(triangles.len(), corners.len() - 2);
    }
}
