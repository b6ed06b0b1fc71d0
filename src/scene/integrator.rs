//! What is computed for a camera ray.

/// What is computed for a camera ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Integrator {
    /// Global illumination by path tracing.
    Path(PathLimits),
    /// The paper's first look: direct light, one reflection, refraction.
    #[default]
    Beauty,
    /// The part of the hemisphere that is open within a distance, weighted by the cosine.
    Ao {
        /// World units; may be infinite.
        distance: f32,
    },
    /// A look at something that is not light.
    View(View),
}

/// Most bounces of a path by their kind; what is emitted is seen after 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathLimits {
    /// Off diffuse surfaces.
    pub diffuse: u32,
    /// Off coats, metals and dielectrics from outside.
    pub glossy: u32,
    /// Through dielectrics, or back inside them.
    pub transmission: u32,
    /// From this bounce on Russian roulette may end a path.
    pub roulette: u32,
}

impl Default for PathLimits {
    fn default() -> Self {
        Self {
            diffuse: 6,
            glossy: 8,
            transmission: 16,
            roulette: 4,
        }
    }
}

/// What a view shows of the first hit. Where there is none, all but [`Self::Cost`] are black.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// The shading normal: (n + 1) / 2.
    Normal,
    /// The geometric normal: (n + 1) / 2.
    Geometric,
    /// Texture coordinates: their fractions in red and green.
    Uv,
    /// Distance from the eye, in diagonals of the scene.
    Depth,
    /// What the material returns of a white world.
    Albedo,
    /// Displacement, in hundredths of the scene's diagonal: outward red, inward blue, grey 0.5 for none.
    Displacement,
    /// A colour per base triangle.
    Prim,
    /// Steps of the march from the ray's origin to its hit ([`count_steps`](crate::prism::count_steps)), as a heat map. Prisms must be made
    /// [to count them](crate::prism::Prisms::counting_steps), as [`Scene::world`](super::Scene::world) does for this view.
    Cost,
}
