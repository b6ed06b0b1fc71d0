//! A scene of shapes and materials, and the mean of paths through it.

use super::*;

/// A world with one material per object.
pub(super) struct Scene {
    world: World,
    tracer: BvhTracer,
    materials: Vec<Material>,
    object_materials: Vec<usize>,
    lights: Vec<Light>,
    pub camera: Camera,
    film: Film,
    /// Whether the shading normal is taken to be the geometric one.
    pub facetted: bool,
}

impl Surfaces for Scene {
    fn point(&self, hit: &Hit) -> SurfacePoint {
        let point = self.world.surface_point(hit);
        if self.facetted {
            return SurfacePoint {
                shading_normal: point.geometric_normal,
                ..point
            };
        }
        point
    }

    fn object(&self, hit: &Hit) -> usize {
        self.world.resolve(hit).object
    }

    fn placed(&self) -> Vec<PlacedObject> {
        self.world.placed()
    }

    fn area_element(&self, hit: &Hit) -> Option<f32> {
        self.world.area_element(hit)
    }

    fn tangents(&self, hit: &Hit) -> Option<[Vec3; 2]> {
        self.world.tangents(hit)
    }
}

impl Scene {
    pub fn new(objects: Vec<(Shape, Material)>, lights: Vec<Light>) -> Self {
        let (shapes, materials): (Vec<_>, Vec<_>) = objects.into_iter().unzip();
        let object = |shape| Object {
            shape,
            placement: Placement::World,
            mask: u32::MAX,
        };
        let world = World::new(shapes.into_iter().map(object).collect());
        Self {
            tracer: BvhTracer::new(&world).unwrap(),
            world,
            object_materials: (0..materials.len()).collect(),
            materials,
            lights,
            camera: Camera {
                position: Vec3::new(0.0, 0.0, 10.0),
                target: Vec3::ZERO,
                ..Camera::default()
            },
            film: Film::default(),
            facetted: false,
        }
    }

    /// The mean of `n` paths along rays that `ray` makes of uniform points.
    pub fn mean(&self, options: Options, n: u32, ray: impl Fn(Vec2) -> Ray) -> Vec3 {
        self.with_input(|input| mean(&Path::new(input, &options.tables(input), options), n, ray))
    }

    /// What `look` makes of the scene.
    pub fn with_input<T>(&self, look: impl FnOnce(&RenderInput) -> T) -> T {
        look(&RenderInput {
            tracer: &self.tracer,
            surfaces: self,
            camera: &self.camera,
            film: &self.film,
            materials: &self.materials,
            object_materials: &self.object_materials,
            lights: &self.lights,
            integrator: &scene::Integrator::Beauty,
        })
    }
}

fn mean(path: &Path, n: u32, ray: impl Fn(Vec2) -> Ray) -> Vec3 {
    let mut random = Random::new(3);
    let mut counts = RayCounts::default();
    let sum: Vec3 = (0..n)
        .map(|i| {
            let sampler = Sampler::new(UVec2::new(5, 9), i, 1);
            path.sample(&path.camera_ray(ray(random.point())), &sampler, &mut counts)
                .radiance
        })
        .sum();
    sum / n as f32
}
