//! A table of hits: one CSV row per ray, numbers in the fewest digits that read back to the same f32.

use std::io::Write;

use glam::Vec3;

use crate::ray::{Cone, Ray};
use crate::trace::{Hit, World};

/// The columns. `mesh` counts the objects of the scene, `prim` the triangles of that mesh, both from 0; walls of closed
/// seams come after the triangles.
pub const HEADER: &str = "hit,t,mesh,prim,u,v,px,py,pz,ngx,ngy,ngz,nsx,nsy,nsz,displacement\n";

/// A ray that hits nothing: zeros throughout.
const MISS: &[u8] = b"0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n";

/// Appends the row of a ray that hits nothing.
pub fn append_miss(rows: &mut Vec<u8>) {
    rows.extend_from_slice(MISS);
}

/// Appends the row of one hit of `ray`, as its cone sees it. Points and normals are in world space, normals of unit length.
pub fn append(rows: &mut Vec<u8>, world: &World, hit: &Hit, ray: &Ray, cone: &Cone) {
    let mesh = world.resolve(hit).object;
    let point = world.seen_point(hit, ray, cone);
    let (t, u, v, d) = (hit.t, hit.u, hit.v, point.displacement);
    let prim = hit.prim;
    let [p, ng, ns] = [point.position, point.geometric_normal, point.shading_normal].map(Triple);
    // Writing to memory does not fail.
    let _ = writeln!(
        rows,
        "1,{t:?},{mesh},{prim},{u:?},{v:?},{p},{ng},{ns},{d:?}"
    );
}

/// Three numbers with commas between. `{:?}` of f32 is the shortest text that reads back, with an exponent
/// where that is shorter.
struct Triple(Vec3);

impl std::fmt::Display for Triple {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Vec3 { x, y, z } = self.0;
        write!(f, "{x:?},{y:?},{z:?}")
    }
}
