//! Bodies of glass against Fresnel, Snell and Beer.

use super::*;

#[test]
fn a_slab_of_glass_follows_fresnel_and_beer() {
    let tinted = Material {
        attenuation_color: Vec3::new(0.5, 0.8, 1.0),
        attenuation_distance: 0.5,
        ..glass(0.0)
    };
    let body = slab(Vec3::new(-3.0, -3.0, -1.0), Vec3::new(3.0, 3.0, 0.0));
    let backdrop = quad(
        Vec3::new(-20.0, -20.0, -3.0),
        40.0 * Vec3::X,
        40.0 * Vec3::Y,
    );
    let scene = Scene::new(
        vec![
            (Shape::Triangles(built(body)), tinted),
            (backdrop, emissive(Vec3::ONE)),
        ],
        dark_room(),
    );
    let angle = 0.6_f32;
    let ray = |_| {
        Ray::new(
            Vec3::new(-0.7, 0.0, 1.0),
            Vec3::new(angle.sin(), 0.0, -angle.cos()),
        )
    };
    let mean = scene.mean(long(), 20_000, ray);
    // The way inside by Snell, what is left by Beer, and all reflections inside: T = (1 - r)^2 a / (1 - r^2 a^2).
    let cos_inside = (1.0 - (angle.sin() / 1.5).powi(2)).sqrt();
    let r = 0.5
        * (((angle.cos() - 1.5 * cos_inside) / (angle.cos() + 1.5 * cos_inside)).powi(2)
            + ((1.5 * angle.cos() - cos_inside) / (1.5 * angle.cos() + cos_inside)).powi(2));
    let a = Vec3::new(0.5, 0.8, 1.0).powf(1.0 / cos_inside / 0.5);
    let expected = (1.0 - r).powi(2) * a / (1.0 - r * r * a * a);
    assert!(mean.abs_diff_eq(expected, 0.01), "{mean} {expected}");
}

#[test]
fn a_prism_deviates_by_snell_and_reflects_totally() {
    // A right-angled prism: a ray into its short side is turned by 90 degrees at the long one.
    let (a, b, c) = (Vec3::ZERO, Vec3::X, Vec3::Y);
    let depth = Vec3::Z * 4.0;
    let mut mesh = MeshBuilder::default();
    let mut face = |corners: &[Vec3]| {
        let first = mesh.positions.len() as u32;
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize();
        mesh.positions.extend(corners);
        mesh.normals.extend(vec![normal; corners.len()]);
        mesh.texcoords.extend(vec![Vec2::ZERO; corners.len()]);
        for i in 1..corners.len() as u32 - 1 {
            mesh.triangles.push([first, first + i, first + i + 1]);
        }
    };
    let (a0, b0, c0) = (a - 0.5 * depth, b - 0.5 * depth, c - 0.5 * depth);
    let (a1, b1, c1) = (a0 + depth, b0 + depth, c0 + depth);
    face(&[a1, b1, c1]);
    face(&[a0, c0, b0]);
    face(&[a0, b0, b1, a1]);
    face(&[a0, a1, c1, c0]);
    face(&[b0, c0, c1, b1]);
    // Below, where the ray leaves after the reflection, the world shines; elsewhere it is dark.
    let below = quad(Vec3::new(-2.0, -1.0, -2.0), 4.0 * Vec3::X, 4.0 * Vec3::Z);
    let scene = Scene::new(
        vec![
            (Shape::Triangles(built(mesh)), glass(0.0)),
            (below, emissive(Vec3::ONE)),
        ],
        dark_room(),
    );
    let mean = scene.mean(long(), 4000, |_| {
        Ray::new(Vec3::new(-1.0, 0.3, 0.0), Vec3::X)
    });
    // In and out through the short sides: (1 - 0.04)^2, and a little that comes back after more reflections.
    assert!((mean.x - 0.9216).abs() < 0.02, "{mean}");
}

#[test]
fn water_in_glass_has_no_gap_and_no_double_boundary() {
    // A slab of water that overlaps two panes: with priorities the boundaries are glass-water and nothing else.
    let pane = |z: f32, material: Material| {
        let body = slab(Vec3::new(-3.0, -3.0, z), Vec3::new(3.0, 3.0, z + 1.0));
        (Shape::Triangles(built(body)), material)
    };
    let firm = Material {
        priority: 1,
        ..glass(0.0)
    };
    let water = Material {
        ior: 1.33,
        ..glass(0.0)
    };
    let overlapping = slab(Vec3::new(-3.0, -3.0, -2.5), Vec3::new(3.0, 3.0, 0.5));
    let backdrop = quad(
        Vec3::new(-20.0, -20.0, -9.0),
        40.0 * Vec3::X,
        40.0 * Vec3::Y,
    );
    let scene = Scene::new(
        vec![
            pane(0.0, firm.clone()),
            (Shape::Triangles(built(overlapping)), water),
            pane(-3.0, firm),
            (backdrop, emissive(Vec3::ONE)),
        ],
        dark_room(),
    );
    let mean = scene.mean(long(), 20_000, |_| {
        Ray::new(Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z)
    });
    // Incoherent stack of interfaces with reflectances r1 r2 r2 r1: R/(1-R) = sum of r/(1-r), here of 1/T - 1.
    let r = |n: f32| ((n - 1.0) / (n + 1.0)).powi(2);
    let (r1, r2) = (r(1.5), r(1.5 / 1.33));
    let resistance = 2.0 * (r1 / (1.0 - r1) + r2 / (1.0 - r2));
    let expected = 1.0 / (1.0 + resistance);
    assert!((mean.x - expected).abs() < 0.01, "{mean} {expected}");
}

#[test]
fn a_camera_in_glass_knows_it() {
    let scene = Scene::new(
        vec![(Shape::Triangles(built(ball(1.0))), glass(0.0))],
        vec![],
    );
    let bodies = |position| scene.with_input(|input| stage::Stage::new(input).bodies_at(position));
    assert_eq!(bodies(Vec3::new(0.0, -3.0, 0.1)), bodies::Bodies::default());
    assert_ne!(bodies(Vec3::new(0.2, 0.1, 0.1)), bodies::Bodies::default());
}

#[test]
fn a_camera_in_stone_is_noticed_and_one_in_glass_or_outside_is_not() {
    let enclosing = |material: Material, position| {
        let mut scene = Scene::new(vec![(displaced_ball(0.9, 0.1, waves), material)], vec![]);
        scene.camera.position = position;
        scene.with_input(enclosing_object)
    };
    assert_eq!(enclosing(white(), Vec3::new(0.1, 0.2, -0.3)), Some(0));
    assert_eq!(enclosing(white(), Vec3::new(0.1, 0.2, -1.3)), None);
    assert_eq!(enclosing(glass(0.0), Vec3::new(0.1, 0.2, -0.3)), None);
}

#[test]
fn a_floor_through_the_stone_hides_nothing_but_a_lamp_may_be_inside() {
    let floor = || quad(Vec3::new(-3.0, -3.0, -0.6), 6.0 * Vec3::X, 6.0 * Vec3::Y);
    let enclosing = |stone: Shape, lights: Vec<Light>, z: f32| {
        let mut scene = Scene::new(vec![(floor(), white()), (stone, white())], lights);
        scene.camera.position = Vec3::new(0.1, 0.2, z);
        scene.with_input(enclosing_object)
    };
    let stone = || displaced_ball(0.9, 0.1, waves);
    let sun = || Light::Directional {
        direction: Vec3::Z,
        irradiance: Vec3::ONE,
    };
    // Above the floor, below it, and outside of the stone above and below.
    for (z, expected) in [(-0.3, Some(1)), (-0.7, Some(1)), (1.3, None), (-1.3, None)] {
        for lights in [vec![], vec![sun()]] {
            assert_eq!(enclosing(stone(), lights, z), expected, "{z}");
        }
        assert_eq!(enclosing(stone(), dark_room(), z), None, "a lamp, {z}");
    }
    // Between the shells of a hollow one is stone, in the hollow is none.
    let mut hollow = ball(1.0);
    let mut inner = ball(0.5);
    for triangle in &mut inner.triangles {
        triangle.swap(0, 1);
    }
    for normal in &mut inner.normals {
        *normal = -*normal;
    }
    hollow.append(inner);
    let hollow = Shape::Triangles(built(hollow));
    assert_eq!(enclosing(hollow.clone(), vec![], 0.0), None);
    assert_eq!(enclosing(hollow, vec![], -0.75), Some(1));
}
