//! Where a relief is hollow: what dirt and patina follow.

use rayon::prelude::*;

/// A height map seen at the size of a colour map.
pub struct Cavity {
    size: usize,
    height: Vec<f32>,
    around: Vec<f32>,
}

impl Cavity {
    /// `texels` (`map_size` x `map_size`) resampled to `size` x `size`; the surroundings of a texel are the
    /// mean over `radius` (a fraction of the map) to every side.
    pub fn new(texels: &[u16], map_size: usize, size: usize, radius: f32) -> Self {
        let height = resample(texels, map_size, size);
        let reach = ((radius * size as f32) as usize).clamp(1, size / 2 - 1);
        // Two box means each way come close enough to a Gaussian.
        let mut around = height.clone();
        for _ in 0..2 {
            around = transposed(&box_mean(&around, size, reach), size);
            around = transposed(&box_mean(&around, size, reach), size);
        }
        Self {
            size,
            height,
            around,
        }
    }

    /// The map's height in [0, 1] at texture coordinates `st` in [0, 1].
    pub fn height(&self, st: glam::Vec2) -> f32 {
        self.height[self.index(st)]
    }

    /// Height above the surroundings' mean, in [-1, 1]: negative in hollows.
    pub fn relief(&self, st: glam::Vec2) -> f32 {
        let i = self.index(st);
        self.height[i] - self.around[i]
    }

    fn index(&self, st: glam::Vec2) -> usize {
        let at = |x: f32| ((x * self.size as f32) as usize).min(self.size - 1);
        at(st.y) * self.size + at(st.x)
    }
}

fn resample(texels: &[u16], map_size: usize, size: usize) -> Vec<f32> {
    let step = (map_size / size).max(1);
    (0..size * size)
        .into_par_iter()
        .map(|i| {
            let x0 = (i % size) * map_size / size;
            let y0 = (i / size) * map_size / size;
            let mut sum = 0.0;
            for y in y0..y0 + step {
                for x in x0..x0 + step {
                    sum += f32::from(texels[y * map_size + x]);
                }
            }
            sum / (65535.0 * (step * step) as f32)
        })
        .collect()
}

/// Means over 2 `reach` + 1 texels along rows, which repeat.
fn box_mean(values: &[f32], size: usize, reach: usize) -> Vec<f32> {
    let mut means = vec![0.0; values.len()];
    means
        .par_chunks_mut(size)
        .zip(values.par_chunks(size))
        .for_each(|(means, row)| {
            let width = (2 * reach + 1) as f64;
            let at = |x: usize| f64::from(row[x % size]);
            let mut sum: f64 = (size - reach..=size + reach).map(at).sum();
            for (x, mean) in means.iter_mut().enumerate() {
                *mean = (sum / width) as f32;
                sum += at(x + reach + 1) - at(x + size - reach);
            }
        });
    means
}

fn transposed(values: &[f32], size: usize) -> Vec<f32> {
    (0..values.len())
        .into_par_iter()
        .map(|i| values[(i % size) * size + i / size])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn flat_is_neither_hollow_nor_raised() {
        let cavity = Cavity::new(&vec![30_000; 64 * 64], 64, 32, 0.1);
        assert!(cavity.relief(Vec2::new(0.3, 0.9)).abs() < 1e-5);
    }

    #[test]
    fn a_pit_is_hollow_and_its_rim_raised_across_the_border() {
        let mut texels = vec![65_535; 64 * 64];
        texels[0] = 0;
        let cavity = Cavity::new(&texels, 64, 64, 0.05);
        assert!(cavity.relief(Vec2::new(0.001, 0.001)) < -0.9);
        assert!(cavity.relief(Vec2::new(0.999, 0.999)) > 0.01);
    }
}
