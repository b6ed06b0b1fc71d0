//! Surfaces: `prismarch_surface_*`, `prismarch_interpolate*`.

use std::sync::{Arc, Mutex, PoisonError};

use super::base::{Base, Primitives};
use super::buffer::{self, Vertices};
use super::declarations::{
    self as c, prismarch_error, prismarch_point, prismarch_status, prismarch_surface_desc,
    prismarch_vertices,
};
use super::error::{Failure, answer};
use super::handle::{Handle, Kind, output};
use super::live::{Live, Traced};
use super::map::Map;
use crate::embree::Faults;
use crate::prism::{EditBounds, Lod, March, MovingPrisms, PrismOptions, Prisms, Step};
use crate::surface::{
    DisplacedSurface, Displacement, Interpolated, MovingSurface, Seams, TimeStep,
};

/// A surface, and how to make it again when its vertices move.
pub struct Surface {
    pub live: Arc<Live>,
    pub faults: Arc<Faults>,
    map: Arc<Handle<Map>>,
    recipe: Recipe,
    steps: Mutex<Vec<TimeStep>>,
}

impl Kind for Surface {
    const MAGIC: u64 = u64::from_le_bytes(*b"pm surf1");
    const NAME: &'static str = "surface";
}

/// The parameters of a surface.
struct Recipe {
    displacement: Displacement,
    seams: Seams,
    options: PrismOptions,
    spread: f32,
}

impl Recipe {
    fn new(desc: &prismarch_surface_desc) -> Result<Self, Failure> {
        let unknown = |what: &str, found: u32| {
            Failure::argument(format!("{what} is {found}; expected a prismarch_{what}"))
        };
        let march = match desc.march {
            c::prismarch_march_PRISMARCH_MARCH_EXACT => March::Exact,
            c::prismarch_march_PRISMARCH_MARCH_UNIFORM => March::Uniform {
                step: Step::Texels(desc.step),
                jitter: false,
            },
            other => return Err(unknown("march", other)),
        };
        let seams = match desc.seams {
            c::prismarch_seams_PRISMARCH_SEAMS_OPEN => Seams::Open,
            c::prismarch_seams_PRISMARCH_SEAMS_CLOSED => Seams::Closed,
            other => return Err(unknown("seams", other)),
        };
        let edit_bounds = match desc.edit_bounds {
            c::prismarch_edit_bounds_PRISMARCH_EDIT_BOUNDS_TIGHT => EditBounds::Tight,
            c::prismarch_edit_bounds_PRISMARCH_EDIT_BOUNDS_RANGE => EditBounds::Range,
            other => return Err(unknown("edit_bounds", other)),
        };
        let spread = desc.lod_spread;
        if !(spread.is_finite() && spread >= 0.0) {
            return Err(Failure::argument(format!(
                "lod_spread is {spread}; expected a finite number, at least 0"
            )));
        }
        Ok(Self {
            displacement: Displacement {
                midlevel: desc.midlevel,
                ..Displacement::new(desc.scale)
            },
            seams,
            options: PrismOptions {
                march,
                edit_bounds,
                lod: if spread > 0.0 { Lod::Cone } else { Lod::Off },
            },
            spread,
        })
    }

    /// What is traced of a base mesh at its time steps, of which there is one at least.
    fn traced(&self, base: &Base, map: &Map, steps: &[TimeStep]) -> Result<Traced, Failure> {
        let mesh = Arc::new(base.mesh(&steps[0])?);
        let surface = DisplacedSurface::new(mesh, map.map.clone(), self.displacement)?;
        let surface = Arc::new(surface.with_seams(self.seams));
        if steps.len() == 1 {
            let prisms = Prisms::new(surface, self.options)?;
            prisms.set_spread(self.spread);
            return Ok(Traced::Standing(prisms));
        }
        let moving = MovingSurface::new(surface, steps[1..].to_vec())?;
        Ok(Traced::Moving(MovingPrisms::new(
            Arc::new(moving),
            self.options,
        )?))
    }
}

impl Surface {
    /// # Safety
    ///
    /// The buffers of `desc` are readable.
    unsafe fn new(desc: &prismarch_surface_desc) -> Result<Self, Failure> {
        let recipe = Recipe::new(desc)?;
        let (vertices, primitives) = (desc.vertex_count as usize, desc.primitive_count as usize);
        // SAFETY: the caller's promise.
        let (map, indices, first, texcoords) = unsafe {
            let map = Handle::<Map>::retained(desc.map.cast())?;
            let null = || Failure::null("indices.data");
            let indices = match desc.primitive {
                c::prismarch_primitive_PRISMARCH_TRIANGLES => Primitives::Triangles(
                    buffer::read(&desc.indices, primitives, "indices")?.ok_or_else(null)?,
                ),
                c::prismarch_primitive_PRISMARCH_QUADS => Primitives::Quads(
                    buffer::read(&desc.indices, primitives, "indices")?.ok_or_else(null)?,
                ),
                other => {
                    return Err(Failure::argument(format!(
                        "primitive is {other}; expected a prismarch_primitive"
                    )));
                }
            };
            let first = Vertices::read(&desc.vertices, vertices)?;
            let texcoords: Vec<[f32; 2]> =
                buffer::read(&desc.texcoords, vertices, "texture coordinates")?
                    .ok_or_else(|| Failure::null("texcoords.data"))?;
            (map, indices, first, texcoords)
        };
        let base = Base::new(indices, &first.positions, &texcoords)?;
        let mut steps = vec![base.step(&first)];
        let count = desc.time_step_count as usize;
        if !(1..=MovingSurface::MAX_TIME_STEPS).contains(&count) {
            return Err(Failure::argument(format!(
                "time_step_count is {count}; expected 1 to {}",
                MovingSurface::MAX_TIME_STEPS
            )));
        }
        if count > 1 && desc.later_steps.is_null() {
            return Err(Failure::null("later_steps"));
        }
        for k in 1..count {
            // SAFETY: one less than the count are readable, and so are their buffers.
            let later = unsafe { Vertices::read(&*desc.later_steps.add(k - 1), vertices)? };
            steps.push(base.step(&later));
        }
        let traced = recipe.traced(&base, &map, &steps)?;
        let live = Arc::new(Live::new(base, traced));
        map.add(&live);
        Ok(Self {
            live,
            faults: Arc::default(),
            map,
            recipe,
            steps: Mutex::new(steps),
        })
    }

    /// # Safety
    ///
    /// The buffers of `vertices` are readable, and nothing else looks at the surface.
    unsafe fn update(&self, step: usize, vertices: &prismarch_vertices) -> Result<(), Failure> {
        let mut steps = self.steps.lock().unwrap_or_else(PoisonError::into_inner);
        if step >= steps.len() {
            return Err(Failure::argument(format!(
                "time_step is {step}; the surface has {}",
                steps.len()
            )));
        }
        let base = &self.live.base;
        // SAFETY: the caller's promise.
        let vertices = unsafe { Vertices::read(vertices, base.vertex_count())? };
        if self.live.is_traced() {
            return Err(Failure::in_flight());
        }
        let mut new = steps.clone();
        new[step] = base.step(&vertices);
        let traced = self.recipe.traced(base, &self.map, &new)?;
        // SAFETY: the caller's promise.
        unsafe { self.live.replace(traced) };
        *steps = new;
        Ok(())
    }

    /// The surface at (u, v) of the caller's primitive.
    fn interpolate(&self, prim: u32, u: f32, v: f32, time: f32) -> Result<Interpolated, Failure> {
        if !(0.0..=1.0).contains(&time) {
            return Err(Failure::argument(format!(
                "time is {time}; expected 0 to 1"
            )));
        }
        let at = self.live.base.to_triangle(prim, u, v).ok_or_else(|| {
            Failure::argument(format!("primitive {prim} has no triangle with an area"))
        })?;
        let mut found = match self.live.now() {
            Traced::Standing(_) => {
                self.live
                    .now()
                    .surface()
                    .interpolate(at.triangle, at.u, at.v)?
            }
            Traced::Moving(moving) => {
                moving
                    .surface()
                    .interpolate(at.triangle, at.u, at.v, time)?
            }
        };
        if at.is_turned {
            (found.du, found.dv) = (-found.du, -found.dv);
        }
        Ok(found)
    }
}

impl From<Interpolated> for prismarch_point {
    fn from(at: Interpolated) -> Self {
        Self {
            position: at.point.position.to_array(),
            base_position: at.point.base_position.to_array(),
            geometric_normal: at.point.geometric_normal.to_array(),
            smooth_normal: at.point.shading_normal.to_array(),
            dPdu: at.du.to_array(),
            dPdv: at.dv.to_array(),
            texcoord: at.point.texcoord.to_array(),
            displacement: at.point.displacement,
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_desc_init(
    desc: *mut prismarch_surface_desc,
) -> prismarch_status {
    // SAFETY: pointers as the header asks; all its fields may be zero.
    unsafe {
        answer(std::ptr::null_mut(), || {
            if desc.is_null() {
                return Err(Failure::null("desc"));
            }
            desc.write_bytes(0, 1);
            let desc = &mut *desc;
            desc.struct_size = size_of::<prismarch_surface_desc>();
            (desc.scale, desc.step, desc.time_step_count) = (1.0, 1.0, 1);
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_create(
    desc: *const prismarch_surface_desc,
    surface: *mut *mut c::prismarch_surface,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let out = output(surface, "surface")?;
            if desc.is_null() {
                return Err(Failure::null("desc"));
            }
            let (found, expected) = ((*desc).struct_size, size_of::<prismarch_surface_desc>());
            if found != expected {
                return Err(Failure::argument(format!(
                    "desc->struct_size is {found}; expected {expected}: call prismarch_surface_desc_init first"
                )));
            }
            let made = Handle::new(Surface::new(&*desc)?);
            *out = made.give().cast_mut().cast();
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_update_vertices(
    surface: *mut c::prismarch_surface,
    time_step: u32,
    vertices: *const prismarch_vertices,
    commit_needed: *mut bool,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let surface = Handle::<Surface>::borrow(surface.cast())?;
            let vertices = vertices.as_ref().ok_or_else(|| Failure::null("vertices"))?;
            surface.update(time_step as usize, vertices)?;
            if let Some(out) = commit_needed.as_mut() {
                *out = true;
            }
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_check(
    surface: *mut c::prismarch_surface,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let surface = Handle::<Surface>::borrow(surface.cast())?;
            Ok(surface.faults.take()?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_bytes(
    surface: *const c::prismarch_surface,
    bytes: *mut usize,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let surface = Handle::<Surface>::borrow(surface.cast())?;
            let prisms = surface.live.now().prisms();
            *output(bytes, "bytes")? = prisms.bytes() + prisms.surface().mesh().bytes();
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_retain(
    surface: *mut c::prismarch_surface,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe { Handle::<Surface>::retain(surface.cast()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_release(
    surface: *mut c::prismarch_surface,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe { Handle::<Surface>::release(surface.cast()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_interpolate(
    surface: *const c::prismarch_surface,
    prim_id: u32,
    u: f32,
    v: f32,
    time: f32,
    point: *mut prismarch_point,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe {
        answer(error, || {
            let surface = Handle::<Surface>::borrow(surface.cast())?;
            *output(point, "point")? = surface.interpolate(prim_id, u, v, time)?.into();
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_interpolate_n(
    surface: *const c::prismarch_surface,
    valid: *const i32,
    prim_ids: *const u32,
    u: *const f32,
    v: *const f32,
    n: u32,
    time: f32,
    points: *mut prismarch_point,
    error: *mut prismarch_error,
) -> prismarch_status {
    // SAFETY: pointers as the header asks: all arrays have n entries.
    unsafe {
        answer(error, || {
            let surface = Handle::<Surface>::borrow(surface.cast())?;
            let arrays = [
                (prim_ids.is_null(), "prim_ids"),
                (u.is_null(), "u"),
                (v.is_null(), "v"),
                (points.is_null(), "points"),
            ];
            if let Some((_, what)) = arrays.into_iter().find(|(is_null, _)| *is_null && n > 0) {
                return Err(Failure::null(what));
            }
            for i in 0..n as usize {
                if !valid.is_null() && *valid.add(i) != -1 {
                    continue;
                }
                let found = surface
                    .interpolate(*prim_ids.add(i), *u.add(i), *v.add(i), time)
                    .map_err(|failure| Failure {
                        message: format!("entry {i}: {}", failure.message),
                        ..failure
                    })?;
                points.add(i).write(found.into());
            }
            Ok(())
        })
    }
}
