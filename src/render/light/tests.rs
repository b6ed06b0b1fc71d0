use super::*;

/// The law of every light: the mean of radiance * cos / pdf over samples is the irradiance that a fine
/// grid of directions finds, and the density of a sample is what `pdf` says, but for samples on the
/// border of two cells.
#[test]
fn sampled_irradiance_is_the_integral_of_radiance() {
    let direction = Vec3::new(0.3, 0.8, 0.1).normalize();
    let sky = Sky::new(direction, 4.0, 1.0);
    let normal = Vec3::new(0.2, 0.9, -0.3).normalize();
    let grid = 600;
    let mut expected = Vec3::ZERO;
    for row in 0..grid {
        for column in 0..2 * grid {
            let uv = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) / grid as f32;
            let theta = std::f32::consts::PI * uv.y;
            let d = latlong::direction(Vec2::new(0.5 * uv.x, theta.cos()));
            let solid_angle = (std::f32::consts::PI / grid as f32).powi(2) * theta.sin();
            expected += sky.radiance(d) * d.dot(normal).max(0.0) * solid_angle;
        }
    }
    let n = 40_000;
    let mut sum = Vec3::ZERO;
    let mut on_borders = 0;
    for i in 0..n {
        let u = Vec2::new(i as f32 / n as f32, (i as f32 * 0.618_034).fract());
        let s = sky.sample(normal, u);
        on_borders += u32::from((s.pdf - sky.pdf(normal, s.direction)).abs() > 1e-3 * s.pdf);
        sum += s.radiance * s.direction.dot(normal).max(0.0) / s.pdf;
    }
    assert!(on_borders < n / 500, "{on_borders}");
    let measured = sum / n as f32;
    assert!(
        (measured / expected - 1.0).abs().max_element() < 0.01,
        "{measured} {expected}"
    );
}
