"""What the validators of USD, which the program usdchecker runs, find in stages: usd_check.py FILE... prints a JSON list of errors for each. Run by a
Python that has usd-core and MaterialX. The usd-core of PyPI does not know the nodes of MaterialX; these and their inputs are looked up in the library
of MaterialX."""
import json
import sys

import MaterialX
from pxr import Usd, UsdShade, UsdValidation

library = MaterialX.createDocument()
MaterialX.loadLibraries(MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), library)


def faults_of_nodes(stage):
    """Nodes that MaterialX does not have, inputs that they do not have, and inputs of another type."""
    names = {"color3f": "color3", "float3": "color3", "float2": "vector2", "normal3f": "vector3", "vector3f": "vector3", "int": "integer",
             "bool": "boolean", "asset": "filename", "token": None, "string": "string", "float": "float"}
    for prim in stage.Traverse():
        shader = UsdShade.Shader(prim)
        name = shader.GetIdAttr().Get() if prim.IsA(UsdShade.Shader) else None
        if name is None or not name.startswith("ND_"):
            continue
        definition = library.getNodeDef(name)
        if definition is None:
            yield f"{prim.GetPath()}: no node {name}"
            continue
        for given in shader.GetInputs():
            wanted = definition.getActiveInput(given.GetBaseName())
            kind = names[str(given.GetTypeName())]
            same = wanted is not None and (kind in (None, wanted.getType()) or {kind, wanted.getType()} == {"color3", "vector3"})
            if not same:
                yield f"{prim.GetPath()}: {name} has no input {given.GetTypeName()} {given.GetBaseName()}"


def is_unknown_node(error):
    return error.GetValidator().GetMetadata().name == "usdShadeValidators:ShaderSdrCompliance" and "'ND_" in error.GetMessage() and \
        "not found in sdrRegistry" in error.GetMessage()


def main():
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    found = []
    for path in sys.argv[1:]:
        stage = Usd.Stage.Open(path)
        errors = [e for e in context.Validate(stage) if not is_unknown_node(e)]
        found.append([f"{e.GetValidator().GetMetadata().name}: {e.GetMessage()}" for e in errors] + list(faults_of_nodes(stage)))
    print(json.dumps(found))


if __name__ == "__main__":
    main()
