//! A piecewise constant density over the sphere, to sample skies and pictures by their brightness.
//!
//! Cells are the pixels of an equirectangular picture. The density is constant over the solid angle of a
//! cell, not over its pixels, so it has no factor 1 / sin(theta) that could grow without bound at the poles.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::cumulative::{find, push};
use super::latlong;

/// A density per steradian over all directions.
#[derive(Clone, Debug)]
pub struct SphereDistribution {
    width: usize,
    height: usize,
    /// Per row: cumulative probability of its cells, `width + 1` numbers from 0 to 1.
    cells: Vec<f32>,
    /// Cumulative probability of the rows, `height + 1` numbers from 0 to 1.
    rows: Vec<f32>,
    /// Cosine of the polar angle at the upper border of each row, and -1.
    cosines: Vec<f32>,
    integral: f32,
}

impl SphereDistribution {
    /// A density proportional to `brightness(column, row)` (finite, not negative), constant in each of
    /// `width` x `height` cells, row 0 around +Y. Uniform if all is dark.
    pub fn new(
        width: usize,
        height: usize,
        brightness: impl Fn(usize, usize) -> f32,
    ) -> SphereDistribution {
        let cosines: Vec<f32> = (0..=height)
            .map(|row| (PI * row as f32 / height as f32).cos())
            .collect();
        let mut cells = Vec::with_capacity((width + 1) * height);
        let mut row_weights = Vec::with_capacity(height);
        for row in 0..height {
            let weights = (0..width).map(|column| f64::from(brightness(column, row)));
            let sum = push(&mut cells, weights);
            row_weights.push(sum * f64::from(cosines[row] - cosines[row + 1]));
        }
        let dark = row_weights.iter().all(|&weight| weight == 0.0);
        if dark {
            // A dark sphere: equal solid angles are equally likely.
            for (row, weight) in row_weights.iter_mut().enumerate() {
                *weight = f64::from(cosines[row] - cosines[row + 1]);
            }
        }
        let mut rows = Vec::with_capacity(height + 1);
        let integral =
            push(&mut rows, row_weights.iter().copied()) * 2.0 * f64::from(PI) / width as f64;
        Self {
            width,
            height,
            cells,
            rows,
            cosines,
            integral: if dark { 0.0 } else { integral as f32 },
        }
    }

    /// The brightness integrated over all directions.
    pub fn integral(&self) -> f32 {
        self.integral
    }

    /// The direction for a uniform point `u` in [0, 1)^2, and its density per steradian.
    pub fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let (row, within_row) = find(&self.rows, u.y);
        let (column, within_cell) = find(self.cells_of(row), u.x);
        let (top, bottom) = (self.cosines[row], self.cosines[row + 1]);
        let direction = latlong::direction(Vec2::new(
            (column as f32 + within_cell) / self.width as f32,
            top + within_row * (bottom - top),
        ));
        (direction, self.cell_pdf(column, row))
    }

    /// The density per steradian of the unit vector `direction`.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let point = latlong::point(direction);
        let column = (point.x * self.width as f32) as usize;
        let row = (point.y.acos() / PI * self.height as f32) as usize;
        self.cell_pdf(column.min(self.width - 1), row.min(self.height - 1))
    }

    fn cell_pdf(&self, column: usize, row: usize) -> f32 {
        let cells = self.cells_of(row);
        let probability =
            (self.rows[row + 1] - self.rows[row]) * (cells[column + 1] - cells[column]);
        let solid_angle =
            2.0 * PI / self.width as f32 * (self.cosines[row] - self.cosines[row + 1]);
        probability / solid_angle
    }

    fn cells_of(&self, row: usize) -> &[f32] {
        &self.cells[row * (self.width + 1)..(row + 1) * (self.width + 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::testing::{Cap, Fineness};

    const WIDTH: usize = 8;
    const HEIGHT: usize = 6;

    fn uneven() -> SphereDistribution {
        SphereDistribution::new(WIDTH, HEIGHT, |column, row| match (column, row) {
            (3, 2) => 40.0,
            (5, _) => 0.0,
            _ => (column + 2 * row) as f32,
        })
    }

    #[test]
    fn density_integrates_to_one() {
        let distribution = uneven();
        let n = 240;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..2 * n {
                // The map keeps areas: each point stands for the same solid angle.
                let point = Vec2::new(
                    (j as f32 + 0.5) / (2 * n) as f32,
                    1.0 - 2.0 * (i as f32 + 0.5) / n as f32,
                );
                sum += distribution.pdf(latlong::direction(point));
            }
        }
        let integral = sum * 4.0 * PI / (2 * n * n) as f32;
        assert!((integral - 1.0).abs() < 0.01, "{integral}");
    }

    #[test]
    fn samples_follow_the_density_by_chi_square() {
        let distribution = uneven();
        // Borders of the density's rows are none of the cells': many points.
        let fineness = Fineness {
            samples: 50_000,
            cells: [2 * WIDTH, HEIGHT],
            points: 64,
        };
        Cap::sphere(Vec3::Y).assert_samples_follow(
            "sphere distribution",
            fineness,
            |random| Some(distribution.sample(random.point()).0),
            |direction| distribution.pdf(direction),
        );
    }

    #[test]
    fn a_dark_sphere_is_sampled_uniformly() {
        let dark = SphereDistribution::new(4, 2, |_, _| 0.0);
        let (direction, pdf) = dark.sample(Vec2::new(0.3, 0.99));
        assert!((pdf - 0.25 / PI).abs() < 1e-6);
        assert!((dark.pdf(direction) - pdf).abs() < 1e-6);
    }
}
