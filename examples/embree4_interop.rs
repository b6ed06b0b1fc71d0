//! A displaced square in a pipeline that uses the crate embree4-sys for everything else:
//! `cargo run --example embree4_interop --features embree4-sys` (needs Embree 4).

#![allow(unsafe_code)] // Embree's own calls

use std::error::Error;
use std::sync::Arc;

use embree4_sys::{
    RTC_INVALID_GEOMETRY_ID, RTCRayHit, rtcCommitScene, rtcIntersect1, rtcNewDevice, rtcNewScene,
    rtcReleaseDevice, rtcReleaseScene,
};
use glam::{Vec2, Vec3};
use prismarch::embree::raw::RawGeometry;
use prismarch::prism::{March, PrismHit, Prisms};
use prismarch::ray::Ray;
use prismarch::surface::{
    DisplacedSurface, Displacement, DisplacementMap, MeshBuilder, NormalMode, Texels, Wrap,
};

fn main() -> Result<(), Box<dyn Error>> {
    // SAFETY: Embree's own calls, in the order that it asks for; handles live until they are released below.
    let (device, scene) = unsafe {
        let device = rtcNewDevice(std::ptr::null());
        (device, rtcNewScene(device))
    };
    let prisms = Arc::new(Prisms::new(square()?, March::Exact)?);
    // SAFETY: both are live, of the Embree that is linked; the scene is not traced now.
    let id = unsafe { RawGeometry::on_device(device, prisms.clone())?.attach_to(scene)? };
    // SAFETY: as above.
    unsafe { rtcCommitScene(scene) };

    for k in 0..5 {
        let x = 0.1 + 0.2 * k as f32;
        let ray = Ray::new(Vec3::new(x, 0.5, 1.0), -Vec3::Z);
        // SAFETY: any bits are such a struct.
        let mut query: RTCRayHit = unsafe { std::mem::zeroed() };
        query.ray = (&ray).into();
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        // SAFETY: a committed scene, and a ray of the alignment that the type has.
        unsafe { rtcIntersect1(scene, &mut query, std::ptr::null_mut()) };
        let hit = PrismHit::from_rtc(&query).ok_or("the ray missed")?;
        assert_eq!(query.hit.geomID, id);
        let at = prisms.surface().interpolate(hit.prim, hit.u, hit.v)?;
        println!(
            "x = {x:.1}: t = {:.4}, displacement {:.4}",
            hit.t, at.point.displacement
        );
        assert!((1.0 - hit.t - at.point.displacement).abs() < 1e-6);
    }
    // SAFETY: the references that were taken above.
    unsafe {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
    Ok(())
}

/// A unit square with a wave.
fn square() -> Result<Arc<DisplacedSurface>, Box<dyn Error>> {
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let (mesh, _) = MeshBuilder {
        positions: corners.map(|p| p.extend(0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        texcoords: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
    .build(NormalMode::File)?;
    let wave = |i: usize| 0.5 + 0.5 * (0.4 * (i % 64) as f32).sin();
    let texels = Texels::F32((0..64 * 64).map(wave).collect());
    let map = DisplacementMap::new(64, 64, texels, Wrap::Repeat)?;
    let surface = DisplacedSurface::new(Arc::new(mesh), Arc::new(map), Displacement::new(0.2))?;
    Ok(Arc::new(surface))
}
