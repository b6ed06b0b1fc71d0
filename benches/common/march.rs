//! The march under test.

use prismarch::prism::{March, Step};

/// The default march. `PRISMARCH_TEST_STEP=0.02` puts a uniform march of so many texels in its place, to hold the
/// oracles and laws against the simplest march there is.
///
/// # Panics
///
/// When the variable holds no number.
pub fn under_test() -> March {
    let step = std::env::var("PRISMARCH_TEST_STEP").ok();
    let step = step.map(|texels| texels.parse().expect("a number of texels"));
    step.map_or_else(March::default, |texels| March::Uniform {
        step: Step::Texels(texels),
        jitter: false,
    })
}
