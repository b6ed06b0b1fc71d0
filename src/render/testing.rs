//! What the statistical tests share: random numbers with a fixed seed, and the chi-square test.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::basis::Basis;

/// Knuth's MMIX generator, upper bits.
pub struct Random(u64);

impl Random {
    /// Different numbers for different seeds.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// In [0, 1).
    pub fn number(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// In [0, 1)^2.
    pub fn point(&mut self) -> Vec2 {
        Vec2::new(self.number(), self.number())
    }
}

/// How finely samples are held against their density.
#[derive(Clone, Copy)]
pub struct Fineness {
    /// Samples.
    pub samples: u32,
    /// Cells across and down.
    pub cells: [usize; 2],
    /// Along each side of a cell, points at which the density is summed up.
    pub points: usize,
}

/// Samples of the unit square against their density there by chi-square; those that are `None` fall elsewhere, and are the part that the
/// density lacks.
pub fn assert_samples_follow(
    what: &str,
    fineness: Fineness,
    mut sample: impl FnMut(&mut Random) -> Option<Vec2>,
    density: impl Fn(Vec2) -> f32,
) {
    let Fineness {
        samples,
        cells: [columns, rows],
        points,
    } = fineness;
    let size = Vec2::new(columns as f32, rows as f32);
    let mut counts = vec![0_u32; columns * rows];
    let mut random = Random::new(1);
    for _ in 0..samples {
        if let Some(at) = sample(&mut random) {
            let cell = (at * size).as_usizevec2();
            counts[cell.y.min(rows - 1) * columns + cell.x.min(columns - 1)] += 1;
        }
    }
    let per_point = f64::from(samples) / (columns * rows * points * points) as f64;
    let expected = |cell: usize| {
        let corner = Vec2::new((cell % columns) as f32, (cell / columns) as f32);
        let all = (0..points * points).map(|k| {
            let inside = Vec2::new((k % points) as f32, (k / points) as f32) + 0.5;
            f64::from(density((corner + inside / points as f32) / size))
        });
        per_point * all.sum::<f64>()
    };
    let cells = counts.into_iter().enumerate();
    assert_chi_square(cells.map(|(cell, count)| (count, expected(cell))), what);
}

/// Directions around an axis, laid out over the unit square so that areas are kept: turns about the axis across, the angle from it down.
#[derive(Clone, Copy)]
pub struct Cap {
    basis: Basis,
    /// 1 - cos of the angle at which it ends.
    drop: f32,
}

impl Cap {
    /// All directions, the unit vector `axis` first.
    pub fn sphere(axis: Vec3) -> Self {
        Self::around(axis, 2.0)
    }

    /// Those whose cosine to the unit vector `axis` is 1 - `drop` at least.
    pub fn around(axis: Vec3, drop: f32) -> Self {
        Self {
            basis: Basis::around(axis),
            drop,
        }
    }

    fn point(&self, direction: Vec3) -> Option<Vec2> {
        let local = self.basis.to_local(direction);
        // |a - b|^2 = 2 (1 - cos) between unit vectors.
        let drop = 0.5 * (direction - self.basis.z).length_squared();
        let turns = local.y.atan2(local.x) / TAU + 0.5;
        (drop <= self.drop).then(|| Vec2::new(turns, drop / self.drop))
    }

    fn direction(&self, point: Vec2) -> Vec3 {
        let drop = point.y * self.drop;
        let around = (drop * (2.0 - drop)).sqrt() * Vec2::from_angle((point.x - 0.5) * TAU);
        self.basis.to_world(around.extend(1.0 - drop))
    }

    /// Samples against their density per steradian, by chi-square over the directions here.
    pub fn assert_samples_follow(
        &self,
        what: &str,
        fineness: Fineness,
        mut sample: impl FnMut(&mut Random) -> Option<Vec3>,
        pdf: impl Fn(Vec3) -> f32,
    ) {
        let solid_angle = TAU * self.drop;
        assert_samples_follow(
            what,
            fineness,
            |random| self.point(sample(random)?),
            |at| solid_angle * pdf(self.direction(at)),
        );
    }
}

/// Pearson's chi-square test of (count, expected) per cell: panics where the counts are less likely than about 1e-4.
/// Cells that expect fewer than 5 are pooled.
fn assert_chi_square(cells: impl Iterator<Item = (u32, f64)>, what: &str) {
    let (mut sum, mut freedom) = (0.0, -1.0);
    let mut pooled = (0.0, 0.0);
    let mut add = |count: f64, expected: f64| {
        sum += (count - expected).powi(2) / expected;
        freedom += 1.0;
    };
    for (count, expected) in cells {
        let count = f64::from(count);
        if expected >= 5.0 {
            add(count, expected);
        } else {
            pooled = (pooled.0 + count, pooled.1 + expected);
        }
    }
    if pooled.1 >= 5.0 {
        add(pooled.0, pooled.1);
    } else {
        assert!(
            pooled.0 <= 25.0,
            "{what}: {} where {} are expected",
            pooled.0,
            pooled.1
        );
    }
    // Mean k and standard deviation sqrt(2 k): 5 of them are a chance below 1e-4 for all k here.
    let bound = freedom + 5.0 * f64::sqrt(2.0 * freedom);
    assert!(
        sum < bound,
        "{what}: chi-square {sum:.0} of {freedom} degrees of freedom"
    );
}
