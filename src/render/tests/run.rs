//! Runs that share tables.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

/// Counts how often it is asked where light may come from.
struct Asked<'a> {
    shapes: &'a Shapes,
    times: AtomicUsize,
}

impl Surfaces for Asked<'_> {
    fn point(&self, hit: &Hit) -> SurfacePoint {
        self.shapes.point(hit)
    }

    fn object(&self, hit: &Hit) -> usize {
        self.shapes.object(hit)
    }

    fn placed(&self) -> Vec<PlacedObject> {
        self.times.fetch_add(1, Ordering::Relaxed);
        self.shapes.placed()
    }

    fn area_element(&self, hit: &Hit) -> Option<f32> {
        self.shapes.area_element(hit)
    }

    fn tangents(&self, hit: &Hit) -> Option<[Vec3; 2]> {
        self.shapes.tangents(hit)
    }
}

#[test]
fn tables_are_made_once_for_any_number_of_runs() {
    let scene = Setup::new(true, material(0.3, 0.3, 0.5), vec![uniform_environment()]);
    let surfaces = Asked {
        shapes: &scene.shapes,
        times: AtomicUsize::new(0),
    };
    let input = RenderInput {
        surfaces: &surfaces,
        ..scene.input()
    };
    let tables = Tables::new(&input);
    let mut frame = Frame::new(&scene.film, 0..4, Objects::new(["plane", "sphere"]));
    let mut plan = Plan::new(&frame, true, None);
    let mut runs = 0;
    while !plan.is_done() {
        let left = AtomicUsize::new(1001);
        let control = Control {
            stop: &|| left.fetch_sub(1, Ordering::Relaxed) < 2,
            ..Control::default()
        };
        run(&input, &tables, &mut frame, &mut plan, control);
        runs += 1;
    }
    assert!(runs > 3);
    assert_eq!(surfaces.times.into_inner(), 1);
    assert!(frame == scene.frame(0..4));
    assert_eq!((plan.done, plan.total), (45 * 30 * 4, 45 * 30 * 4));
}
