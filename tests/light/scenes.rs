//! Surfaces of ordinary and of hard relief, each under lights of every kind, as prismarch renders them.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use prismarch::bvh::BvhTracer;
use prismarch::demo::{DEMOS, WriteOptions};
use prismarch::prism::{March, Prisms};
use prismarch::render::film::{Frame, Objects};
use prismarch::render::{Control, RenderInput, render_frame};
use prismarch::scene::{
    AovSet, Camera, Color, Film, Filter, FilterShape, Integrator, Light, Loaded, Material,
    ObjectShape, PathLimits, Scalar,
};
use prismarch::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, ShadingNormals,
    Texels, Wrap,
};
use prismarch::trace::{Object, Placement, Shape, World};

use super::reference::{Lamp, Matter};

/// One displaced surface, and where it is seen from.
pub struct Case {
    pub name: &'static str,
    pub surface: DisplacedSurface,
    /// Triangles along a base triangle's side that the reference cuts it in; 0: too many texels for it.
    pub cuts: usize,
    pub eye: Vec3,
    pub target: Vec3,
    /// Vertical, radians.
    pub fov: f32,
}

/// Pixels along a picture's side.
pub const SIDE: u32 = 48;

/// A number in [0, 1) of a place (PCG hash).
fn hash(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// `n` x `n` texels that have nothing to do with each other.
fn noise(n: usize) -> Vec<u16> {
    (0..n * n).map(|i| hash(i as u32) as u16).collect()
}

/// `n` x `n` texels of a few waves: a soft map that repeats.
fn soft(n: usize) -> Vec<u16> {
    let tau = std::f32::consts::TAU / n as f32;
    let at = |i: usize| {
        let (x, y) = (tau * (i % n) as f32, tau * (i / n) as f32);
        let h = (3.0 * x + (2.0 * y).sin()).sin()
            + (4.0 * y - 2.0 * x).cos()
            + 0.5 * (9.0 * x).sin() * (7.0 * y).cos();
        ((h / 2.5 * 0.5 + 0.5) * 65535.0) as u16
    };
    (0..n * n).map(at).collect()
}

/// The same, level at the bottom and the top: for spheres, whose poles are drawn together there.
fn soft_belt(n: usize) -> Vec<u16> {
    let window = |i: usize| {
        (std::f32::consts::PI * ((i / n) as f32 + 0.5) / n as f32)
            .sin()
            .powi(2)
    };
    let waves = soft(n).into_iter().enumerate();
    waves
        .map(|(i, h)| (f32::from(h) * window(i)) as u16)
        .collect()
}

/// The same surface as `texels` of `n` x `n` in `times` as many texels, which repeat.
fn upsampled(texels: &[u16], n: usize, times: usize) -> Vec<u16> {
    let map = DisplacementMap::new(n, n, Texels::U16(texels.to_vec()), Wrap::Repeat).unwrap();
    let m = n * times;
    let at = |i: usize| {
        let st = Vec2::new((i % m) as f32 + 0.5, (i / m) as f32 + 0.5) / m as f32;
        (map.height(st) * 65535.0).round() as u16
    };
    (0..m * m).map(at).collect()
}

/// A square of 2 x 2 around the origin, facing up.
fn plane() -> MeshBuilder {
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let position = |c: Vec2| Vec3::new(2.0 * c.x - 1.0, 0.0, 1.0 - 2.0 * c.y);
    MeshBuilder {
        positions: corners.map(position).to_vec(),
        normals: vec![Vec3::Y; 4],
        texcoords: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// A unit sphere of `across` times `up` faces with the normals of the sphere.
fn sphere(across: u32, up: u32) -> MeshBuilder {
    let mut mesh = MeshBuilder::default();
    for j in 0..=up {
        for i in 0..=across {
            let (s, t) = (i as f32 / across as f32, j as f32 / up as f32);
            let (longitude, latitude) =
                (std::f32::consts::TAU * s, std::f32::consts::PI * (t - 0.5));
            // The first and the last meridian are the same to the bit.
            let longitude = if i == across { 0.0 } else { longitude };
            let p = Vec3::new(
                longitude.sin() * latitude.cos(),
                latitude.sin(),
                longitude.cos() * latitude.cos(),
            );
            mesh.positions.push(p);
            mesh.normals.push(p.normalize());
            mesh.texcoords.push(Vec2::new(s, t));
            if i < across && j < up {
                let a = j * (across + 1) + i;
                let (b, c, d) = (a + 1, a + across + 2, a + across + 1);
                if j > 0 {
                    mesh.triangles.push([a, b, c]);
                }
                if j + 1 < up {
                    mesh.triangles.push([a, c, d]);
                }
            }
        }
    }
    mesh
}

fn surface(mesh: MeshBuilder, n: usize, texels: Vec<u16>, scale: f32) -> DisplacedSurface {
    let (mesh, _) = mesh.build(NormalMode::File).unwrap();
    let map = DisplacementMap::new(n, n, Texels::U16(texels), Wrap::Repeat).unwrap();
    DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(scale)).unwrap()
}

pub fn cases() -> Vec<Case> {
    let above = |name, surface, cuts| Case {
        name,
        surface,
        cuts,
        eye: Vec3::new(1.2, 2.6, 2.2),
        target: Vec3::ZERO,
        fov: 0.5,
    };
    let around = |name, surface, cuts| Case {
        name,
        surface,
        cuts,
        eye: Vec3::new(1.2, 2.6, 4.2),
        target: Vec3::ZERO,
        fov: 0.45,
    };
    let upsampled = || upsampled(&noise(64), 64, 16);
    vec![
        above("flat, noise", surface(plane(), 64, noise(64), 0.05), 256),
        above(
            "flat, noise in 16x16 texels",
            surface(plane(), 1024, upsampled(), 0.05),
            256,
        ),
        above("flat, soft", surface(plane(), 128, soft(128), 0.2), 256),
        around(
            "curved, noise",
            surface(sphere(32, 16), 64, noise(64), 0.1),
            16,
        ),
        around(
            "curved, soft",
            surface(sphere(32, 16), 128, soft_belt(128), 0.2),
            16,
        ),
        around(
            "coarse, soft",
            surface(sphere(10, 5), 128, soft_belt(128), 0.2),
            50,
        ),
    ]
}

/// The displaced mesh of a demo as the demo's camera sees it.
pub fn demo(name: &'static str) -> Case {
    let folder = tempfile::tempdir().unwrap();
    let demo = DEMOS.iter().find(|demo| demo.name == name).unwrap();
    let options = WriteOptions {
        map_size: demo.map_size,
        force: false,
        picture: false,
    };
    let scene = demo.write(folder.path(), options).unwrap();
    let scene = Loaded::from_file(&scene).unwrap().scene;
    let mut surfaces = scene.objects.iter().filter_map(|o| match &o.shape {
        ObjectShape::Displaced(surface, _) => Some(DisplacedSurface::clone(surface)),
        ObjectShape::Plain(_) => None,
    });
    Case {
        name,
        surface: surfaces.next().unwrap(),
        cuts: 0,
        eye: scene.camera.position,
        target: scene.camera.target,
        fov: scene.camera.fov,
    }
}

pub fn case(name: &str) -> Case {
    cases().into_iter().find(|case| case.name == name).unwrap()
}

/// The renderer's light for one of the reference's; the square that shines may be a mesh.
fn light(lamp: Lamp) -> Vec<Light> {
    match lamp {
        Lamp::Sky => vec![],
        Lamp::Sun { to, irradiance } => vec![Light::Directional {
            direction: to.as_vec3(),
            irradiance: Vec3::splat(irradiance as f32),
        }],
        Lamp::Point { at, intensity } => vec![Light::Point {
            position: at.as_vec3(),
            intensity: Vec3::splat(intensity as f32),
            range: f32::INFINITY,
        }],
        Lamp::Rectangle {
            corner,
            edges,
            radiance,
        } => vec![Light::Rectangle {
            corner: corner.as_vec3(),
            edges: edges.map(|e| e.as_vec3()),
            radiance: Vec3::splat(radiance as f32),
        }],
    }
}

fn material(matter: Matter) -> Material {
    let white = Material {
        base_color: Color::Constant(Vec3::ONE),
        specular: Scalar::Constant(0.0),
        ..Material::default()
    };
    match matter {
        Matter::Chalk(albedo) => Material {
            base_color: Color::Constant(Vec3::splat(albedo as f32)),
            ..white
        },
        Matter::Metal { alpha, reflectance } => Material {
            base_color: Color::Constant(Vec3::splat(reflectance as f32)),
            metallic: Scalar::Constant(1.0),
            roughness: Scalar::Constant(alpha.sqrt() as f32),
            ..white
        },
        Matter::Glass { index } => Material {
            transmission: Scalar::Constant(1.0),
            roughness: Scalar::Constant(0.0),
            specular: Scalar::Constant(0.5),
            ior: index as f32,
            ..white
        },
    }
}

/// A square of a mesh that shines as a rectangle does.
fn lamp_mesh(lamp: Lamp) -> Option<(Shape, Material)> {
    let Lamp::Rectangle {
        corner,
        edges: [a, b],
        radiance,
    } = lamp
    else {
        return None;
    };
    let mesh = MeshBuilder {
        positions: [corner, corner + a, corner + a + b, corner + b]
            .map(|p| p.as_vec3())
            .to_vec(),
        normals: vec![],
        texcoords: vec![],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let (mesh, _) = mesh.build(NormalMode::File).unwrap();
    let material = Material {
        emission: Color::Constant(Vec3::splat(radiance as f32)),
        ..material(Matter::Chalk(0.0))
    };
    Some((Shape::Triangles(Arc::new(mesh)), material))
}

/// A picture's settings.
pub struct Look {
    pub matter: Matter,
    pub lamp: Lamp,
    /// The lamp is a mesh that shines.
    pub is_mesh: bool,
    pub spp: u32,
}

/// The mean radiance of a case's picture over what is hit, by normals of a kind.
pub fn mean(case: &Case, look: &Look, normals: ShadingNormals) -> f64 {
    let black = Matter::Chalk(0.0);
    let around = |lamp| {
        let look = Look {
            matter: black,
            lamp,
            ..*look
        };
        picture(case, &look, normals)
    };
    let sky = around(Lamp::Sky);
    // Points and suns are not seen, and the lamps that are meshes hang outside of the picture.
    let behind = match look.lamp {
        Lamp::Sky => sky,
        Lamp::Rectangle { .. } if !look.is_mesh => around(look.lamp),
        _ => 0.0,
    };
    (picture(case, look, normals) - behind) / (1.0 - sky)
}

/// The mean radiance of a whole picture.
fn picture(case: &Case, look: &Look, normals: ShadingNormals) -> f64 {
    let surface = case.surface.clone().with_shading_normals(normals);
    let prisms = Prisms::new(Arc::new(surface), March::Exact).unwrap();
    let mut shapes = vec![(Shape::Displaced(Arc::new(prisms)), material(look.matter))];
    let mut lights = light(look.lamp);
    if look.is_mesh
        && let Some(mesh) = lamp_mesh(look.lamp)
    {
        shapes.push(mesh);
        lights.clear();
    }
    let (shapes, materials): (Vec<_>, Vec<_>) = shapes.into_iter().unzip();
    let object = |shape| Object {
        shape,
        placement: Placement::World,
        mask: u32::MAX,
    };
    let world = World::new(shapes.into_iter().map(object).collect());
    let tracer = BvhTracer::new(&world).unwrap();
    let camera = Camera {
        position: case.eye,
        target: case.target,
        fov: case.fov,
        ..Camera::default()
    };
    let film = Film {
        width: SIDE,
        height: SIDE,
        spp: look.spp,
        filter: Filter {
            shape: FilterShape::Box,
            radius: 0.5,
        },
        aovs: AovSet::NONE,
        ..Film::default()
    };
    let integrator = Integrator::Path(PathLimits {
        diffuse: 100,
        glossy: 100,
        transmission: 100,
        roulette: 4,
    });
    let input = RenderInput {
        tracer: &tracer,
        surfaces: &world,
        camera: &camera,
        film: &film,
        materials: &materials,
        object_materials: &(0..materials.len()).collect::<Vec<_>>(),
        lights: &lights,
        integrator: &integrator,
    };
    let mut frame = Frame::new(&film, 0..film.spp, Objects::default());
    render_frame(&input, &mut frame, Control::default());
    let pixels = frame.radiance();
    pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / pixels.len() as f64
}
