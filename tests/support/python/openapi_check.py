"""Compares replies with config/openapi.json: the status must be documented for the operation, and the body must match
the schema."""
import functools
import json
import os
import re

import jsonschema

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
METHODS = ("get", "put", "post", "delete", "head", "patch", "options")
# replies that any request can get (docs/api.md, Errors): bad framing, Host or Origin, no valid token, a quota, and errors
# of the machine
GENERAL = {"400", "401", "403", "429", "500", "503", "507"}

HEADERS = ("Idempotency-Key", "If-Match")  # fields of errors that are not about the document


def load():
    with open(os.path.join(ROOT, "config", "openapi.json"), encoding="utf-8") as f:
        return json.load(f)


@functools.cache
def schemas():
    """The schemas of the document, read once: each reading takes some milliseconds."""
    return load()["components"]["schemas"]


def names_a_key(field, schema=None):
    """True when the field of an error is a key of the job document, such as "volume.filter.s", "photographs[3].file" or
    "fit.fixed.C_R.g"."""
    if schema is None:
        schema = schemas()["JobDocument"]
    if "$ref" in schema:
        schema = schemas()[schema["$ref"].rpartition("/")[2]]
    if field == "":
        return True
    if any(names_a_key(field, one) for one in schema.get("anyOf", [])):
        return True
    element = re.match(r"\[\d+\]", field)
    if element:
        return "items" in schema and names_a_key(field[element.end():], schema["items"])
    rest = field.removeprefix(".")
    for key, member in schema.get("properties", {}).items():
        if re.match(re.escape(key) + r"($|[.\[])", rest) and names_a_key(rest[len(key):], member):
            return True
    # a parameter such as C_R or C_R.g, of one group of fibers such as warp.C_R
    free = re.match(r"([\w-]+\.(?=[A-Za-z]+_[A-Z]))?\w+(\.[rgb]\b)?", rest)
    more = schema.get("additionalProperties")
    return isinstance(more, dict) and free is not None and names_a_key(rest[free.end():], more)


def check_field(field, text):
    """Asserts that the field of an error about a job document is one of its keys, or an unknown key in one of them."""
    unknown = re.search(r"unknown (field|parameter)", text)
    known = names_a_key(field.rpartition(".")[0] if unknown else field)
    assert known, f"'{field}' is no key of the job document: {text}"


class OpenApiCheck:
    def __init__(self, document=None):
        self.document = document or load()
        self.validators = {}
        self.valid = {}  # the last valid body by (path template, method, status, kind): who waits for a job gets the same again and again
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

    def check_fields(self, method, template, reply):
        """Errors of job documents, and of jobs, name keys of the document."""
        takes_document = (method, template) in (("post", "/v1/jobs"), ("put", "/v1/jobs/{id}/document"))
        if takes_document and reply.status_code == 422 and reply.json().get("code") == "invalid":
            field = reply.json().get("field", "")
            if field not in HEADERS:
                check_field(field, reply.json()["detail"])
        elif template == "/v1/jobs/{id}" and method == "get" and reply.status_code == 200 and reply.json()["error"]:
            check_field(reply.json()["error"]["field"] or "", reply.json()["error"]["text"])

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
        self.check_fields(method, template, reply)
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
            assert "*/*" in kinds, f"{method} {template} {status}: {kind} is not documented"
            return
        place = (template, method, status, kind)
        if kind.endswith("json") and self.valid.get(place) != reply.content:
            self.validator(kinds[kind]["schema"]).validate(reply.json())
            self.valid[place] = reply.content
