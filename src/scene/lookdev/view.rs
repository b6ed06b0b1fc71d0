//! From where a mesh is looked at, and from how far.

use glam::Vec3;

use crate::ray::Aabb;
use crate::scene::ObjectShape;
use crate::scene::SceneObject;

/// A side that a mesh is looked at from; +Y is up, and +Z in front.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// From the right front, a little above; a sheet from the side that it faces.
    #[default]
    ThreeQuarter,
    /// From +Z.
    Front,
    /// From -Z.
    Back,
    /// From +X.
    Right,
    /// From -X.
    Left,
    /// From +Y.
    Top,
    /// From -Y.
    Bottom,
}

/// Where the eye is, seen from the middle; degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bearing {
    /// From +Z towards +X, as of suns.
    pub azimuth: f32,
    /// Above the horizon, from -90 to 90.
    pub elevation: f32,
}

/// A camera that has the mesh in its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Framing {
    pub position: Vec3,
    pub target: Vec3,
    /// Upright in the picture.
    pub up: Vec3,
}

impl View {
    /// Every view under its name.
    pub const NAMES: &'static [(&'static str, Self)] = &[
        ("three-quarter", Self::ThreeQuarter),
        ("front", Self::Front),
        ("back", Self::Back),
        ("left", Self::Left),
        ("right", Self::Right),
        ("top", Self::Top),
        ("bottom", Self::Bottom),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        let named = Self::NAMES.iter().find(|(_, view)| *view == self);
        named.map_or("", |(name, _)| name)
    }

    /// Where the eye is, for objects whose [`facing`] is `facing`.
    pub(super) fn bearing(self, facing: Vec3) -> Bearing {
        let (azimuth, elevation) = match self {
            Self::ThreeQuarter => return three_quarter(facing),
            Self::Front => (0.0, 0.0),
            Self::Back => (180.0, 0.0),
            Self::Right => (90.0, 0.0),
            Self::Left => (-90.0, 0.0),
            Self::Top => (0.0, 90.0),
            Self::Bottom => (0.0, -90.0),
        };
        Bearing { azimuth, elevation }
    }
}

/// From the right front of what is closed, and of a sheet that stands; ground is looked at from higher, a ceiling from below.
fn three_quarter(facing: Vec3) -> Bearing {
    /// What is closed faces nowhere, a flat sheet one way.
    const SHEET: f32 = 0.5;
    const ASIDE: f32 = 30.0;
    let (front, elevation) = if facing.length() < SHEET {
        (0.0, 20.0)
    } else if facing.y.abs() > 0.7 * facing.length() {
        (0.0, 40.0 * facing.y.signum())
    } else {
        (facing.x.atan2(facing.z).to_degrees(), 20.0)
    };
    Bearing {
        azimuth: front + ASIDE,
        elevation,
    }
}

impl Bearing {
    /// Turned around the object by `[azimuth, elevation]`, no further than to a pole.
    pub fn turned(self, [azimuth, elevation]: [f32; 2]) -> Self {
        Self {
            azimuth: self.azimuth + azimuth,
            elevation: (self.elevation + elevation).clamp(-90.0, 90.0),
        }
    }

    /// Right, up and towards the eye, unit vectors. Here is what "up" means.
    fn axes(self) -> [Vec3; 3] {
        let (sin_a, cos_a) = self.azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = self.elevation.to_radians().sin_cos();
        [
            Vec3::new(cos_a, 0.0, -sin_a),
            Vec3::new(-sin_e * sin_a, cos_e, -sin_e * cos_a),
            Vec3::new(cos_e * sin_a, sin_e, cos_e * cos_a),
        ]
    }
}

/// Half the picture that objects fill at most.
const FILLED: f32 = 0.92;

/// The camera from `bearing` whose picture, `2 * tan` high and `aspect` times as wide at distance 1, just holds all points of `boxes`.
///
/// The picture's sides are planes through the eye: the eye is as near as the tightest pair of opposite sides allows, in the middle between
/// the sides of both pairs.
pub(super) fn fit(boxes: &[Aabb], bearing: Bearing, tan: f32, aspect: f32) -> Framing {
    let axes = bearing.axes();
    let [across, up] = [tan * aspect, tan].map(|tan| f64::from(FILLED * tan));
    let mut sides = [f64::NEG_INFINITY; 4];
    let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
    for p in boxes.iter().flat_map(|b| b.corners()) {
        let [x, y, z] = axes.map(|axis| axis.as_dvec3().dot(p.as_dvec3()));
        let reach = [x + across * z, -x + across * z, y + up * z, -y + up * z];
        for (side, reach) in sides.iter_mut().zip(reach) {
            *side = side.max(reach);
        }
        (near, far) = (near.max(z), far.min(z));
    }
    let [right, left, top, bottom] = sides;
    let (x, y) = (0.5 * (right - left), 0.5 * (top - bottom));
    let z = (0.5 * (right + left) / across).max(0.5 * (top + bottom) / up);
    let middle = 0.5 * (near + far);
    // What comes to a point towards the eye is not touched by it.
    let z = z.max(near + 0.05 * (near - far));
    let at = |z: f64| {
        let [right, up, towards] = axes.map(|axis| axis.as_dvec3());
        (x * right + y * up + z * towards).as_vec3()
    };
    Framing {
        position: at(z),
        target: at(middle),
        up: axes[1],
    }
}

/// The mean of the unit normals by area: long for a sheet, and where it faces; nothing for what is closed.
pub(super) fn facing(objects: &[SceneObject]) -> Vec3 {
    let (mut sum, mut whole) = (glam::DVec3::ZERO, 0.0);
    for object in objects {
        let mesh = match &object.shape {
            ObjectShape::Displaced(surface, _) => surface.mesh(),
            ObjectShape::Plain(mesh) => mesh,
        };
        // All instances are turned alike, mostly: the first one tells.
        let placed = object.instances.first().copied().unwrap_or_default();
        for triangle in 0..mesh.triangles().len() as u32 {
            let corners = mesh.corners(triangle);
            let [a, b, c] = corners.map(|p| placed.transform_point3(p).as_dvec3());
            let area = (b - a).cross(c - a);
            sum += area;
            whole += area.length();
        }
    }
    (sum / whole).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: Aabb = Aabb {
        min: Vec3::splat(-1.0),
        max: Vec3::splat(1.0),
    };

    /// Where a point is in the picture of half size 1, and how far it is.
    fn seen(framing: &Framing, p: Vec3, tan: f32, aspect: f32) -> (f32, f32, f32) {
        let view = (framing.target - framing.position).normalize();
        let right = view.cross(framing.up).normalize();
        let up = right.cross(view);
        let d = p - framing.position;
        let z = d.dot(view);
        (d.dot(right) / (z * tan * aspect), d.dot(up) / (z * tan), z)
    }

    #[test]
    fn everything_is_in_the_picture_and_something_at_its_edge() {
        let boxes = [
            CUBE,
            Aabb {
                min: Vec3::new(3.0, 0.0, 0.5),
                max: Vec3::new(3.5, 7.0, 0.6),
            },
        ];
        for (_, view) in View::NAMES {
            for aspect in [0.5, 1.0, 16.0 / 9.0] {
                for orbit in [[0.0, 0.0], [77.0, -5.0], [-200.0, 12.0]] {
                    let tan = 0.3f32;
                    let bearing = view.bearing(Vec3::ZERO).turned(orbit);
                    let framing = fit(&boxes, bearing, tan, aspect);
                    let mut most = 0.0f32;
                    for p in boxes.iter().flat_map(|b| b.corners()) {
                        let (x, y, z) = seen(&framing, p, tan, aspect);
                        assert!(z > 0.0);
                        most = most.max(x.abs()).max(y.abs());
                    }
                    assert!((most - FILLED).abs() < 1e-4, "{view:?} {aspect}: {most}");
                }
            }
        }
    }

    #[test]
    fn a_sheet_is_seen_from_the_side_it_faces() {
        for facing in [
            Vec3::Z,
            -Vec3::Z,
            Vec3::X,
            Vec3::Y,
            -Vec3::Y,
            Vec3::new(0.6, 0.6, -0.5),
        ] {
            let towards = View::ThreeQuarter.bearing(facing).axes()[2];
            assert!(towards.dot(facing) > 0.5, "{facing}");
        }
        let towards = View::ThreeQuarter.bearing(Vec3::ZERO).axes()[2];
        assert!(towards.cmpgt(Vec3::ZERO).all());
    }

    #[test]
    fn views_are_upright_and_named_by_where_the_eye_is() {
        for (view, from, up) in [
            (View::Front, Vec3::Z, Vec3::Y),
            (View::Back, -Vec3::Z, Vec3::Y),
            (View::Right, Vec3::X, Vec3::Y),
            (View::Left, -Vec3::X, Vec3::Y),
            (View::Top, Vec3::Y, -Vec3::Z),
            (View::Bottom, -Vec3::Y, Vec3::Z),
        ] {
            let framing = fit(&[CUBE], view.bearing(Vec3::ZERO), 0.3, 1.0);
            assert!((framing.position.normalize() - from).length() < 1e-5);
            assert!((framing.up - up).length() < 1e-5);
            assert!(framing.target.length() < 1e-5);
        }
    }
}
