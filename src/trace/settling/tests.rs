use std::sync::mpsc::{Receiver, Sender, channel};

use glam::{Vec2, Vec3};

use super::*;
use crate::prism::{March, Prisms};
use crate::surface::{DisplacedSurface, Displacement, MeshBuilder, NormalMode, Texels, Wrap};
use crate::trace::{Object, Placement, Shape};

/// What it holds is how often the world had grown when it was made, or has followed.
struct Fake {
    growths: Vec<u64>,
    /// One message per tracer that is being made; it goes on when there is an answer.
    script: Arc<Mutex<Script>>,
}

struct Script {
    begun: Sender<()>,
    answers: Receiver<Answer>,
}

enum Answer {
    Make,
    Fail,
    Panic,
}

impl Tracer for Fake {
    fn intersect(&self, _: &Ray) -> Option<Hit> {
        None
    }

    fn occluded(&self, _: &Ray) -> bool {
        false
    }

    fn bounds(&self) -> Aabb {
        Aabb::EMPTY
    }

    fn bvh_bytes(&self) -> usize {
        0
    }

    fn name(&self) -> String {
        "fake".into()
    }
}

impl Follow for Fake {
    type Error = &'static str;

    fn follow(&mut self, world: &World) -> Result<bool, Self::Error> {
        let growths = world.growths();
        let has_grown = growths != self.growths;
        self.growths = growths;
        Ok(has_grown)
    }

    fn maker(&self) -> Maker<Self, Self::Error> {
        let script = self.script.clone();
        Box::new(move |world| {
            let growths = world.growths();
            let answer = {
                let script = script.lock().unwrap();
                script.begun.send(()).unwrap();
                script.answers.recv().unwrap()
            };
            match answer {
                Answer::Make => Ok(Self {
                    growths,
                    script: script.clone(),
                }),
                Answer::Fail => Err("no"),
                Answer::Panic => panic!("as the test wants it"),
            }
        })
    }
}

/// A square under a flat map, a tracer of it, and both ends of what its maker is told.
struct Stage {
    world: World,
    map: Arc<DisplacementMap>,
    begun: Receiver<()>,
    /// Goes before the tracer: nobody waits for an answer then.
    answers: Sender<Answer>,
    tracer: Settling<Fake>,
    height: u16,
}

const RECT: TexelRect = TexelRect {
    x: 3,
    y: 4,
    width: 1,
    height: 1,
};

impl Stage {
    fn new() -> Self {
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        let builder = MeshBuilder {
            positions: corners.map(|corner| corner.extend(0.0)).to_vec(),
            normals: vec![Vec3::Z; 4],
            texcoords: corners.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let mesh = Arc::new(builder.build(NormalMode::File).unwrap().0);
        let map = DisplacementMap::new(16, 16, Texels::U16(vec![0; 256]), Wrap::Clamp);
        let map = Arc::new(map.unwrap());
        let surface = DisplacedSurface::new(mesh, map.clone(), Displacement::new(0.1)).unwrap();
        let prisms = Arc::new(Prisms::new(Arc::new(surface), March::Exact).unwrap());
        let world = World::new(vec![Object {
            shape: Shape::Displaced(prisms),
            placement: Placement::World,
            mask: u32::MAX,
        }]);
        let (begins, begun) = channel();
        let (answers, answered) = channel();
        let fake = Fake {
            growths: world.growths(),
            script: Arc::new(Mutex::new(Script {
                begun: begins,
                answers: answered,
            })),
        };
        Self {
            tracer: Settling::new(fake),
            world,
            map,
            begun,
            answers,
            height: 0,
        }
    }

    /// Raises a texel: what is over it grows.
    fn grow(&mut self) -> Result<Edited, &'static str> {
        self.height += 1000;
        let texels = Texels::U16(vec![self.height]);
        self.map.update(RECT, &texels).unwrap();
        let edited = self.tracer.map_edited(&self.world, &self.map, RECT);
        self.assert_holds();
        edited
    }

    /// Rays are asked of a tracer that holds all that has grown.
    fn assert_holds(&self) {
        assert_eq!(self.tracer.tracer().growths, self.world.growths());
    }

    fn answer(&self, answer: Answer) {
        self.answers.send(answer).unwrap();
    }

    fn is_new(&self) -> bool {
        self.tracer.settled.get().is_some()
    }
}

#[test]
fn a_new_tracer_is_taken_without_another_edit() {
    let mut stage = Stage::new();
    assert!(stage.grow().unwrap().committed);
    assert!(!stage.is_new());
    stage.answer(Answer::Make);
    stage.tracer.settle();
    assert!(stage.is_new());
    stage.assert_holds();
    // Nothing to do.
    stage.tracer.settle();
    assert_eq!(stage.begun.try_iter().count(), 1);
}

#[test]
fn one_that_an_edit_overtakes_is_not_asked() {
    let mut stage = Stage::new();
    stage.grow().unwrap();
    stage.begun.recv().unwrap();
    // It is being made of what was.
    stage.grow().unwrap();
    stage.answer(Answer::Make);
    stage.begun.recv().unwrap();
    assert!(!stage.is_new());
    stage.assert_holds();
    // The next edit takes it, overtakes another, and a third one is made.
    stage.grow().unwrap();
    stage.answer(Answer::Make);
    stage.begun.recv().unwrap();
    assert!(!stage.is_new());
    stage.assert_holds();
    stage.answer(Answer::Make);
    stage.tracer.settle();
    assert!(stage.is_new());
    stage.assert_holds();
}

#[test]
fn one_that_cannot_be_made_is_told_with_the_next_edit() {
    let mut stage = Stage::new();
    stage.grow().unwrap();
    stage.begun.recv().unwrap();
    stage.grow().unwrap();
    stage.answer(Answer::Fail);
    stage.begun.recv().unwrap();
    // Another is being made where nothing came before.
    assert_eq!(stage.grow(), Err("no"));
    stage.answer(Answer::Make);
    stage.begun.recv().unwrap();
    assert!(!stage.is_new());
    stage.assert_holds();
    stage.answer(Answer::Make);
    stage.tracer.settle();
    assert!(stage.is_new() && stage.grow().is_ok());
    stage.answer(Answer::Make);
    stage.tracer.settle();
    stage.assert_holds();
}

#[test]
fn after_a_panic_it_only_follows() {
    let mut stage = Stage::new();
    stage.grow().unwrap();
    stage.answer(Answer::Panic);
    stage.tracer.settle();
    assert!(!stage.is_new());
    assert!(stage.grow().unwrap().committed);
    stage.tracer.settle();
    stage.assert_holds();
}

/// The thread ends with it, whatever is wanted.
#[test]
fn it_can_be_dropped_at_any_time() {
    drop(Stage::new());
    let mut stage = Stage::new();
    stage.grow().unwrap();
    drop(stage);
    let mut stage = Stage::new();
    stage.grow().unwrap();
    stage.begun.recv().unwrap();
    stage.answer(Answer::Make);
    drop(stage);
}
