"""tests/check_layers.py finds what it promises to find."""
import os
import shutil
import subprocess
import sys

import pytest
from daemon_under_test import ROOT

sys.path.insert(0, os.path.join(ROOT, "tests"))
import check_layers  # noqa: E402


@pytest.mark.parametrize("path, include", [
    ("base/a.c", "geometry/reconstruct/reconstruct.h"),
    ("geometry/a.c", "renderer/scene/scene.h"),
    ("renderer/a.c", "optimizer/job/job_folder.h"),
    ("renderer/a.c", "geometry/phantom/phantom.h"),
    ("optimizer/job/a.c", "renderer/scattering/appearance.h"),
    ("optimizer/job/a.h", "optimizer/fit/objective/objective.h"),
    ("server/a.c", "optimizer/worker/pipeline.h"),
    ("server/a.c", "renderer/scattering/appearance.h"),
    ("clients/cli/a.c", "server/settings/settings.h"),
    ("base/a.c", "status.h"),
    ("base/catalogue/models.def", "renderer/scattering/scattering.h"),
    ("base/catalogue/methods.def", "renderer/scattering/models/fur/fur_rows.def"),
])
def test_includes_against_the_layers(path, include):
    assert list(check_layers.check_includes(path, f'/* A file. */\n#include "{include}"\n'))


@pytest.mark.parametrize("path, include", [
    ("optimizer/job/a.c", "base/catalogue/model_catalogue.h"),
    ("server/jobs/a.c", "optimizer/job/document/job_document.h"),
    ("optimizer/fit/a.c", "renderer/estimate/estimate.h"),
    ("base/catalogue/models.def", "renderer/scattering/models/fur/fur_rows.def"),
])
def test_includes_along_the_layers(path, include):
    assert not list(check_layers.check_includes(path, f'#include "{include}"\n'))


@pytest.mark.parametrize("text, good", [
    ("#ifndef A\n#define A\n#endif\n", False),
    ("/* todo */\n#ifndef A\n", False),
    ("/* Angles in degrees and radians, and the way between them. */\n#ifndef A\n", True),
])
def test_headers_say_their_purpose(text, good):
    assert bool(list(check_layers.check_purpose("base/a.h", text))) != good


def test_names_are_unique():
    assert list(check_layers.check_names(["base/a.c", "server/a.c", "base/b.c"]))
    assert not list(check_layers.check_names(["base/README.md", "server/README.md"]))


def test_symbols_of_the_daemon(tmp_path):
    """A daemon that holds a function of librenderer is found; what stays in the library does no harm."""
    if shutil.which("cc") is None:
        pytest.skip("no compiler")
    (tmp_path / "bin").mkdir()
    (tmp_path / "lib").mkdir()
    (tmp_path / "scatter.c").write_text("int scatter(void) { return 1; }\n")
    (tmp_path / "with.c").write_text("int scatter(void);\nint main(void) { return scatter(); }\n")
    (tmp_path / "without.c").write_text("int main(void) { return 0; }\n")
    subprocess.run(["cc", "-c", "scatter.c"], cwd=tmp_path, check=True)
    subprocess.run(["ar", "rc", "lib/librenderer.a", "scatter.o"], cwd=tmp_path, check=True)
    for source, found in (("with.c", True), ("without.c", False)):
        subprocess.run(["cc", "-o", "bin/selvedged", source, "lib/librenderer.a"], cwd=tmp_path, check=True)
        assert bool(list(check_layers.check_symbols(str(tmp_path)))) == found
