use super::*;
use crate::render::testing::{Cap, Fineness, Random};

fn base() -> Parameters {
    Parameters {
        color: Vec3::ONE,
        metallic: 0.0,
        alpha: 1.0,
        f0: 0.04,
        transmission: 0.0,
        eta: 1.5,
        inside: false,
        coat: 0.0,
        coat_alpha: 0.0,
        sheen: Vec3::ZERO,
        sheen_alpha: 0.25,
    }
}

/// Every kind of material, white, over roughness.
fn white() -> Vec<(String, Parameters)> {
    let mut all = Vec::new();
    for roughness in [0.05, 0.3, 0.6, 1.0_f32] {
        let alpha = roughness * roughness;
        let plastic = Parameters { alpha, ..base() };
        let glass = Parameters {
            transmission: 1.0,
            ..plastic
        };
        let kinds = [
            ("plastic", plastic),
            ("shiny plastic", Parameters { f0: 0.3, ..plastic }),
            (
                "metal",
                Parameters {
                    metallic: 1.0,
                    ..plastic
                },
            ),
            (
                "half metal",
                Parameters {
                    metallic: 0.5,
                    ..plastic
                },
            ),
            (
                "coated",
                Parameters {
                    coat: 1.0,
                    coat_alpha: 0.01,
                    ..plastic
                },
            ),
            (
                "coated metal",
                Parameters {
                    coat: 1.0,
                    coat_alpha: 0.1,
                    metallic: 1.0,
                    ..plastic
                },
            ),
            (
                "sheen",
                Parameters {
                    sheen: Vec3::ONE,
                    ..plastic
                },
            ),
            ("glass", glass),
            (
                "glass from inside",
                Parameters {
                    eta: 1.0 / 1.5,
                    inside: true,
                    ..glass
                },
            ),
            (
                "half glass",
                Parameters {
                    transmission: 0.5,
                    ..plastic
                },
            ),
        ];
        all.extend(kinds.map(|(name, p)| (format!("{name} {roughness}"), p)));
    }
    all
}

fn viewer(theta: f32) -> Vec3 {
    Vec3::new(theta.sin(), 0.0, theta.cos())
}

/// Energy sent on, the mean over samples: what passes into a denser body has its radiance raised again.
fn energy(bsdf: &Bsdf, random: &mut Random, n: u32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for _ in 0..n {
        let choice = random.number();
        let Some(sample) = bsdf.sample(choice, random.point(), Allowed::ALL) else {
            continue;
        };
        let weight = sample.mirror_weight.unwrap_or_else(|| {
            let f = bsdf.evaluate(sample.direction, Allowed::ALL);
            f.total() / f.pdf
        });
        let eta = if sample.direction.z < 0.0 {
            bsdf.eta()
        } else {
            1.0
        };
        sum += weight * (eta * eta);
    }
    sum / n as f32
}

#[test]
fn white_materials_return_all_light_and_none_returns_more() {
    let mut wrong = Vec::new();
    for (name, p) in white() {
        for theta in [0.0, 0.8, 1.3_f32] {
            let bsdf = Bsdf::new(p, viewer(theta));
            let kept = energy(&bsdf, &mut Random::new(7), 20_000);
            // Layers over other lobes than diffuse ones lose a little: they are bounded by the smaller of what two
            // directions let through. The rest is noise, and the tables' steps.
            let (least, most) = match &name[..5] {
                "coate" | "sheen" => (0.9, 1.015),
                _ => (0.98, 1.02),
            };
            if !(kept.min_element() > least && kept.max_element() < most) {
                wrong.push(format!("{name} from {theta}: {kept}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn reciprocal() {
    let (a, b) = (viewer(1.0), Vec3::new(-0.2, 0.5, 0.8).normalize());
    for (name, p) in white() {
        let p = Parameters {
            color: Vec3::new(0.9, 0.5, 0.2),
            ..p
        };
        let over_cosine = |p: Parameters, v: Vec3, l: Vec3| {
            Bsdf::new(p, v).evaluate(l, Allowed::ALL).total() / l.z.abs()
        };
        let (there, back) = (over_cosine(p, a, b), over_cosine(p, b, a));
        assert!(
            there.abs_diff_eq(back, 1e-4 * (1.0 + there.max_element())),
            "{name}: {there} {back}"
        );
        if p.transmission == 0.0 {
            continue;
        }
        // Through: the other viewer looks at the other side, and radiance is as the square of the index.
        let turned = Parameters {
            eta: 1.0 / p.eta,
            inside: !p.inside,
            ..p
        };
        let beyond = Vec3::new(-0.5, 0.1, -0.8).normalize();
        let flip = Vec3::new(1.0, 1.0, -1.0);
        let there = over_cosine(p, a, beyond) * (p.eta * p.eta);
        let back = over_cosine(turned, flip * beyond, flip * a);
        assert!(
            there.abs_diff_eq(back, 1e-4 + 2e-3 * there.max_element()),
            "through {name}: {there} {back}"
        );
    }
}

#[test]
fn samples_follow_their_density_by_chi_square() {
    let fineness = Fineness {
        samples: 40_000,
        cells: [12, 20],
        points: 12,
    };
    for (index, (name, p)) in white().into_iter().enumerate() {
        // Narrow lobes need finer sums than a test has time for; their code is the same.
        if p.alpha < 0.05 || (p.coat > 0.0 && p.coat_alpha < 0.05) {
            continue;
        }
        let allowed = match index % 3 {
            0 => Allowed {
                diffuse: false,
                ..Allowed::ALL
            },
            1 if p.transmission > 0.0 => Allowed {
                transmission: p.inside,
                ..Allowed::ALL
            },
            _ => Allowed::ALL,
        };
        let bsdf = Bsdf::new(p, viewer(0.9));
        Cap::sphere(Vec3::Z).assert_samples_follow(
            &name,
            fineness,
            |random| {
                let choice = random.number();
                let sample = bsdf.sample(choice, random.point(), allowed)?;
                Some(sample.direction)
            },
            |direction| bsdf.evaluate(direction, allowed).pdf,
        );
    }
}

#[test]
fn no_specular_is_lambert_exactly() {
    let color = Vec3::new(0.8, 0.5, 0.2);
    let p = Parameters {
        color,
        f0: 0.0,
        ..base()
    };
    let f = Bsdf::new(p, viewer(1.3)).evaluate(viewer(-0.4), Allowed::ALL);
    assert_eq!(f.glossy, Vec3::ZERO);
    let lambert = color * FRAC_1_PI * 0.4_f32.cos();
    assert!(f.diffuse.abs_diff_eq(lambert, 1e-5), "{}", f.diffuse);
    assert_eq!(Bsdf::new(p, viewer(1.5)).gloss(), 0.0);
}

#[test]
fn smooth_glass_bends_by_snell_and_splits_by_fresnel() {
    let p = Parameters {
        alpha: 0.0,
        transmission: 1.0,
        ..base()
    };
    let v = viewer(0.7);
    let bsdf = Bsdf::new(p, v);
    let reflectance = fresnel::dielectric(v.z, 1.5);
    let n = 10_000;
    let mut passed = 0;
    for i in 0..n {
        let choice = (i as f32 + 0.5) / n as f32;
        let sample = bsdf.sample(choice, Vec2::splat(0.3), Allowed::ALL).unwrap();
        if sample.direction.z < 0.0 {
            passed += 1;
            let sin = (1.0 - sample.direction.z.powi(2)).sqrt();
            assert!((1.5 * sin - 0.7_f32.sin()).abs() < 1e-5);
            assert_eq!(sample.bounce, Bounce::Transmission);
            let weight = sample.mirror_weight.unwrap().x;
            assert!((weight - 1.0 / 2.25).abs() < 1e-5, "{weight}");
        } else {
            assert!(
                sample
                    .direction
                    .abs_diff_eq(Vec3::new(-v.x, 0.0, v.z), 1e-6)
            );
            assert_eq!(sample.bounce, Bounce::Glossy);
        }
    }
    assert!((passed as f32 / n as f32 - (1.0 - reflectance)).abs() < 1e-3);
}

#[test]
fn rough_dielectrics_need_no_reflection_ray_and_metals_do() {
    let gloss = |metallic, roughness: f32| {
        let p = Parameters {
            metallic,
            alpha: roughness * roughness,
            ..base()
        };
        Bsdf::new(p, Vec3::Z).gloss()
    };
    assert!(gloss(0.0, 1.0) < 0.01);
    assert!(gloss(0.0, 0.2) > 0.01);
    assert!(gloss(1.0, 1.0) > 0.1);
}
