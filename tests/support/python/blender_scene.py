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
tree = curves.materials[0].node_tree
mix = next(n for n in tree.nodes if n.type == "MIX_SHADER")
shaders = [mix.inputs[1 + k].links[0].from_node for k in range(2)]
print("found " + json.dumps({
    "n_object": len(hair), "shared": len({o.data.name for o in hair}), "n_curve": len(curves.curves), "n_point": len(curves.points),
    "radius": curves.points[0].radius, "share": mix.inputs[0].default_value, "hair": [{
        "absorption": list(s.inputs["Absorption Coefficient"].default_value), "roughness": s.inputs["Roughness"].default_value,
        "radial": s.inputs["Radial Roughness"].default_value, "index": s.inputs["IOR"].default_value} for s in shaders],
    "engine": bpy.context.scene.render.engine, "camera": list(bpy.context.scene.camera.location),
    "mean": [sum(pixels[c::4]) / (len(pixels) / 4) for c in range(3)]}))
