"""The route of Blender's users from particles to a picture of water, for comparison with `embrun render`.

    blender --background --python bench/blender_route.py -- PARTICLES.bgeo OUT.png

Reads classic BGEO (gzip or plain), turns the points into a mesh by the geometry nodes Points to Volume and Volume to Mesh
(voxels of R0, balls of 2 R0), and renders glass of index 1.33 in a constant environment of radiance 1 by Cycles on two
threads: 320x240, 32 samples, 32 bounces, from the camera that `embrun render` takes for the bundled dam break. Prints the
counts and seconds; `time` around it tells the CPU's, of which starting Blender takes 1.6 s.
"""

import array
import gzip
import math
import struct
import sys
import time

import bpy
import mathutils

R0 = 0.0232  # m, of the bundled dam break
EYE, TARGET, VERTICAL_FOV = (-4.54354, 4.07402, 6.44916), (-0.12121, 0.95894, 0.13341), 35.0


def read_positions(path):
    with open(path, "rb") as file:
        data = file.read()
    if data[:2] == b"\x1f\x8b":
        data = gzip.decompress(data)
    if data[:5] != b"BgeoV":
        sys.exit(f"{path}: not a classic BGEO file")
    (count,) = struct.unpack_from(">i", data, 9)
    (attributes,) = struct.unpack_from(">i", data, 25)
    at, stride = 41, 16
    for _ in range(attributes):
        (length,) = struct.unpack_from(">H", data, at)
        at += 2 + length
        components, _ = struct.unpack_from(">Hi", data, at)
        at += 6 + 4 * components
        stride += 4 * components
    points = array.array("f", b"".join(data[at + stride * i : at + stride * i + 12] for i in range(count)))
    points.byteswap()
    return points


def add_water(positions):
    mesh = bpy.data.meshes.new("particles")
    mesh.vertices.add(len(positions) // 3)
    mesh.vertices.foreach_set("co", positions)
    mesh.update()
    water = bpy.data.objects.new("particles", mesh)
    bpy.context.collection.objects.link(water)

    glass = bpy.data.materials.new("glass")
    glass.use_nodes = True
    nodes = glass.node_tree.nodes
    nodes.clear()
    bsdf, surface = nodes.new("ShaderNodeBsdfGlass"), nodes.new("ShaderNodeOutputMaterial")
    bsdf.inputs["IOR"].default_value, bsdf.inputs["Roughness"].default_value = 1.33, 0.0
    glass.node_tree.links.new(bsdf.outputs[0], surface.inputs[0])

    tree = bpy.data.node_groups.new("water", "GeometryNodeTree")
    tree.inputs.new("NodeSocketGeometry", "in")
    tree.outputs.new("NodeSocketGeometry", "out")
    kinds = ["NodeGroupInput", "GeometryNodeMeshToPoints", "GeometryNodePointsToVolume", "GeometryNodeVolumeToMesh",
             "GeometryNodeSetShadeSmooth", "GeometryNodeSetMaterial", "NodeGroupOutput"]
    chain = [tree.nodes.new(kind) for kind in kinds]
    for before, after in zip(chain, chain[1:]):
        tree.links.new(before.outputs[0], after.inputs[0])
    volume, surface, material = chain[2], chain[3], chain[5]
    volume.resolution_mode = "VOXEL_SIZE"
    volume.inputs["Voxel Size"].default_value = R0
    volume.inputs["Radius"].default_value = 2 * R0
    surface.resolution_mode = "GRID"
    surface.inputs["Threshold"].default_value = 0.1
    material.inputs["Material"].default_value = glass
    water.modifiers.new("water", "NODES").node_group = tree


def set_up_render(path):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 32
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    for bounces in ("max", "transmission", "glossy", "diffuse", "transparent_max"):
        setattr(scene.cycles, bounces + "_bounces", 32)
    scene.cycles.sample_clamp_indirect = 0
    scene.render.resolution_x, scene.render.resolution_y = 320, 240
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = path
    scene.world = bpy.data.worlds.new("white")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)

    back = (mathutils.Vector(EYE) - mathutils.Vector(TARGET)).normalized()
    right = mathutils.Vector((0, 1, 0)).cross(back).normalized()
    pose = mathutils.Matrix((right, back.cross(right), back)).transposed().to_4x4()
    pose.translation = EYE
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.angle = "VERTICAL", math.radians(VERTICAL_FOV)
    camera = bpy.data.objects.new("camera", lens)
    bpy.context.collection.objects.link(camera)
    camera.matrix_world = pose
    scene.camera = camera


def main():
    if "--" not in sys.argv or len(sys.argv) - sys.argv.index("--") != 3:
        sys.exit(__doc__)
    source, picture = sys.argv[sys.argv.index("--") + 1 :]
    begin = time.time()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_water(read_positions(source))
    set_up_render(picture)
    bpy.ops.render.render(write_still=True)
    print(f"from particles to picture: {time.time() - begin:.2f} s")


main()
