"""What Blender has after the script of an export ran in it, and the mean of the picture that it rendered:
blender -b --python cloth.py --python blender_scene.py -- PICTURE SAMPLES PX prints a line that begins with "found "."""
import json
import sys

import bpy

picture = bpy.data.images.load(bpy.path.abspath(sys.argv[sys.argv.index("--") + 1]))
picture.colorspace_settings.name = "Non-Color"
pixels = list(picture.pixels)
hair = [o for o in bpy.data.objects if o.type == "CURVES"]
curves = hair[0].data
shader = next(n for n in curves.materials[0].node_tree.nodes if n.type == "BSDF_HAIR_PRINCIPLED")
print("found " + json.dumps({
    "n_object": len(hair), "shared": len({o.data.name for o in hair}), "n_curve": len(curves.curves), "n_point": len(curves.points),
    "radius": curves.points[0].radius, "absorption": list(shader.inputs["Absorption Coefficient"].default_value),
    "roughness": shader.inputs["Roughness"].default_value, "radial": shader.inputs["Radial Roughness"].default_value,
    "index": shader.inputs["IOR"].default_value, "engine": bpy.context.scene.render.engine, "camera": list(bpy.context.scene.camera.location),
    "mean": [sum(pixels[c::4]) / (len(pixels) / 4) for c in range(3)]}))
