"""Renders a demo's mesh and map in Cycles: in_cycles.py FOLDER NAME WIDTH HEIGHT SAMPLES THREADS OUT.exr

Displacement is true displacement of an adaptively subdivided mesh, a quad to a pixel; no denoising, no adaptive sampling.
"""

import math
import sys
from pathlib import Path

import bpy
import addon_utils  # comes with bpy
import asset as shared
from mathutils import Vector


def upright(v):
    """+Y up as Blender's importer turns it."""
    return Vector((v[0], -v[2], v[1]))


def main():
    folder, name, width, height, samples, threads, out = sys.argv[1:]
    what = shared.read(Path(folder), name)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(what["mesh"]))
    thing = bpy.context.selected_objects[0]
    thing.location = upright(what["translate"])
    bpy.ops.object.shade_smooth()
    addon_utils.enable("cycles")
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    if hasattr(cycles, "feature_set"):
        try:
            cycles.feature_set = "EXPERIMENTAL"
        except TypeError:
            pass
    cycles.samples = int(samples)
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.max_bounces = shared.DIFFUSE_BOUNCES
    cycles.diffuse_bounces = shared.DIFFUSE_BOUNCES
    cycles.sample_clamp_indirect = 0.0
    if hasattr(cycles, "use_light_tree"):
        cycles.use_light_tree = False
    cycles.dicing_rate = 1.0

    subdivision = thing.modifiers.new("subdivision", "SUBSURF")
    subdivision.subdivision_type = "SIMPLE"
    for owner in (subdivision, getattr(thing, "cycles", None)):
        if owner is not None and hasattr(owner, "use_adaptive_subdivision"):
            owner.use_adaptive_subdivision = True

    material = bpy.data.materials.new("chalk")
    material.use_nodes = True
    material.displacement_method = "DISPLACEMENT"
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (shared.ALBEDO,) * 3 + (1.0,)
    links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.load(str(what["map"]))
    texture.image.colorspace_settings.name = "Non-Color"
    texture.extension = "EXTEND"
    displacement = nodes.new("ShaderNodeDisplacement")
    displacement.inputs["Scale"].default_value = what["scale"]
    displacement.inputs["Midlevel"].default_value = what["midlevel"]
    links.new(texture.outputs["Color"], displacement.inputs["Height"])
    links.new(displacement.outputs["Displacement"], output.inputs["Displacement"])
    thing.data.materials.clear()
    thing.data.materials.append(material)

    world = bpy.data.worlds.new("sky")
    scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (shared.SKY,) * 3 + (1.0,)
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = shared.SUN_IRRADIANCE
    sun.angle = 0.0
    lamp = bpy.data.objects.new("sun", sun)
    lamp.rotation_euler = upright(shared.SUN).to_track_quat("Z", "Y").to_euler()
    scene.collection.objects.link(lamp)

    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = math.radians(what["fov"])
    camera.clip_start = 1e-3
    eye = bpy.data.objects.new("camera", camera)
    position, target = upright(what["position"]), upright(what["target"])
    eye.location = position
    eye.rotation_euler = (target - position).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(eye)
    scene.camera = eye

    render = scene.render
    render.resolution_x, render.resolution_y = int(width), int(height)
    render.resolution_percentage = 100
    render.threads_mode = "FIXED"
    render.threads = int(threads)
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.filepath = str(Path(out).resolve())
    bpy.ops.render.render(write_still=True)
    pixels = bpy.data.images.load(render.filepath)
    values = pixels.pixels[:]
    print(f"mean {sum(values[0::4]) / (int(width) * int(height)):.5f}")


main()
