"""Whether a document is valid MaterialX, and the nodes of its material: materialx_document.py FILE prints JSON. Run by a Python that has MaterialX."""
import json
import sys

import MaterialX

document, library = MaterialX.createDocument(), MaterialX.createDocument()
MaterialX.readFromXmlFile(document, sys.argv[1])
MaterialX.loadLibraries(MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), library)
document.importLibrary(library)
valid, why = document.validate()
surface = document.getNode("surface")
definition = surface.getNodeDef()
unknown = [i.getName() for i in surface.getInputs() if definition.getActiveInput(i.getName()) is None]
nodes = document.getNodeGraph("maps").getNodes()
print(json.dumps({
    "valid": valid, "why": why, "surface": definition.getName(), "unknown": unknown, "undefined": [n.getName() for n in nodes if n.getNodeDef() is None],
    "materials": [m.getName() for m in document.getMaterialNodes()], "files": [n.getInputValue("file") for n in nodes if n.getCategory() == "tiledimage"],
    "weight": surface.getInputValue("specular_weight")}))
