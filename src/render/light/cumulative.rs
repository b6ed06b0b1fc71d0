//! A discrete distribution as running sums: to choose one of many by weight.

/// Running sums of weights divided by their sum: from 0 to 1, one more than there are weights.
#[derive(Clone, Debug)]
pub struct Cumulative(Vec<f32>);

impl Cumulative {
    /// Of at least one weight, each finite and not negative. If all are 0 they count as equal.
    pub fn new(weights: impl Iterator<Item = f64> + Clone) -> Self {
        let mut sums = Vec::new();
        push(&mut sums, weights);
        Self(sums)
    }

    /// The one chosen by `u` in [0, 1), never of weight 0, and `u` stretched to [0, 1) within it.
    pub fn choose(&self, u: f32) -> (usize, f32) {
        find(&self.0, u)
    }

    /// With which probability an index is chosen.
    pub fn probability(&self, index: usize) -> f32 {
        self.0[index + 1] - self.0[index]
    }
}

/// Appends 0, then the running sums of weights divided by their sum, which is returned. Weights that are all 0
/// count as equal.
pub fn push(out: &mut Vec<f32>, weights: impl Iterator<Item = f64> + Clone) -> f64 {
    let sum: f64 = weights.clone().sum();
    let equal = sum == 0.0;
    let count = if equal {
        weights.clone().count() as f64
    } else {
        sum
    };
    let mut running = 0.0;
    out.push(0.0);
    for weight in weights {
        running += if equal { 1.0 } else { weight };
        // Exactly 1 at the end: the same additions gave the sum.
        out.push((running / count) as f32);
    }
    sum
}

/// The interval of `cumulative` that holds `u`, never an empty one, and where in it `u` lies, in [0, 1).
pub fn find(cumulative: &[f32], u: f32) -> (usize, f32) {
    // cumulative[0] = 0 <= u < 1 = cumulative's last: the result is 1 ..= len - 1.
    let upper = cumulative.partition_point(|&c| c <= u);
    let (low, high) = (cumulative[upper - 1], cumulative[upper]);
    (
        upper - 1,
        ((u - low) / (high - low)).min(1.0 - f32::EPSILON / 2.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chooses_by_weight_and_never_what_weighs_nothing() {
        let choice = Cumulative::new([1.0, 0.0, 3.0].into_iter());
        let n = 4000;
        let mut counts = [0; 3];
        for i in 0..n {
            let (index, rest) = choice.choose(i as f32 / n as f32);
            counts[index] += 1;
            assert!((0.0..1.0).contains(&rest));
        }
        assert_eq!(counts, [1000, 0, 3000]);
        assert_eq!(choice.probability(2), 0.75);
        assert_eq!(Cumulative::new([0.0, 0.0].into_iter()).probability(1), 0.5);
    }
}
