"""Opens a glTF file in Blender and prints as JSON what it finds: blender -b --factory-startup --python blender_gltf.py -- FILE"""
import json
import sys

import bpy
import numpy

if not hasattr(numpy, "bool"):  # Debian's Blender 3.4 was written for an older numpy
    numpy.bool = bool
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
bpy.ops.import_scene.gltf(filepath=sys.argv[-1])
(found,) = [thing for thing in bpy.data.objects if thing.type == "MESH"]
(material,) = found.data.materials
kinds = [node.type for node in material.node_tree.nodes]
print("found " + json.dumps({
    "size": list(found.dimensions), "n_vertex": len(found.data.vertices), "has_places": len(found.data.uv_layers) == 1, "material": material.name,
    "kinds": kinds, "images": sorted(node.image.name for node in material.node_tree.nodes if node.type == "TEX_IMAGE")}))
