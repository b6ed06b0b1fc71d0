//! One number for all of a scene that a picture shows.

use std::fmt::{self, Write};

use glam::Affine3A;
use twox_hash::xxhash3_128::Hasher;

use super::{ObjectShape, Scene, SceneObject};
use crate::surface::{BaseMesh, DisplacedSurface, DisplacementMap};

impl Scene {
    /// 32 hexadecimal digits that differ, for all practical purposes, for scenes that look different: camera, meshes, maps,
    /// how they are traced, materials, pictures and lights. The film, the names of files and what else no ray sees are left out.
    pub fn fingerprint(&self) -> String {
        // Named one by one: who adds a field decides here whether it is seen.
        let Self {
            path: _,
            camera,
            film: _,
            objects,
            materials,
            lights,
            integrator,
        } = self;
        let mut digest = Digest(Hasher::new());
        digest.debug(camera);
        for object in objects {
            digest.object(object);
        }
        digest.debug(materials);
        digest.debug(integrator);
        digest.debug(lights);
        format!("{:032x}", digest.0.finish_128())
    }
}

/// A running hash. Small things go in as their `Debug` text, which tells every field and every digit of a float; pictures
/// show a fingerprint of their own there.
struct Digest(Hasher);

impl Write for Digest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

impl Digest {
    fn debug(&mut self, value: &dyn fmt::Debug) {
        // Hashing does not fail.
        let _ = write!(self, "{value:?};");
    }

    fn object(&mut self, object: &SceneObject) {
        let SceneObject {
            name,
            shape,
            instances,
            mask,
            material,
        } = object;
        self.debug(&(name, mask, material));
        match shape {
            ObjectShape::Displaced(surface, options) => {
                self.surface(surface);
                self.debug(options);
            }
            ObjectShape::Plain(mesh) => self.mesh(mesh),
        }
        self.debug(
            &instances
                .iter()
                .map(Affine3A::to_cols_array)
                .collect::<Vec<_>>(),
        );
    }

    fn surface(&mut self, surface: &DisplacedSurface) {
        self.mesh(surface.mesh());
        self.map(surface.map());
        self.debug(&surface.shading_normals());
        self.debug(surface.displacement());
        self.debug(&surface.seams());
    }

    fn mesh(&mut self, mesh: &BaseMesh) {
        let arrays: [&[u8]; 4] = [
            bytemuck::cast_slice(mesh.positions()),
            bytemuck::cast_slice(mesh.normals()),
            bytemuck::cast_slice(mesh.texcoords()),
            bytemuck::cast_slice(mesh.triangles()),
        ];
        for bytes in arrays {
            self.debug(&bytes.len());
            self.0.write(bytes);
        }
    }

    fn map(&mut self, map: &DisplacementMap) {
        let (width, height) = map.size();
        self.debug(&(width, height, map.kind(), map.wrap()));
        let mut row = vec![0.0_f32; width];
        for y in 0..height {
            map.texels().copy(y * map.stride(), &mut row);
            self.0.write(bytemuck::cast_slice(&row));
        }
    }
}
