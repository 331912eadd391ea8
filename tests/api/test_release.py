"""A release is named alike in every place: base/version.h, CHANGELOG.md, CITATION.cff, SECURITY.md, README.md."""
import os
import re

from daemon_under_test import ROOT

REQUIRED = {"cff-version", "message", "title", "authors"}  # of the schema of Citation File Format 1.2.0
KNOWN = REQUIRED | {"abstract", "type", "version", "date-released", "license", "keywords", "references"}


def read(*path):
    with open(os.path.join(ROOT, *path), encoding="utf-8") as file:
        return file.read()


def version():
    return re.search(r'SELVEDGE_VERSION "([0-9.]+)"', read("base", "version.h")).group(1)


def release():
    """Number and date of the newest release of the changelog."""
    return re.search(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$", read("CHANGELOG.md"), re.M).groups()


def citation():
    return dict(re.findall(r"^([\w-]+):[ \t]*(.*)$", read("CITATION.cff"), re.M))


def test_the_newest_release_has_the_version_of_the_programs():
    assert release()[0] == version()


def test_the_citation_names_the_release():
    keys = citation()
    assert REQUIRED <= keys.keys() <= KNOWN
    assert keys["cff-version"] == "1.2.0" and keys["type"] == "software"
    assert (keys["version"], keys["date-released"]) == release()
    assert keys["license"] == "Apache-2.0" and "Apache License" in read("LICENSE")


def test_the_supported_version_is_that_of_the_programs():
    supported = re.search(r"^\| (\d+\.\d+) \| yes \|$", read("SECURITY.md"), re.M).group(1)
    assert version().startswith(supported + ".")


def test_the_readme_links_what_strangers_look_for():
    for name in ("SECURITY.md", "CITATION.cff", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE", "docs/glossary.md"):
        assert f"]({name})" in read("README.md"), name


def test_release_notes_are_read_in_two_minutes():
    notes = read("CHANGELOG.md").split(f"## [{version()}]")[1].split("\n### ")[0].split("\n## ")[0]
    assert 150 < len(notes.split()) < 480


def test_the_image_runs_what_the_package_installs():
    """The Dockerfile names the file that `make deb` makes, an own user, and the data folder of the unit."""
    text = read("Dockerfile")
    assert "make deb" in text and "FROM debian:12 AS build" in text and text.count("FROM ") == 2
    final = text.split("FROM ")[2]
    assert "USER selvedge" in final and 'ENTRYPOINT ["/usr/bin/selvedged"]' in final
    data = re.search(r"--data (\S+)", read("config", "selvedge.service")).group(1)
    assert f"VOLUME {data}" in final and f'"--data", "{data}"' in final
