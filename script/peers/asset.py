"""A demo's mesh and map under lights that every renderer has: what compare-peers shows to prismarch and to Cycles."""

import struct
import tomllib
from pathlib import Path

SUN = (0.55, 0.62, 0.56)  # towards it
SUN_IRRADIANCE = 3.0
SKY = 0.3  # radiance from all around
ALBEDO = 0.5
DIFFUSE_BOUNCES = 4


def read(folder, name):
    """The demo's mesh, map and camera."""
    scene = tomllib.loads((folder / f"{name}.toml").read_text())
    mesh = next(mesh for mesh in scene["mesh"] if "displacement" in mesh)
    relief = mesh["displacement"]
    return {
        "mesh": folder / mesh["file"],
        "map": folder / relief["map"],
        "scale": relief["scale"],
        "midlevel": relief.get("midlevel", 0.0),
        "translate": mesh.get("transform", {}).get("translate", [0, 0, 0]),
        "position": scene["camera"]["position"],
        "target": scene["camera"]["target"],
        "fov": scene["camera"]["fov"],
    }


def write_toml(what, path):
    """The same as a scene of prismarch's, beside a picture of its sky."""
    sky = Path(path).with_suffix(".hdr")
    code = round(SKY * 256)
    sky.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + struct.pack("4B", code, code, code, 128) * 8)
    Path(path).write_text(
        f"""[camera]
position = {what["position"]}
target = {what["target"]}
fov = {what["fov"]}
[integrator]
type = "path"
diffuse = {DIFFUSE_BOUNCES}
roulette = 100
[[mesh]]
file = "{what["mesh"]}"
material = "chalk"
transform = {{ translate = {what["translate"]} }}
[mesh.displacement]
map = "{what["map"]}"
scale = {what["scale"]}
midlevel = {what["midlevel"]}
wrap = "clamp"
[[material]]
name = "chalk"
base_color = [{ALBEDO}, {ALBEDO}, {ALBEDO}]
specular = 0.0
[[light]]
type = "directional"
direction = [{", ".join(str(-x) for x in SUN)}]
strength = {SUN_IRRADIANCE}
[[light]]
type = "environment"
file = "{sky}"
"""
    )
