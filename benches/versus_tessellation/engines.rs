//! The contestants: each is a way to keep the displaced surface in an Embree scene, through an edit too.

use std::sync::Arc;

use prismarch::embree::{
    BuildQuality, Device, DeviceOptions, EmbreeError, Geometry, GridGeometry, Scene, SceneBuilder,
    SceneOptions, TriangleGeometry, UserGeometry,
};
use prismarch::prism::{March, Prisms};
use prismarch::surface::DisplacedSurface;

use crate::tessellation::{Pattern, Rect, Tessellation, touched};

type Surface = Arc<DisplacedSurface>;

/// A surface in a scene.
pub trait Engine {
    /// What can be traced.
    fn scene(&self) -> &Scene;

    /// Follows an edit of the surface's map in the texels of `rect`.
    fn edit(&mut self, surface: &Surface, rect: Rect);

    /// Bytes that tracing needs, beside what Embree allocates.
    fn bytes(&self) -> usize;

    /// What is traced, in words.
    fn size(&self) -> String;
}

/// Builds an engine for a surface.
pub type Build = fn(&Surface) -> Box<dyn Engine>;

/// All engines, by name. The ratios of the report are to [`BASELINE`].
pub const ENGINES: [(&str, Build); 4] = [
    ("prisms", |surface| Box::new(PrismEngine::new(surface))),
    (BASELINE, |surface| Box::new(Triangles::new(surface))),
    ("triangles by patch", |surface| {
        Box::new(PatchedTriangles::new(surface))
    }),
    ("grids", |surface| Box::new(Grids::new(surface))),
];

/// The engine that the others are compared with.
pub const BASELINE: &str = "triangles";

/// A scene of `geometries` on a device of its own, so that its memory is counted alone.
fn build<G: Into<Geometry>>(
    options: SceneOptions,
    geometries: impl FnOnce(&Device) -> Result<Vec<G>, EmbreeError>,
) -> Scene {
    let scene = || {
        let device = Device::new(&DeviceOptions::default())?;
        let mut builder = SceneBuilder::new(&device, options)?;
        for geometry in geometries(&device)? {
            builder.attach(geometry)?;
        }
        builder.commit()
    };
    scene().expect("Embree builds the sphere")
}

/// Reopens a scene, changes it and commits it.
fn change(
    scene: &mut Option<Scene>,
    change: impl FnOnce(&mut SceneBuilder) -> Result<(), EmbreeError>,
) {
    let mut builder = scene.take().expect(COMMITTED).reopen();
    let changed = change(&mut builder).and_then(|()| builder.commit());
    *scene = Some(changed.expect("Embree builds the edited sphere"));
}

const COMMITTED: &str = "an engine has a scene between two edits";

fn sizes(surface: &Surface, triangles: usize) -> String {
    format!("{:.1} M triangles", triangles as f64 / 1e6)
        + &format!(" over {}", surface.mesh().triangles().len())
}

/// This crate: prisms around the base triangles and the map itself.
struct PrismEngine {
    prisms: Arc<Prisms>,
    scene: Option<Scene>,
}

fn prisms_of(surface: &Surface) -> Arc<Prisms> {
    Arc::new(Prisms::new(surface.clone(), March::default()).expect("the default march"))
}

impl PrismEngine {
    fn new(surface: &Surface) -> Self {
        let prisms = prisms_of(surface);
        let scene = build(SceneOptions::default(), |device| {
            Ok(vec![UserGeometry::new(device, prisms.clone())?])
        });
        Self {
            prisms,
            scene: Some(scene),
        }
    }
}

impl Engine for PrismEngine {
    fn scene(&self) -> &Scene {
        self.scene.as_ref().expect(COMMITTED)
    }

    fn edit(&mut self, _: &Surface, rect: Rect) {
        if self.prisms.map_edited(rect.texels()).any() {
            change(&mut self.scene, |builder| builder.changed(0));
        }
    }

    fn bytes(&self) -> usize {
        let surface = self.prisms.surface();
        self.prisms.bytes() + surface.map().bytes() + surface.mesh().bytes()
    }

    fn size(&self) -> String {
        format!("{} prisms", self.prisms.surface().mesh().triangles().len())
    }
}

/// Embree's triangles in one geometry: the fastest to trace, built anew by every edit.
struct Triangles {
    tessellation: Tessellation,
    scene: Option<Scene>,
    size: String,
}

impl Triangles {
    fn new(surface: &Surface) -> Self {
        let tessellation = Tessellation::new(Pattern::Barycentric, surface);
        let mut triangles = Vec::with_capacity(tessellation.triangle_count());
        for prim in 0..tessellation.pieces {
            let first = tessellation.range(prim).start as u32;
            triangles.extend(tessellation.triangles_from(first));
        }
        let positions = tessellation.positions(surface);
        let scene = build(SceneOptions::default(), |device| {
            let geometry = TriangleGeometry::from_buffers(device, positions, triangles)?;
            Ok(vec![geometry])
        });
        Self {
            size: sizes(surface, tessellation.triangle_count()),
            tessellation,
            scene: Some(scene),
        }
    }
}

impl Engine for Triangles {
    fn scene(&self) -> &Scene {
        self.scene.as_ref().expect(COMMITTED)
    }

    fn edit(&mut self, surface: &Surface, rect: Rect) {
        let tessellation = &self.tessellation;
        change(&mut self.scene, |builder| {
            displace_touched(builder, tessellation, surface, rect)
        });
    }

    fn bytes(&self) -> usize {
        self.tessellation.bytes_of_vertices() + 12 * self.tessellation.triangle_count()
    }

    fn size(&self) -> String {
        self.size.clone()
    }
}

/// Moves what `rect` touches of a tessellation in one geometry.
fn displace_touched(
    builder: &mut SceneBuilder,
    tessellation: &Tessellation,
    surface: &Surface,
    rect: Rect,
) -> Result<(), EmbreeError> {
    builder.move_vertices(0, |vertices| {
        for prim in touched(surface, rect) {
            tessellation.displace(surface, prim, &mut vertices[tessellation.range(prim)]);
        }
    })
}

/// Embree's triangles in one geometry per base triangle, in a dynamic scene of low build quality: only so does Embree
/// keep the trees of geometries that an edit does not touch.
struct PatchedTriangles {
    tessellation: Tessellation,
    scene: Option<Scene>,
    size: String,
}

impl PatchedTriangles {
    fn new(surface: &Surface) -> Self {
        let tessellation = Tessellation::new(Pattern::Barycentric, surface);
        let positions = tessellation.positions(surface);
        let options = SceneOptions {
            quality: BuildQuality::Low,
            dynamic: true,
            ..SceneOptions::default()
        };
        let scene = build(options, |device| {
            let patch = |prim| {
                TriangleGeometry::from_buffers(
                    device,
                    positions[tessellation.range(prim)].to_vec(),
                    tessellation.triangles_from(0).collect(),
                )
            };
            (0..tessellation.pieces).map(patch).collect()
        });
        Self {
            size: sizes(surface, tessellation.triangle_count()),
            tessellation,
            scene: Some(scene),
        }
    }
}

impl Engine for PatchedTriangles {
    fn scene(&self) -> &Scene {
        self.scene.as_ref().expect(COMMITTED)
    }

    fn edit(&mut self, surface: &Surface, rect: Rect) {
        let tessellation = &self.tessellation;
        change(&mut self.scene, |builder| {
            for prim in touched(surface, rect) {
                builder.move_vertices(prim, |vertices| {
                    tessellation.displace(surface, prim, vertices);
                })?;
            }
            Ok(())
        });
    }

    fn bytes(&self) -> usize {
        self.tessellation.bytes_of_vertices() + 12 * self.tessellation.triangle_count()
    }

    fn size(&self) -> String {
        self.size.clone()
    }
}

/// Embree's grids in one geometry.
struct Grids {
    tessellation: Tessellation,
    scene: Option<Scene>,
    size: String,
}

impl Grids {
    fn new(surface: &Surface) -> Self {
        let tessellation = Tessellation::new(Pattern::Grids, surface);
        let positions = tessellation.positions(surface);
        let scene = build(SceneOptions::default(), |device| {
            let grids = tessellation.grids();
            Ok(vec![GridGeometry::from_buffers(device, positions, &grids)?])
        });
        Self {
            size: sizes(surface, tessellation.triangle_count()),
            tessellation,
            scene: Some(scene),
        }
    }
}

impl Engine for Grids {
    fn scene(&self) -> &Scene {
        self.scene.as_ref().expect(COMMITTED)
    }

    fn edit(&mut self, surface: &Surface, rect: Rect) {
        let tessellation = &self.tessellation;
        change(&mut self.scene, |builder| {
            displace_touched(builder, tessellation, surface, rect)
        });
    }

    fn bytes(&self) -> usize {
        let grids = size_of_val(&self.tessellation.grids()[..]);
        self.tessellation.bytes_of_vertices() + grids
    }

    fn size(&self) -> String {
        self.size.clone()
    }
}
