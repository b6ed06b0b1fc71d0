//! Surfaces: `prismarch_surface_*`, `prismarch_interpolate*`.

use std::sync::{Arc, Mutex, PoisonError};

use super::base::{Base, Primitives};
use super::buffer::{Array, VertexArrays};
use super::declarations::{
    self as c, prismarch_error, prismarch_point, prismarch_status, prismarch_surface_desc,
    prismarch_vertices,
};
use super::desc;
use super::error::{Failure, answer};
use super::handle::{give, input, kept, output, release, retain, used};
use super::live::{Live, Traced};
use super::map::Map;
use crate::embree::raw::{RawOptions, Unwatched};
use crate::prism::{EditBounds, Lod, March, MovingPrisms, PrismOptions, Prisms, Step};
use crate::ray::MAX_COORDINATE;
use crate::surface::{
    DisplacedSurface, Displacement, Interpolated, MovingSurface, Seams, TimeStep,
};

/// A surface, and how to make it again when its vertices move.
pub struct Surface {
    pub live: Arc<Live>,
    /// How its geometries are made.
    pub options: RawOptions,
    map: Arc<Map>,
    recipe: Recipe,
    steps: Mutex<Vec<TimeStep>>,
    /// Of geometries whose end nobody notices: the header asks that the surface outlives them.
    unwatched: Mutex<Vec<Unwatched>>,
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
        let traced = if steps.len() == 1 {
            let prisms = Prisms::new(surface, self.options)?;
            prisms.set_spread(self.spread);
            Traced::Standing(prisms)
        } else {
            let moving = MovingSurface::new(surface, steps[1..].to_vec())?;
            Traced::Moving(MovingPrisms::new(Arc::new(moving), self.options)?)
        };
        let reach = traced.reach();
        if reach <= MAX_COORDINATE {
            Ok(traced)
        } else {
            Err(Failure::too_far(reach))
        }
    }
}

impl Surface {
    /// # Safety
    ///
    /// The buffers of `desc` are readable.
    unsafe fn new(desc: &prismarch_surface_desc) -> Result<Self, Failure> {
        let recipe = Recipe::new(desc)?;
        let map = kept::<Map, _>(desc.map)?;
        let steps = time_steps(desc)?;
        let vertices = desc.vertex_count as usize;
        let texcoords: Array<f32, 2> =
            Array::new(&desc.texcoords, vertices, "texture coordinates")?
                .ok_or_else(|| Failure::null("texcoords.data"))?;
        // SAFETY: the caller's promise.
        let (base, steps) = unsafe {
            let indices = read_primitives(desc)?;
            let first = VertexArrays::new(&desc.vertices, vertices)?.read()?;
            let base = Base::new(indices, &first.positions, &texcoords.read()?)?;
            let mut all = vec![base.step(&first)];
            drop(first);
            for k in 1..steps {
                let later = input(desc.later_steps.wrapping_add(k - 1), "later_steps")?;
                all.push(base.step(&VertexArrays::new(&later, vertices)?.read()?));
            }
            (base, all)
        };
        let traced = recipe.traced(&base, &map, &steps)?;
        let live = Arc::new(Live::new(base, traced));
        map.add(&live);
        Ok(Self {
            live,
            options: RawOptions {
                faults: Arc::default(),
                has_filter: desc.has_filter,
            },
            map,
            recipe,
            steps: Mutex::new(steps),
            unwatched: Mutex::default(),
        })
    }

    /// Keeps what belongs to a geometry until the surface goes.
    pub fn keep(&self, unwatched: Unwatched) {
        let mut all = self
            .unwatched
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        all.push(unwatched);
    }

    /// # Safety
    ///
    /// The buffers of `vertices` are readable.
    unsafe fn update(&self, step: usize, vertices: &prismarch_vertices) -> Result<(), Failure> {
        let mut steps = self.steps.lock().unwrap_or_else(PoisonError::into_inner);
        if step >= steps.len() {
            return Err(Failure::argument(format!(
                "time_step is {step}; the surface has {}",
                steps.len()
            )));
        }
        let base = &self.live.base;
        let vertices = VertexArrays::new(vertices, base.vertex_count())?;
        let watched = self.live.watch()?;
        let mut new = steps.clone();
        // SAFETY: the caller's promise.
        new[step] = base.step(&unsafe { vertices.read()? });
        let traced = self.recipe.traced(base, &self.map, &new)?;
        let old = watched.shut()?.replace(traced);
        *steps = new;
        // Rays go on while it is freed.
        drop(old);
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
        let within = self.live.enter();
        let mut found = match within.now() {
            Traced::Standing(prisms) => prisms.surface().interpolate(at.triangle, at.u, at.v)?,
            Traced::Moving(moving) => {
                let surface = moving.surface();
                surface.interpolate(at.triangle, at.u, at.v, time)?
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

/// How many time steps there are; those after the first have descriptions.
fn time_steps(desc: &prismarch_surface_desc) -> Result<usize, Failure> {
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
    Ok(count)
}

/// # Safety
///
/// The indices of `desc` are readable.
unsafe fn read_primitives(desc: &prismarch_surface_desc) -> Result<Primitives, Failure> {
    let count = desc.primitive_count;
    if count > Primitives::MOST {
        return Err(Failure::argument(format!(
            "primitive_count is {count}; expected at most {}",
            Primitives::MOST
        )));
    }
    let (count, null) = (count as usize, || Failure::null("indices.data"));
    // SAFETY: the caller's promise.
    unsafe {
        match desc.primitive {
            c::prismarch_primitive_PRISMARCH_TRIANGLES => Ok(Primitives::Triangles(
                Array::new(&desc.indices, count, "indices")?
                    .ok_or_else(null)?
                    .read()?,
            )),
            c::prismarch_primitive_PRISMARCH_QUADS => Ok(Primitives::Quads(
                Array::new(&desc.indices, count, "indices")?
                    .ok_or_else(null)?
                    .read()?,
            )),
            other => Err(Failure::argument(format!(
                "primitive is {other}; expected a prismarch_primitive"
            ))),
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_desc_init(
    desc: *mut prismarch_surface_desc,
) -> prismarch_status {
    // SAFETY: pointers as the header asks; so large it has been in all versions.
    unsafe { prismarch_surface_desc_init_sized(desc, desc::FIRST_SIZE) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_desc_init_sized(
    desc: *mut prismarch_surface_desc,
    size: usize,
) -> prismarch_status {
    // SAFETY: pointers as the header asks.
    unsafe { answer(std::ptr::null_mut(), || desc::init(desc, size)) }
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
            let desc = desc::read(desc)?;
            *out = give(Arc::new(Surface::new(&desc)?))?;
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
            let surface = kept::<Surface, _>(surface)?;
            let vertices = input(vertices, "vertices")?;
            surface.update(time_step as usize, &vertices)?;
            if !commit_needed.is_null() {
                commit_needed.write(true);
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
            let surface = used::<Surface, _>(surface)?;
            Ok(surface.options.faults.take()?)
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
            let surface = used::<Surface, _>(surface)?;
            let within = surface.live.enter();
            let prisms = within.now().prisms();
            *output(bytes, "bytes")? = prisms.bytes() + prisms.surface().mesh().bytes();
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_retain(
    surface: *mut c::prismarch_surface,
) -> prismarch_status {
    retain::<Surface, _>(surface)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn prismarch_surface_release(
    surface: *mut c::prismarch_surface,
) -> prismarch_status {
    release::<Surface, _>(surface)
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
            let surface = used::<Surface, _>(surface)?;
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
            let surface = kept::<Surface, _>(surface)?;
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
                if !valid.is_null() && valid.add(i).read_unaligned() != -1 {
                    continue;
                }
                let prim = prim_ids.add(i).read_unaligned();
                let (u, v) = (u.add(i).read_unaligned(), v.add(i).read_unaligned());
                let found = surface
                    .interpolate(prim, u, v, time)
                    .map_err(|failure| Failure {
                        message: format!("entry {i}: {}", failure.message),
                        ..failure
                    })?;
                points.add(i).write_unaligned(found.into());
            }
            Ok(())
        })
    }
}
