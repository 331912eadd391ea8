"""Reads glTF 2.0 binary files: the document and its numbers, by the published grammar (Khronos 2021, section 4.4 and 3.6)."""
import json
import struct

KINDS = {5123: ("H", 2), 5125: ("I", 4), 5126: ("f", 4)}
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class GltfFile:
    def __init__(self, path):
        with open(path, "rb") as f:
            data = f.read()
        magic, version, length = struct.unpack("<4sII", data[:12])
        assert magic == b"glTF" and version == 2 and length == len(data)
        n_text, kind = struct.unpack("<I4s", data[12:20])
        assert kind == b"JSON" and n_text % 4 == 0
        self.document = json.loads(data[20:20 + n_text])
        n_block, kind = struct.unpack("<I4s", data[20 + n_text:28 + n_text])
        self.block = data[28 + n_text:]
        assert kind == b"BIN\0" and n_block == len(self.block) == self.document["buffers"][0]["byteLength"]

    def bytes_of(self, view):
        found = self.document["bufferViews"][view]
        return self.block[found["byteOffset"]:found["byteOffset"] + found["byteLength"]]

    def values(self, accessor):
        """A list of tuples, or of numbers for scalars."""
        found = self.document["accessors"][accessor]
        (letter, size), n = KINDS[found["componentType"]], SIZES[found["type"]]
        flat = struct.unpack(f"<{n * found['count']}{letter}", self.bytes_of(found["bufferView"])[:n * size * found["count"]])
        return list(flat) if n == 1 else [flat[i:i + n] for i in range(0, len(flat), n)]

    def picture(self, texture):
        """The bytes of a texture's image, which is inside of the file."""
        image = self.document["images"][self.document["textures"][texture]["source"]]
        assert image["mimeType"] == "image/png"
        return self.bytes_of(image["bufferView"])
