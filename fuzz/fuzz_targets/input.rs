//! Meshes, maps and rays from bytes. What the bytes do not say is zero.

use glam::{Affine3A, EulerRot, Quat, Vec2, Vec3};
use prismarch::prism::{EditBounds, Lod, March, PrismOptions, Step};
use prismarch::ray::{Ray, RayPacket};
use prismarch::surface::{Displacement, MeshBuilder, TexelRect, Texels, UvTransform, Wrap};
use prismarch::trace::Placement;

pub struct Input<'b>(pub &'b [u8]);

impl Input<'_> {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        let (&first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        first
    }

    fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    fn bits(&mut self) -> u32 {
        u32::from(self.word()) | u32::from(self.word()) << 16
    }

    /// Mostly a number near 1, now and then one of the odd ones, or any bits.
    pub fn number(&mut self) -> f32 {
        const ODD: [f32; 20] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            1e-45,
            -1e-39,
            f32::MIN_POSITIVE,
            f32::EPSILON,
            16_777_216.0,
            1e15,
            -1e-19,
            1.8e18,
            -1.844e18,
            -1e19,
            1e30,
            f32::MAX,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
        ];
        match self.byte() {
            tag @ 0..=31 => ODD[usize::from(tag) % ODD.len()],
            32..=47 => f32::from_bits(self.bits()),
            48..=79 => f32::from(self.byte() as i8) * 0.0625,
            80..=95 => f32::from(self.word() as i16) * 1e3,
            96..=111 => f32::from(self.word() as i16) * 1e-9,
            _ => f32::from(self.word() as i16) / 8192.0,
        }
    }

    /// Mostly finite, so that something is accepted.
    fn finite(&mut self) -> f32 {
        let number = self.number();
        if number.is_finite() || self.byte() == 255 {
            number
        } else {
            0.25
        }
    }

    /// Texture coordinates: a surface over 10^15 texels is traced for hours, and no fault is in that. Every primitive is asked about every ray here,
    /// and a triangle of 16 000 texels has tens of thousands.
    fn vec2(&mut self) -> Vec2 {
        const REACH: f32 = 1e2;
        Vec2::new(self.finite(), self.finite()).clamp(Vec2::splat(-REACH), Vec2::splat(REACH))
    }

    fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.finite(), self.finite(), self.finite())
    }

    /// 1 to 8 triangles over 3 to 10 vertices.
    pub fn mesh(&mut self) -> MeshBuilder {
        let triangles = 1 + self.byte() % 8;
        let vertices = 3 + self.byte() % 8;
        let has_normals = self.byte() % 4 > 0;
        let mut builder = MeshBuilder::default();
        for _ in 0..vertices {
            builder.positions.push(self.vec3());
            builder.texcoords.push(self.vec2());
            if has_normals {
                builder.normals.push(self.vec3());
            }
        }
        for _ in 0..triangles {
            let corner = [0; 3].map(|_| u32::from(self.byte() % vertices));
            builder.triangles.push(corner);
        }
        builder
    }

    /// Texels along a side of a map.
    pub fn side(&mut self) -> usize {
        1 + usize::from(self.byte() % 16)
    }

    pub fn wrap(&mut self) -> Wrap {
        [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][usize::from(self.byte() % 3)]
    }

    pub fn texels(&mut self, kind: u8, count: usize) -> Texels {
        let indices = 0..count;
        match kind % 3 {
            0 => Texels::U8(indices.map(|_| self.byte()).collect()),
            1 => Texels::U16(indices.map(|_| self.word()).collect()),
            _ => Texels::F32(indices.map(|_| self.finite()).collect()),
        }
    }

    pub fn displacement(&mut self) -> Displacement {
        let uv = match self.byte() % 4 {
            0 => UvTransform {
                scale: self.vec2(),
                rotation: self.finite(),
                offset: self.vec2(),
            },
            _ => UvTransform::default(),
        };
        Displacement {
            scale: self.finite(),
            midlevel: self.finite(),
            uv,
        }
    }

    pub fn options(&mut self) -> PrismOptions {
        let march = match self.byte() % 8 {
            // Tiny steps take long, and are meant to.
            0 => March::Uniform {
                step: Step::Texels(self.number().max(0.25)),
                jitter: self.byte() % 2 == 1,
            },
            _ => March::Exact,
        };
        let edit_bounds = [EditBounds::Tight, EditBounds::Range][usize::from(self.byte() % 2)];
        PrismOptions {
            march,
            edit_bounds,
            lod: [Lod::Off, Lod::Cone][usize::from(march == March::Exact && self.byte() % 2 == 1)],
        }
    }

    /// How fast cones grow: from a thousandth of a degree to half a sphere.
    pub fn spread(&mut self) -> f32 {
        3.0 * 10f32.powi(-i32::from(self.byte() % 6))
    }

    /// In the world as it is, or through instances.
    pub fn placement(&mut self) -> Placement {
        match self.byte() % 8 {
            0 => Placement::Instances(vec![Affine3A::IDENTITY, self.transform()]),
            1 => Placement::Instances(vec![self.transform()]),
            _ => Placement::World,
        }
    }

    fn transform(&mut self) -> Affine3A {
        let (scale, turn, translation) = (self.vec3(), self.vec3(), self.vec3());
        let turn = Quat::from_euler(EulerRot::XYZ, turn.x, turn.y, turn.z);
        Affine3A::from_scale_rotation_translation(scale, turn, translation)
    }

    pub fn ray(&mut self) -> Ray {
        let mut ray = Ray::new(self.vec3(), self.vec3());
        match self.byte() % 4 {
            0 => (ray.tnear, ray.tfar) = (self.number(), self.number()),
            1 => ray.tnear = self.number(),
            // Aimed at where things are.
            2 => ray.direction -= ray.origin,
            _ => {}
        }
        ray.key = u32::from(self.byte());
        ray
    }

    /// Rays around one, with some that go elsewhere.
    pub fn beam(&mut self, ray: &Ray) -> [Ray; RayPacket::LANES] {
        let spread = 10f32.powi(-i32::from(self.byte() % 8));
        let mut beam = [*ray; RayPacket::LANES];
        for ray in &mut beam[1..] {
            let mut part = || f32::from(self.byte().cast_signed()) / 128.0 * spread;
            let [x, y, z] = [part(), part(), part()];
            ray.direction += ray.direction.length() * Vec3::new(x, y, z);
            ray.origin += Vec3::new(y, z, x) * ray.origin.length();
        }
        beam
    }

    /// A rectangle inside a map.
    pub fn rect(&mut self, width: usize, height: usize) -> TexelRect {
        let mut along = |n: usize| {
            let first = usize::from(self.byte()) % n;
            (first, 1 + usize::from(self.byte()) % (n - first))
        };
        let ((x, width), (y, height)) = (along(width), along(height));
        TexelRect {
            x,
            y,
            width,
            height,
        }
    }
}
