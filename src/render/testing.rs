//! What the statistical tests share: random numbers with a fixed seed, and the chi-square test.

use glam::Vec2;

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

/// Pearson's chi-square test of (count, expected) per cell: panics where the counts are less likely than about 1e-4.
/// Cells that expect fewer than 5 are pooled.
pub fn assert_chi_square(cells: impl Iterator<Item = (u32, f64)>, what: &str) {
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
