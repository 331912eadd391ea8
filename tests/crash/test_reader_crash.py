"""A reader's library crashes in a real worker of a real daemon: the job's error names the file and the reader, in the judgement of the files
before the job starts, and in the job itself. The library is preloaded; the product knows nothing of it."""
import os
import shutil
import subprocess

import pytest
from daemon_under_test import BUILD, Daemon, program
from scan_file import page16, tiff

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
NAME = "Probe ö 3.tif"
# libtiff's call for samples crashes, in the process that judges files or in the one that runs the job
LIBRARY = r"""
#include <string.h>
#include <sys/types.h>
static int judges;
__attribute__((constructor)) static void look(int argc, char **argv)
{
    for (int i = 0; i < argc; i++) judges = judges || strncmp(argv[i], "--check", 7) == 0;
}
ssize_t TIFFReadEncodedStrip(void *tiff, unsigned strip, void *to, ssize_t n)
{
    (void)tiff, (void)strip, (void)to;
    if (judges == WHILE_JUDGED) *(volatile int *)0 = 1;
    memset(to, (int)(strip % 251), (size_t)n);
    return n;
}
"""


def crashing_daemon(folder, while_judged):
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    if "asan" in BUILD:
        pytest.skip("the address sanitizer wants to be loaded first, and has a handler of its own")
    (folder / "crash.c").write_text(LIBRARY)
    subprocess.run([compiler, "-shared", "-fPIC", f"-DWHILE_JUDGED={while_judged}", "-o", folder / "crash.so", folder / "crash.c"], check=True)
    return Daemon(folder / "data", worker=program("selvedge-worker"), options={"jobs.pass_environment": "PATH LANG LD_PRELOAD"},
                  environment={"LD_PRELOAD": str(folder / "crash.so")})


def start(d):
    job = d.create({"sample": "s", "volume": {"files": [NAME], "voxel_size_um": 2}})
    d.upload(job, NAME, tiff([page16(lambda x, y, k=k: (7 * x + 11 * y + k) % 200, 24, 20) for k in range(12)], 24, 20))
    return job, d.post(f"/v1/jobs/{job}/start")


def test_a_job_names_the_file_and_its_reader(tmp_path):
    with crashing_daemon(tmp_path, 0) as d:
        job, reply = start(d)
        assert reply.status_code == 202
        error = d.wait_state(job, "failed", timeout_s=60)["error"]
        assert error["code"] == "worker_lost"
        assert error["text"].endswith(f"it crashed while it read '{NAME}' (TIFF)"), error["text"]


def test_the_judgement_before_the_start_names_them(tmp_path):
    with crashing_daemon(tmp_path, 1) as d:
        job, _ = start(d)
        judged = d.post(f"/v1/jobs/{job}/check").json()
        assert not judged["valid"]
        assert judged["errors"] == [{"code": "worker_lost", "field": "",
                                     "detail": f"the program that reads the files crashed while it read '{NAME}' (TIFF)"}]
