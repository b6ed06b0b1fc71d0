//! What a backend traces of the exact march, and the hit test of one primitive.
//!
//! Primitives are, in this order: blocks of texels; base triangles that have none ([`Whole`]), each at once; and the walls of base triangles where seams are
//! closed.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::{DVec2, Vec3};

use super::block::{Ask, Block, Crossing, Cutter, Heights, LEAF, Outline, Record, nearest};
use super::judge::{Cells, Found, Question, walls, within};
use super::march::polish::Root;
use super::ray_frame::{RayFrame, axes};
use super::room::{self, EditBounds};
use super::simd::{Lanes, Task};
use super::touch::{NOWHERE, Touch, TouchIndex, around, union};
use super::{MarchError, Parts, PrismHit, Prisms};
use crate::ray::{Aabb, Ray};
use crate::surface::{Corners, DisplacedSurface, DisplacementMap, Patch, TexelBox};

/// The primitives of a surface.
pub struct ExactPrisms {
    /// By base triangle.
    records: Vec<Record>,
    /// By base triangle, then by place.
    blocks: Vec<Block>,
    /// Base triangles without blocks, ascending.
    wholes: Vec<u32>,
    /// Base triangles with walls, ascending.
    walled: Vec<u32>,
    /// By primitive.
    boxes: Vec<StoredBox>,
    /// Those whose texels were edited since their boxes were tight; held by who changes boxes.
    touched: Mutex<Vec<u32>>,
    outline: Outline,
    /// What texels mean, when the prisms were made; and bits of the largest |D| since.
    heights: Heights,
    most: AtomicU32,
    /// Where primitives read the map.
    pub index: TouchIndex,
}

/// What a primitive is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primitive {
    Block(Block),
    /// All of a base triangle.
    Whole(u32),
    /// The walls of a base triangle.
    Walls(u32),
}

impl Primitive {
    pub fn triangle(self) -> u32 {
        match self {
            Self::Block(block) => block.triangle,
            Self::Whole(triangle) | Self::Walls(triangle) => triangle,
        }
    }
}

/// Bits of a box that edits widen in place.
struct StoredBox([AtomicU32; 6]);

impl StoredBox {
    fn new(bounds: Aabb) -> Self {
        let ([x0, y0, z0], [x1, y1, z1]) = (bounds.min.to_array(), bounds.max.to_array());
        Self([x0, y0, z0, x1, y1, z1].map(|x| AtomicU32::new(x.to_bits())))
    }

    fn get(&self) -> Aabb {
        let at = |k: usize| f32::from_bits(self.0[k].load(Ordering::Relaxed));
        Aabb {
            min: Vec3::new(at(0), at(1), at(2)),
            max: Vec3::new(at(3), at(4), at(5)),
        }
    }

    /// Whether it held `wanted`, which it is from now on.
    fn shrink(&self, wanted: Aabb) -> bool {
        let held = self.get();
        let holds = held.union(wanted) == held;
        if holds {
            for (stored, new) in self.0.iter().zip(Self::new(wanted).0) {
                stored.store(new.into_inner(), Ordering::Relaxed);
            }
        }
        holds
    }

    /// Whether it did not hold `wanted`.
    fn widen(&self, wanted: Aabb) -> bool {
        let mut grown = false;
        for axis in 0..3 {
            let ends = [&self.0[axis], &self.0[axis + 3]];
            grown |= room::widen(ends, [wanted.min[axis], wanted.max[axis]]);
        }
        grown
    }
}

impl ExactPrisms {
    /// The most primitives that a backend can number.
    const MOST: usize = u32::MAX as usize;

    /// `outline` makes the boxes of blocks.
    ///
    /// # Errors
    ///
    /// More primitives than [`Self::MOST`].
    pub fn new(
        surface: &DisplacedSurface,
        bounds: EditBounds,
        outline: Outline,
    ) -> Result<Self, MarchError> {
        Self::limited(surface, bounds, outline, Self::MOST)
    }

    fn limited(
        surface: &DisplacedSurface,
        bounds: EditBounds,
        outline: Outline,
        max: usize,
    ) -> Result<Self, MarchError> {
        let count = surface.mesh().triangles().len() as u32;
        let cutter = Cutter::new(surface.map());
        let room = bounds.room(surface.map());
        let mut made = Self {
            records: Vec::with_capacity(count as usize),
            blocks: Vec::new(),
            wholes: Vec::new(),
            walled: Vec::new(),
            boxes: Vec::new(),
            touched: Mutex::default(),
            outline,
            heights: Heights::new(surface),
            most: AtomicU32::new(0),
            index: TouchIndex::new(0, |_| NOWHERE),
        };
        made.take_heights(surface, room);
        for triangle in 0..count {
            let patch = surface.patch(triangle);
            let offsets = bounds.offsets(surface, triangle);
            let first = made.blocks.len();
            let cut = cutter.cut(triangle, &patch, offsets, |block| made.blocks.push(block));
            let record = cut.unwrap_or_else(|_| {
                made.wholes.push(triangle);
                Record::without_blocks(offsets)
            });
            // Blocks of which no leaf reaches the triangle are none.
            let mut kept = first;
            for index in first..made.blocks.len() {
                let block = made.blocks[index];
                let bounds = (made.outline)(surface, &record, block, room);
                if bounds.is_valid() {
                    made.blocks[kept] = block;
                    made.boxes.push(StoredBox::new(bounds));
                    kept += 1;
                }
            }
            made.blocks.truncate(kept);
            made.records.push(record);
            if !surface.walls_of(triangle).is_empty() {
                made.walled.push(triangle);
            }
            if made.len() > max {
                return Err(MarchError::TooManyPrimitives { max });
            }
        }
        for primitive in made.boxes.len()..made.len() {
            let bounds = made.bounds_now(surface, room, primitive as u32);
            made.boxes.push(StoredBox::new(bounds));
        }
        made.index = TouchIndex::new(made.len(), |primitive| made.reads(surface, primitive));
        Ok(made)
    }

    /// What texels mean.
    #[inline(always)]
    pub fn heights(&self) -> Heights {
        Heights {
            most: f32::from_bits(self.most.load(Ordering::Relaxed)),
            ..self.heights
        }
    }

    /// Takes note of what heights the map has by now.
    pub fn take_heights(&self, surface: &DisplacedSurface, room: Option<(f32, f32)>) {
        let heights = Heights::new(surface).with_room(room, surface.map().unit());
        // Bits of positive floats are in their order.
        self.most
            .fetch_max(heights.most.to_bits(), Ordering::Relaxed);
    }

    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.blocks.len() + self.wholes.len() + self.walled.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.records[..])
            + size_of_val(&self.blocks[..])
            + size_of_val(&self.wholes[..])
            + size_of_val(&self.walled[..])
            + size_of_val(&self.boxes[..])
            + self.index.bytes()
    }

    /// # Panics
    ///
    /// If there is no such primitive.
    #[inline(always)]
    pub fn primitive(&self, index: u32) -> Primitive {
        let index = index as usize;
        if let Some(&block) = self.blocks.get(index) {
            return Primitive::Block(block);
        }
        let index = index - self.blocks.len();
        match self.wholes.get(index) {
            Some(&triangle) => Primitive::Whole(triangle),
            None => Primitive::Walls(self.walled[index - self.wholes.len()]),
        }
    }

    /// A primitive's base triangle, and the part of it that it is; nothing of it for walls.
    pub fn part(&self, map: &DisplacementMap, index: u32) -> (u32, TexelBox) {
        let primitive = self.primitive(index);
        let triangle = primitive.triangle();
        let texels = match primitive {
            Primitive::Block(block) => block.texels(map, self.record(triangle)),
            Primitive::Whole(_) => TexelBox::EVERYWHERE,
            Primitive::Walls(_) => NOWHERE,
        };
        (triangle, texels)
    }

    pub fn record(&self, triangle: u32) -> &Record {
        &self.records[triangle as usize]
    }

    /// Bounds of what a primitive holds of the surface, with room for edits.
    pub fn bounds(&self, index: u32) -> Aabb {
        self.boxes[index as usize].get()
    }

    /// The same for the map as it is.
    fn bounds_now(&self, surface: &DisplacedSurface, room: Option<(f32, f32)>, index: u32) -> Aabb {
        let primitive = self.primitive(index);
        let record = self.record(primitive.triangle());
        let patch = surface.patch(primitive.triangle());
        match primitive {
            Primitive::Block(block) => (self.outline)(surface, record, block, room),
            Primitive::Whole(_) => patch.hull([0, 1, 2], record.offsets()),
            Primitive::Walls(triangle) => {
                let walls = surface.walls_of(triangle).iter();
                walls.fold(Aabb::EMPTY, |bounds, wall| {
                    let side = usize::from(wall.side);
                    let corners = [(side + 1) % 3, (side + 2) % 3];
                    bounds.union(patch.hull(corners, record.offsets()))
                })
            }
        }
    }

    /// Takes the bounds of some primitives again after an edit; those that have grown.
    pub fn widen(
        &self,
        surface: &DisplacedSurface,
        room: Option<(f32, f32)>,
        primitives: impl Iterator<Item = u32>,
    ) -> Vec<u32> {
        let mut touched = self.touched();
        // Not more than there are, however long nobody tightens them.
        if touched.len() > self.boxes.len() {
            touched.sort_unstable();
            touched.dedup();
        }
        let grow = |&index: &u32| {
            touched.push(index);
            let bounds = self.bounds_now(surface, room, index);
            bounds.is_valid() && self.boxes[index as usize].widen(bounds)
        };
        primitives.filter(grow).collect()
    }

    fn touched(&self) -> MutexGuard<'_, Vec<u32>> {
        self.touched.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the bounds of what edits have touched anew, without what they were.
    pub fn tighten(&self, surface: &DisplacedSurface, room: Option<(f32, f32)>) {
        // Few at a time: edits wait meanwhile.
        const PORTION: usize = 32;
        let mut all = std::mem::take(&mut *self.touched());
        all.sort_unstable();
        all.dedup();
        for portion in all.chunks(PORTION) {
            let mut touched = self.touched();
            for &index in portion {
                let bounds = self.bounds_now(surface, room, index);
                // What has texels by now that nobody was told of grows when that is told, and not in silence.
                if bounds.is_valid() && !self.boxes[index as usize].shrink(bounds) {
                    touched.push(index);
                }
            }
        }
    }

    /// Where a primitive reads the map, in texel coordinates; of walls, where they do beyond their triangle.
    fn reads(&self, surface: &DisplacedSurface, index: u32) -> TexelBox {
        match self.primitive(index) {
            Primitive::Block(block) => {
                let leaf = DVec2::from(LEAF.map(f64::from));
                let TexelBox { low, high } =
                    block.texels(surface.map(), self.record(block.triangle));
                TexelBox {
                    low,
                    // Leaves are whole.
                    high: low + ((high - low) / leaf).ceil() * leaf,
                }
            }
            Primitive::Whole(triangle) => around(surface.patch(triangle).texels),
            Primitive::Walls(triangle) => {
                let others = surface.walls_of(triangle).iter();
                let others = others.filter_map(|wall| surface.other_texels(wall));
                others.fold(NOWHERE, |all, edge| union(&all, &around(edge)))
            }
        }
    }

    /// The primitives that may read a rectangle of texels, ascending; walls, where they may beyond their triangle.
    pub fn touched_by(&self, surface: &DisplacedSurface, touch: &Touch) -> Vec<u32> {
        let candidates = self.index.candidates(touch);
        let touched = candidates.filter(|&index| !touch.misses(&self.reads(surface, index)));
        touched.collect()
    }

    /// The blocks of a base triangle.
    fn blocks_of(&self, triangle: u32) -> Range<u32> {
        let first = self
            .blocks
            .partition_point(|block| block.triangle < triangle);
        let after = self.blocks[first..].partition_point(|block| block.triangle == triangle);
        first as u32..(first + after) as u32
    }

    /// The primitives of a base triangle that are no blocks.
    pub fn others_of(&self, triangle: u32) -> impl Iterator<Item = u32> + use<> {
        let within = |all: &[u32], before: usize| {
            let found = all.binary_search(&triangle);
            found.ok().map(|index| (before + index) as u32)
        };
        let whole = within(&self.wholes, self.blocks.len());
        let walls = within(&self.walled, self.blocks.len() + self.wholes.len());
        whole.into_iter().chain(walls)
    }

    /// The primitives of a base triangle.
    pub fn primitives_of(&self, triangle: u32) -> impl Iterator<Item = u32> + use<> {
        self.blocks_of(triangle).chain(self.others_of(triangle))
    }
}

/// A primitive, and where its triangle's corners are, if not where the mesh has them.
pub struct Asked<'a> {
    pub prisms: &'a Prisms,
    pub primitive: u32,
    pub corners: Option<&'a Corners>,
}

impl<'a> Asked<'a> {
    fn patch(&self, triangle: u32) -> Patch<'a> {
        let surface = &self.prisms.surface;
        match self.corners {
            Some(&corners) => surface.patch_over(triangle, corners),
            None => surface.patch(triangle),
        }
    }

    /// The range of w over a triangle that is `patch` now.
    fn range(&self, record: &Record, patch: &Patch<'_>) -> [f64; 2] {
        let offsets = match self.corners {
            Some(_) => {
                let standing = self
                    .prisms
                    .surface
                    .patch(self.prisms.part(self.primitive).0);
                patch.offsets_of(standing.displacements_of(record.offsets()))
            }
            None => record.offsets(),
        };
        offsets.map(f64::from)
    }
}

/// The first hit on a primitive.
#[inline(always)]
pub fn intersect<L: Lanes>(asked: &Asked<'_>, ray: &Ray, out: &mut PrismHit) -> bool {
    let Parts::Exact(exact) = &asked.prisms.parts else {
        return false;
    };
    let primitive = exact.primitive(asked.primitive);
    let crossing = match primitive {
        Primitive::Block(block) => first_in_block::<L>(asked, exact, block, ray, false),
        Primitive::Whole(_) | Primitive::Walls(_) => {
            return out.put(L::outline(Others {
                asked,
                exact,
                primitive,
                ray,
                any: false,
            }));
        }
    };
    let Some(crossing) = crossing else {
        return false;
    };
    *out = L::outline(Hit {
        asked,
        triangle: primitive.triangle(),
        crossing,
    });
    true
}

/// Whether a primitive is hit at all.
#[inline(always)]
pub fn occluded<L: Lanes>(asked: &Asked<'_>, ray: &Ray) -> bool {
    let Parts::Exact(exact) = &asked.prisms.parts else {
        return false;
    };
    let primitive = exact.primitive(asked.primitive);
    match primitive {
        Primitive::Block(block) => first_in_block::<L>(asked, exact, block, ray, true).is_some(),
        Primitive::Whole(_) | Primitive::Walls(_) => L::outline(Others {
            asked,
            exact,
            primitive,
            ray,
            any: true,
        })
        .is_some(),
    }
}

#[inline(always)]
fn first_in_block<L: Lanes>(
    asked: &Asked<'_>,
    exact: &ExactPrisms,
    block: Block,
    ray: &Ray,
    any: bool,
) -> Option<Crossing> {
    // Backends ask about more than the boxes that a ray meets, each about others.
    if L::COUNTED && exact.bounds(asked.primitive).entry(ray).is_none() {
        return None;
    }
    let record = exact.record(block.triangle);
    let moved;
    let record = match asked.corners {
        None => record,
        Some(_) => {
            let patch = asked.patch(block.triangle);
            let range = asked.range(record, &patch).map(|w| w as f32);
            moved = Record::new(&patch, record.corner(), range);
            &moved
        }
    };
    let ask = Ask {
        surface: &asked.prisms.surface,
        heights: exact.heights(),
        record,
        block,
        corners: asked.corners,
        any,
    };
    nearest::<L>(&ask, ray)
}

/// What is not a block.
struct Others<'s, 'a> {
    asked: &'s Asked<'a>,
    exact: &'s ExactPrisms,
    primitive: Primitive,
    ray: &'s Ray,
    any: bool,
}

impl<L: Lanes> Task<L> for Others<'_, '_> {
    type Output = Option<PrismHit>;

    #[inline(always)]
    fn run(self) -> Option<PrismHit> {
        let Self { asked, ray, .. } = self;
        let triangle = self.primitive.triangle();
        let patch = asked.patch(triangle);
        let frame = RayFrame::new(ray, axes(ray));
        let question = Question {
            patch: &patch,
            range: asked.range(self.exact.record(triangle), &patch),
            frame: &frame,
            interval: [ray.tnear, ray.tfar],
            any: self.any,
        };
        if let Primitive::Walls(_) = self.primitive {
            let surface = &asked.prisms.surface;
            let sides = surface.walls_of(triangle).iter();
            let sides = sides.fold(0, |bits, wall| bits | 1 << wall.side);
            return walls::<L>(&question, surface, triangle, sides);
        }
        let at = within::<L>(&question, &Cells::ALL)?;
        Some(hit(&patch, triangle, &Crossing { at, ng: None }))
    }
}

struct Hit<'s, 'a> {
    asked: &'s Asked<'a>,
    triangle: u32,
    crossing: Crossing,
}

impl<L: Lanes> Task<L> for Hit<'_, '_> {
    type Output = PrismHit;

    #[inline(always)]
    fn run(self) -> PrismHit {
        let Self {
            asked,
            triangle,
            crossing,
        } = self;
        // Most crossings come with their normals.
        match crossing.root().map(|root| root.to_hit(triangle)) {
            Some(hit) if hit.ng != Vec3::ZERO => hit,
            _ => hit(&asked.patch(triangle), triangle, &crossing),
        }
    }
}

/// The hit on S at a crossing.
#[inline(always)]
pub fn hit(patch: &Patch<'_>, triangle: u32, crossing: &Crossing) -> PrismHit {
    let Found { t, u, v } = crossing.at;
    let root = crossing.root().unwrap_or_else(|| Root {
        t,
        u,
        v,
        ng: patch.point(u, v).ng,
    });
    let mut hit = root.to_hit(triangle);
    if hit.ng == Vec3::ZERO {
        hit.ng = normal_without_surface(patch);
    }
    hit
}

/// What stands for the normal where opposed vertex normals cancel, or the surface shrinks to a line: the base triangle's, and a
/// vertex normal where that has no area.
#[cold]
fn normal_without_surface(patch: &Patch<'_>) -> Vec3 {
    let face = patch.face_normal();
    if face.is_finite() {
        face
    } else {
        patch.normals[0]
    }
    .as_vec3()
}

#[cfg(test)]
mod tests;
