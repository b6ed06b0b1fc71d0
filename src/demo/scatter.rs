//! Many discs on the unit sphere, and which of them reach a point.

use glam::Vec3;

use super::noise::{hash, next, unit};

/// One disc.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// Unit vector to its middle.
    pub centre: Vec3,
    /// Chord length from the middle to the edge.
    pub radius: f32,
    /// Random bits of its own.
    pub id: u32,
}

/// Discs in bins. A disc is found everywhere within `reach` radii of its centre, and always in the order
/// of the list, so that sums and overlays come out the same from every side.
pub struct Scatter {
    discs: Vec<Disc>,
    bins: Vec<Vec<u32>>,
    bins_per_side: usize,
    reach: f32,
}

impl Scatter {
    /// Sorts discs into `bins_per_side`^3 bins over the cube around the unit sphere.
    pub fn new(discs: Vec<Disc>, bins_per_side: usize, reach: f32) -> Self {
        let mut scatter = Self {
            bins: vec![Vec::new(); bins_per_side.pow(3)],
            bins_per_side,
            reach,
            discs: Vec::new(),
        };
        let side = 2.0 / bins_per_side as f32;
        for (index, disc) in discs.iter().enumerate() {
            let extent = Vec3::splat(reach * disc.radius);
            let lo = scatter.bin_of(disc.centre - extent);
            let hi = scatter.bin_of(disc.centre + extent);
            for z in lo[2]..=hi[2] {
                for y in lo[1]..=hi[1] {
                    for x in lo[0]..=hi[0] {
                        let low = Vec3::new(x as f32, y as f32, z as f32) * side - 1.0;
                        let nearest = disc.centre.clamp(low, low + side);
                        // A hundredth more than the reach, for rounding.
                        if nearest.distance(disc.centre) < 1.01 * extent.x {
                            let bin = scatter.bin_index([x, y, z]);
                            scatter.bins[bin].push(index as u32);
                        }
                    }
                }
            }
        }
        scatter.discs = discs;
        scatter
    }

    /// Every disc that reaches the unit vector `p`, with the chord from its centre in radii, below `reach`.
    pub fn around(&self, p: Vec3) -> impl Iterator<Item = (&Disc, f32)> {
        self.bins[self.bin_index(self.bin_of(p))]
            .iter()
            .filter_map(move |&index| {
                let disc = &self.discs[index as usize];
                let square = disc.centre.distance_squared(p);
                let limit = self.reach * disc.radius;
                (square < limit * limit).then(|| (disc, square.sqrt() / disc.radius))
            })
    }

    fn bin_of(&self, p: Vec3) -> [usize; 3] {
        let n = self.bins_per_side;
        (0.5 * (p + 1.0) * n as f32)
            .to_array()
            .map(|x| (x.max(0.0) as usize).min(n - 1))
    }

    fn bin_index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.bins_per_side + y) * self.bins_per_side + x
    }
}

/// `count` discs evenly over the sphere, the largest first, radii from a power law: as many craters are
/// larger than r as r^-`power`, down from `largest`.
pub fn power_law(seed: u32, count: usize, largest: f32, power: f32) -> Vec<Disc> {
    (0..count)
        .map(|rank| {
            let id = hash(seed, rank as i32, 0, 0);
            Disc {
                centre: direction(id),
                radius: largest * (1.0 + rank as f32).powf(-1.0 / power),
                id,
            }
        })
        .collect()
}

/// A unit vector, uniform over the sphere (Archimedes: z is uniform).
fn direction(id: u32) -> Vec3 {
    let z = 2.0 * unit(next(id)) - 1.0;
    let angle = std::f32::consts::TAU * unit(next(next(id)));
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * angle.cos(), r * angle.sin(), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_lose_no_disc() {
        let discs = power_law(4, 300, 0.6, 2.0);
        let scatter = Scatter::new(discs.clone(), 9, 2.0);
        for i in 0..500 {
            let p = direction(hash(8, i, 0, 0));
            let expected: Vec<u32> = discs
                .iter()
                .filter(|d| d.centre.distance(p) / d.radius < 2.0)
                .map(|d| d.id)
                .collect();
            let found: Vec<u32> = scatter.around(p).map(|(d, _)| d.id).collect();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn directions_average_to_nothing() {
        let sum: Vec3 = power_law(1, 4000, 1.0, 2.0).iter().map(|d| d.centre).sum();
        assert!(sum.length() < 4000.0 * 0.03);
    }
}
