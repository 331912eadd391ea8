"""The input files that a job document names."""
from __future__ import annotations

import hashlib
import json
import os
from typing import Any, Callable, Mapping, Optional, Union

Document = Mapping[str, Any]
DocumentOrPath = Union[Document, str, "os.PathLike[str]"]


def files_of(document: Document) -> list[tuple[str, str]]:
    """Return the input files that a job document names, each once: [(name, role), ...]."""
    names = [(n, "volume") for n in document.get("volume", {}).get("files", [])]
    for key in ("fibers", "environment", "measurements", "rig", "profile"):
        if "file" in document.get(key, {}):
            names.append((document[key]["file"], key))
    for key, role in (("draft_file", "draft"), ("texture", "photograph")):
        if key in document.get("cloth", {}):
            names.append((document["cloth"][key], role))
    camera, color = document.get("camera", {}), document.get("color", {})
    names += [(camera["noise_file"], "camera_noise")] if "noise_file" in camera else []
    names += [(name, "dark_frame") for name in camera.get("dark_frames", [])]
    names += [(color[key]["file"], role) for key, role in (("chart", "chart"), ("white", "white_reference")) if key in color]
    names += [(color["chart"]["reference"], "measurements")] if "reference" in color.get("chart", {}) else []
    for p in document.get("photographs", []):
        names += [(q["file"], "photograph") for q in (p, *p.get("more_exposures", []))]
    bowl = document.get("profile", {}).get("bowl", {})
    names += [(bowl["mask"], "photograph")] if "mask" in bowl else []
    for p in bowl.get("photographs", []):
        names += [(q["file"], "photograph") for q in (p, *p.get("more_exposures", []))]
        names += [(p["background"], "photograph")] if "background" in p else []
    names += [(p["mesh_file"], "mesh") for p in document.get("pictures", []) if "mesh_file" in p]
    return list(dict.fromkeys(names))


def read_document(document: DocumentOrPath) -> tuple[Document, str]:
    """Return a document, and the folder in which its files lie: "." for a document that is given as such."""
    if isinstance(document, Mapping):
        return document, "."
    path = os.fspath(document)
    with open(path, encoding="utf-8") as f:
        return json.load(f), os.path.dirname(os.path.abspath(path))


def declaration(path: str, role: str, name: Optional[str] = None, read: Callable[[int], None] = lambda n: None) -> dict[str, Any]:
    """Return the declaration of a file for the server: its name, size and SHA-256. read(n) is called for each n bytes."""
    digest = hashlib.sha256()
    with open(path, "rb") as f:
        while chunk := f.read(1 << 20):
            digest.update(chunk)
            read(len(chunk))
        return {"name": name or os.path.basename(path), "role": role, "size": f.tell(), "sha256": digest.hexdigest()}
