"""What version 1.1 of the public schema of U3M (github.com/vizoogmbh/u3m, u3m1.1/spec/u3m_schema.json) requires and allows, as a JSON schema of
our own wording: every key of an object is required and no other is allowed, and numbers, names, paths and dates have its ranges and patterns.
The lists of names for fibers of a composition, kinds and constructions of a material are left out; they must be null here."""
UUID4 = "[0-9a-fA-F]{8}-[0-9a-fA-F]{4}-4[0-9a-fA-F]{3}-[89AaBb][0-9a-fA-F]{3}-[0-9a-fA-F]{12}"
# of a file beside the material: no folder above it, no drive, none of the characters and names that Windows reserves
PATH = r"^(?!(?i:con|prn|aux|nul|com[1-9]|lpt[1-9])(\.|$))(?!\.)([^\x00-\x1f<>:\"/\\|$%]+/)*[^\x00-\x1f<>:\"/\\|]*[^\x00-\x1f<>:\"/\\|. ]$"
NUMBER, POSITIVE = {"type": "number"}, {"type": "number", "minimum": 0}
SHARE, SIGNED = {"type": "number", "minimum": 0, "maximum": 1}, {"type": "number", "minimum": -1, "maximum": 1}


def whole(**properties):
    """An object with exactly these keys."""
    return {"type": "object", "properties": properties, "required": sorted(properties), "additionalProperties": False}


def optional(schema):
    return {"anyOf": [{"type": "null"}, schema]}


def textured(constant, texture):
    return whole(constant=constant, texture=optional(texture))


SIZE = {"width": POSITIVE, "height": POSITIVE, "dpi": whole(x=POSITIVE, y=POSITIVE), "path": {"type": "string", "pattern": PATH}}
IMAGE = whole(**SIZE, repeat=whole(rotation=NUMBER, mode={"enum": ["normal", "mirror_x", "mirror_y", "mirror_xy"]}))
RGB = whole(r=SHARE, g=SHARE, b=SHARE)
MODE = {"enum": ["add", "subtract", "multiply", "divide", "max", "min", "overlay"]}
SCALAR, COLOR, DIRECTION = whole(factor=NUMBER, offset=NUMBER, image=IMAGE), whole(mode=MODE, factor=RGB, image=IMAGE), whole(scale=NUMBER, image=IMAGE)
SHARES = ["alpha", "anisotropy_rotation", "metalness", "transmission"]
NUMBERS = ["anisotropy_value", "clearcoat_value", "clearcoat_roughness", "ior", "displacement", "roughness", "sheen_value", "sheen_tint",
           "specular_value", "specular_tint", "subsurface_radius", "subsurface_value"]
SIDE = optional(whole(
    **{key: textured(SHARE, SCALAR) for key in SHARES}, **{key: textured(NUMBER, SCALAR) for key in NUMBERS},
    **{key: textured(RGB, COLOR) for key in ("basecolor", "subsurface_color")},
    **{key: textured(whole(x=SIGNED, y=SIGNED, z=SIGNED), DIRECTION) for key in ("normal", "clearcoat_normal")},
    shader={"enum": ["principled"]}, preview=optional(whole(**SIZE))))
PHYSICS = optional(whole(thickness=optional(POSITIVE), weight=optional(POSITIVE), composition={"type": "null"}, material_type={"type": "null"},
                         construction={"type": "null"}, devices=whole(fab={"type": "string", "pattern": f"^null$|{PATH}"})))
DATE = {"type": "string", "pattern": r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?(Z|[+-]\d\d:\d\d)$"}
MATERIAL = whole(id={"type": "string", "pattern": rf"^({UUID4}|\{{{UUID4}\}})$"}, name={"type": "string", "minLength": 1}, description={"type": "string"},
                 created=DATE, modified=DATE, front=SIDE, back=SIDE, side=SIDE, physics=PHYSICS, metadata={"type": ["object", "null"]})
U3M = whole(schema={"enum": ["1.1"]}, material=MATERIAL, custom={"type": ["object", "null"]})
