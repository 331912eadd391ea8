"""Parts of the tree whose tests are judged, and faults that are known to have no effect."""
import pathlib
import re

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
LANGUAGE = {".c": "c", ".js": "js", ".py": "py"}

# Each part: the beginnings of the paths of its files; the beginnings of the names of the tests that are asked about it, which
# leave out tests that take minutes or reach these files by chance; and tests that are run for every fault of it, because
# counters of lines do not reach there: they test processes that end without writing their counters.
GATE = {
    "sandbox": (["optimizer/worker/sandbox/sandbox_", "optimizer/worker/sandbox/worker_confine"],
                ["unit/optimizer/worker/sandbox/", "api/service/test_sandbox", "api/worker/geometry/test_geometry_only_job"],
                ["unit/optimizer/worker/sandbox/", "api/service/test_sandbox", "api/worker/geometry/test_geometry_only_job"]),
    "store": (["server/store/"], ["unit/server/", "api/access/test_owners", "api/access/test_tokens", "api/batches/test_batches",
                                  "api/service/test_backup", "api/service/test_list", "api/test_durable_replies", "api/test_jobs_api"], []),
    "retention": (["server/retention/"], ["unit/server/retention/", "api/service/test_retention"], []),
    "uncertainty": (["optimizer/fit/linear/uncertainty", "optimizer/fit/linear/linear_", "optimizer/fit/objective/product_noise",
                     "optimizer/fit/cloth/carried_error", "geometry/fibers/shape/radius_choose"],
                    ["unit/optimizer/fit/", "unit/geometry/fibers/"], []),
    "readers": (["geometry/volume/format/", "geometry/volume/format/voxel_stream", "geometry/volume/format/volume_source", "geometry/volume/format/sample_type",
                 *(f"optimizer/photographs/reader/{name}" for name in ("declared_color", "exif", "float_dng", "integer_samples", "photograph_reader", "read_",
                                                                       "saturation", "tiff_statements", "xmp")),
                 *(f"optimizer/photographs/rows/{name}" for name in ("brdf_", "number_table", "table_text", "tensor_file"))],
                ["unit/geometry/volume/", "unit/optimizer/photographs/", "api/photographs/test_measured_brdf", "api/worker/test_scan_statements"],
                ["api/worker/test_scan_statements"]),
}
WHOLE = {name: ([name + "/"], ["unit/", "api/"], [])
         for name in ("base", "geometry", "renderer", "optimizer", "server", "clients/cli", "clients/dashboard", "clients/python")}


def files_of(tree, part):
    """Paths of the sources of a part, relative to the tree."""
    found = []
    for beginning in part[0]:
        folder = tree / beginning
        for path in sorted((folder if beginning.endswith("/") else folder.parent).rglob("*")):
            name = str(path.relative_to(tree))
            if name.startswith(beginning) and path.suffix in LANGUAGE and path.is_file() and not name.endswith("_main.c"):
                found.append(name)
    return found


class Explained:
    """Faults that change nothing which anyone could see, each with its reason (explained.txt)."""

    ENTRY = re.compile(r"^(?P<file>[^:\s]+): (?P<reason>.+)\n  - (?P<before>.*)\n  \+ (?P<after>.*)$", re.M)

    def __init__(self, text=None):
        text = (HERE / "explained.txt").read_text() if text is None else text
        body = "\n".join(line for line in text.split("\n") if not line.startswith("#"))
        self.reason = {(m["file"], m["before"].strip(), m["after"].strip()): m["reason"] for m in self.ENTRY.finditer(body)}
        self.n_unread = len([line for line in body.split("\n") if line.strip()]) - 3 * len(self.reason)

    def reason_of(self, path, before, after):
        return self.reason.get((path, before, after))
