"""An exported glTF file as Blender's importer and Cycles show it: blender -b --factory-startup --python blender_drape.py -- FILE VIEW PX SPP OUT.npy,
VIEW as JSON (exports_side_by_side.py). Writes linear radiances, rows from the top."""
import json
import math
import sys
import tempfile

import bpy
import numpy
from mathutils import Matrix, Vector

if not hasattr(numpy, "bool"):  # Debian's Blender 3.4 was written for an older numpy
    numpy.bool = bool
path, view, px, spp, out = sys.argv[sys.argv.index("--") + 1:]
view, px = json.loads(view), int(px)
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
bpy.ops.import_scene.gltf(filepath=path)
scene = bpy.context.scene


def put(name, data, direction, up, distance):
    """Cameras and lamps look along -z."""
    thing = bpy.data.objects.new(name, data)
    scene.collection.objects.link(thing)
    z = Vector(direction).normalized()
    x = Vector(up).cross(z).normalized()
    thing.matrix_world = Matrix.Translation(distance * z) @ Matrix((x, z.cross(x), z)).transposed().to_4x4()
    return thing


sun = bpy.data.lights.new("lamp", "SUN")
sun.energy, sun.angle = math.pi, 0
put("lamp", sun, view["lamp"], (0, 0.1, 1), 0.5)
camera = bpy.data.cameras.new("camera")
camera.type, camera.ortho_scale, camera.clip_start, camera.clip_end = "ORTHO", view["width_mm"] / 1000, 0.001, 2
scene.camera = put("camera", camera, view["camera"], view["up"], 0.5)
scene.world = scene.world or bpy.data.worlds.new("World")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.pixel_filter_type = int(spp), False, "BOX"
scene.view_settings.view_transform = "Standard"
scene.render.resolution_x = scene.render.resolution_y = px
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
with tempfile.NamedTemporaryFile(suffix=".exr") as made:
    scene.render.filepath = made.name
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(made.name)
    picture.colorspace_settings.name = "Non-Color"
    numpy.save(out, numpy.array(picture.pixels[:], dtype=numpy.float32).reshape(px, px, 4)[::-1, :, :3])
