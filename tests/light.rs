#![cfg(feature = "bvh")]
#[path = "light/scenes.rs"]
mod scenes;
use prismarch::surface::ShadingNormals;
use scenes::*;

#[test]
fn table() {
    let spp = std::env::var("SPP").map_or(64, |s| s.parse().unwrap());
    let only = std::env::var("ONLY").unwrap_or_default();
    for case in cases() {
        if !case.name.contains(&only) {
            continue;
        }
        let sky = mean(&case, &[], ShadingNormals::Geometric, &chalk(0.0), spp);
        for (light, lights) in lights() {
            let back = if lights.is_empty() { sky } else { 0.0 };
            let of = |n| (mean(&case, &lights, n, &chalk(0.8), spp) - back) / (1.0 - sky);
            let truth = of(ShadingNormals::Geometric);
            let [s] = [ShadingNormals::Smooth].map(|n| 100.0 * (of(n) / truth - 1.0));
            println!(
                "{:28} {light:12} truth {truth:.4} smooth {s:+.2}",
                case.name
            );
        }
    }
}
