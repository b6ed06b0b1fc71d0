//! Closed intervals of f64. Roundings are not directed: whoever decides by an interval leaves room for them.

use std::ops::{Add, Mul, Sub};

/// All x with low <= x <= high.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    pub const NONE: Self = Self {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };

    pub fn around(middle: f64, radius: f64) -> Self {
        Self {
            low: middle - radius,
            high: middle + radius,
        }
    }

    pub fn point(x: f64) -> Self {
        Self { low: x, high: x }
    }

    pub fn including(self, x: f64) -> Self {
        Self {
            low: self.low.min(x),
            high: self.high.max(x),
        }
    }

    /// What both hold; upside down where that is nothing.
    pub fn and(self, other: Self) -> Self {
        Self {
            low: self.low.max(other.low),
            high: self.high.min(other.high),
        }
    }

    pub fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }

    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Whether it stays farther than `slack` from 0.
    pub fn excludes_zero(self, slack: f64) -> bool {
        self.low > slack || self.high < -slack
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            low: self.low + other.low,
            high: self.high + other.high,
        }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self {
            low: self.low - other.high,
            high: self.high - other.low,
        }
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let [a, b, c, d] = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        Self {
            low: a.min(b).min(c.min(d)),
            high: a.max(b).max(c.max(d)),
        }
    }
}

impl Mul<f64> for Interval {
    type Output = Self;
    fn mul(self, x: f64) -> Self {
        let (a, b) = (self.low * x, self.high * x);
        Self {
            low: a.min(b),
            high: a.max(b),
        }
    }
}
