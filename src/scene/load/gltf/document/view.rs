//! What a document says of seeing: cameras, and lights (KHR_lights_punctual).

use serde::Deserialize;

#[derive(Debug, Deserialize)]
pub(super) struct DocumentExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights: Option<Lights>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Lights {
    #[serde(default)]
    pub lights: Vec<Light>,
}

/// A light of KHR_lights_punctual.
#[derive(Debug, Deserialize)]
pub(in super::super) struct Light {
    pub name: Option<Box<str>>,
    #[serde(rename = "type")]
    pub kind: Box<str>,
    #[serde(default = "white")]
    pub color: [f32; 3],
    #[serde(default = "one")]
    pub intensity: f32,
    pub range: Option<f32>,
    pub spot: Option<Spot>,
}

fn white() -> [f32; 3] {
    [1.0; 3]
}

fn one() -> f32 {
    1.0
}

/// Half angles of a cone, radians.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(in super::super) struct Spot {
    pub inner_cone_angle: f32,
    pub outer_cone_angle: f32,
}

impl Default for Spot {
    fn default() -> Self {
        Self {
            inner_cone_angle: 0.0,
            outer_cone_angle: std::f32::consts::FRAC_PI_4,
        }
    }
}

#[derive(Debug, Deserialize)]
pub(in super::super) struct Camera {
    pub name: Option<Box<str>>,
    #[serde(rename = "type")]
    pub kind: Box<str>,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct Perspective {
    pub yfov: f32,
    pub aspect_ratio: Option<f32>,
}

/// Half of what is seen across and up.
#[derive(Debug, Deserialize)]
pub(in super::super) struct Orthographic {
    pub xmag: f32,
    pub ymag: f32,
}

#[derive(Debug, Deserialize)]
pub(super) struct LightOfNode {
    pub light: usize,
}
