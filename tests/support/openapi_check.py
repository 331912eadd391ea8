"""Compares replies with config/openapi.json: the status must be documented for the operation, and the body must match
the schema."""
import json
import os
import re

import jsonschema

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
METHODS = ("get", "put", "post", "delete", "head", "patch", "options")
# replies that any request can get (docs/api.md, Errors): bad framing, Host or Origin, and errors of the machine
GENERAL = {"400", "403", "500", "503", "507"}


def load():
    with open(os.path.join(ROOT, "config", "openapi.json"), encoding="utf-8") as f:
        return json.load(f)


class OpenApiCheck:
    def __init__(self, document=None):
        self.document = document or load()
        self.validators = {}
        self.seen = set()  # (path template, method, status)
        self.templates = []
        for path in self.document["paths"]:
            rest = path == "/v1/jobs/{id}/results/{path}"
            pattern = re.sub(r"\{[^}]+\}", "[^/?]+", path)
            if rest:
                pattern = pattern[:-len("[^/?]+")] + "[^?]+"
            self.templates.append((re.compile(pattern + r"(\?.*)?$"), path))

    def template(self, path):
        return next((t for pattern, t in self.templates if pattern.match(path)), None)

    def validator(self, schema):
        key = json.dumps(schema, sort_keys=True)
        if key not in self.validators:
            self.validators[key] = jsonschema.Draft202012Validator(
                {**schema, "components": self.document["components"]})
        return self.validators[key]

    def __call__(self, method, path, reply):
        template, method, status = self.template(path), method.lower(), str(reply.status_code)
        if template is None:
            return
        operations = self.document["paths"][template]
        if method not in operations and not (method == "head" and "get" in operations):
            assert status in ("404", "405") or status in GENERAL, f"{method} {path}: {status}"
            return
        operation = operations.get(method) or operations["get"]
        self.seen.add((template, method, status))
        documented = operation["responses"].get(status)
        if documented is None:
            assert status in GENERAL, f"{method} {template} answered {status}, which is not documented: {reply.text[:500]}"
            documented = {"content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}}
        if method == "head":
            return
        kinds = documented.get("content")
        if kinds is None:
            assert reply.content == b"", f"{method} {template} {status} has a body"
            return
        kind = reply.headers.get("Content-Type", "").split(";")[0]
        if kind not in kinds:
            assert "application/octet-stream" in kinds, f"{method} {template} {status}: {kind} is not documented"
            return
        if kind.endswith("json") and "application/octet-stream" not in kinds:
            self.validator(kinds[kind]["schema"]).validate(reply.json())
