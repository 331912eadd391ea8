#!/usr/bin/python3
"""Writes the table of endpoints in C and the tables of docs/api.md from the operations of config/openapi.json.

    config/generate_endpoints.py [--check] [--root FOLDER]

An operation stands in config/openapi.json alone: path, method, scope (x-scope), parameters of the query, body, summary, description,
and the section of docs/api.md (its tag). Its handler is handle_ and the operationId in lower case: listJobs is handle_list_jobs.
x-body "batch": the body may have server.max_batch_bytes; x-any-query: parameters of the query are not checked. With --check nothing is
written and the exit status is 1 when a file is out of date."""
import argparse
import json
import os
import re
import sys

METHODS = ("get", "post", "put", "delete", "head", "patch", "options")
SCOPES = {"none": "ACCESS_OPEN", "read": "ACCESS_READ", "submit": "ACCESS_SUBMIT", "admin": "ACCESS_ADMIN"}
HEAD = """/* The endpoints of config/openapi.json. Written by `make generate`; do not edit.
 *
 * ENDPOINT(method, path, handler, body, scope, query): as in struct http_route. */
"""
MARKS = re.compile(r"(<!-- endpoints: ([^\n]*?) -->\n).*?(<!-- end -->)", flags=re.S)


def operations(api):
    for path, item in api["paths"].items():
        for method, operation in item.items():
            if method in METHODS:
                yield path, method, operation


def query_of(api, operation):
    """Names of the parameters of the query, in the order of the description."""
    for parameter in operation.get("parameters", []):
        if "$ref" in parameter:
            parameter = api["components"]["parameters"][parameter["$ref"].split("/")[-1]]
        if parameter["in"] == "query":
            yield parameter["name"]


def body_of(operation):
    kinds = operation.get("requestBody", {}).get("content", {})
    if "application/offset+octet-stream" in kinds:
        return "UPLOAD"
    return "BATCH" if operation.get("x-body") == "batch" else "JSON" if kinds else "NONE"


def handler_of(operation):
    return re.sub(r"([A-Z])", lambda letter: "_" + letter[1].lower(), operation["operationId"])


def row(api, path, method, operation):
    """A row of the table in C, in the order of the description; {path} takes the rest of an address."""
    address = path.replace("{path}", "{path...}")
    query = "NULL" if operation.get("x-any-query") else '"' + " ".join(query_of(api, operation)) + '"'
    cells = [f'"{method.upper()}"', f'"{address}"', handler_of(operation), body_of(operation), SCOPES[operation["x-scope"]]]
    line = f"ENDPOINT({', '.join(cells)}, {query})\n"
    return line if len(line) <= 121 else f"ENDPOINT({', '.join(cells)},\n         {query})\n"


def table_in_c(api):
    return HEAD + "".join(row(api, *one) for one in operations(api))


def table(api, section):
    lines = ["| request | answer |\n", "|---|---|\n"]
    for path, method, operation in operations(api):
        if operation["tags"] != [section]:
            continue
        names = list(query_of(api, operation))
        query = "?" + "&".join(f"{name}=" for name in names[:3]) + ("&..." if len(names) > 3 else "") if names else ""
        text = operation.get("description", operation["summary"] + ".").replace("|", "\\|")
        lines.append(f"| `{method.upper()} {path}{query}` | {text} |\n")
    return "".join(lines)


def page(api, text):
    return MARKS.sub(lambda mark: mark[1] + table(api, mark[2]) + mark[3], text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--root", default=os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    arguments = parser.parse_args()
    with open(os.path.join(arguments.root, "config", "openapi.json"), encoding="utf-8") as file:
        api = json.load(file)
    stale = []
    for name, make in (("server/endpoints/endpoints.def", lambda old: table_in_c(api)), ("docs/api.md", lambda old: page(api, old))):
        path = os.path.join(arguments.root, name)
        old = ""
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                old = file.read()
        new = make(old)
        if new != old:
            stale.append(name)
            if not arguments.check:
                with open(path, "w", encoding="utf-8") as file:
                    file.write(new)
    if stale:
        print(("out of date (run make generate): " if arguments.check else "written: ") + ", ".join(stale))
    return 1 if stale and arguments.check else 0


if __name__ == "__main__":
    sys.exit(main())
