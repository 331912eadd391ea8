"""The Debian package in a fresh Debian 12, first without systemd: install, run a job, upgrade, remove, purge; then under
a systemd of its own, which runs the unit with all that hardens it: a secret handed over, and a job (`make test-deb`).

Needs root, a network and mmdebstrap; says why and ends with 0 where one of them is missing. The chroot stays in
build/deb/chroot, so that a second run needs no network but for packages; --fresh makes it anew."""
import argparse
import contextlib
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support" / "python"))
import small_cloth  # noqa: E402

PORT = 17878
CONF = "etc/selvedge/selvedge.conf"
DATA = "var/lib/selvedge"
DOCUMENT = {"sample": "packaged", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
            "fit": {"path_budget": 20000}}
APT = ["apt-get", "install", "--yes", "--no-install-recommends", "-o", "Dpkg::Options::=--force-confdef", "-o", "Dpkg::Options::=--force-confold"]


def say(text):
    print(f"== {text}", flush=True)


def newest_package(folder):
    found = sorted(folder.glob("selvedge_*.deb"), key=lambda path: path.stat().st_mtime)
    if not found:
        sys.exit(f"error: there is no package in {folder}: run make deb")
    return found[-1]


def higher_version(package, folder):
    """The same package with a higher version and another default configuration."""
    tree = folder / "higher"
    shutil.rmtree(tree, ignore_errors=True)
    subprocess.run(["dpkg-deb", "--raw-extract", package, tree], check=True)
    control = tree / "DEBIAN" / "control"
    control.write_text(re.sub(r"^Version: (.*)$", r"Version: \1+higher", control.read_text(), flags=re.M))
    with open(tree / CONF, "a", encoding="utf-8") as conf:
        conf.write("; the default of a later version\n")
    higher = folder / "selvedge-higher.deb"
    subprocess.run(["dpkg-deb", "--root-owner-group", "--build", tree, higher], check=True, stdout=subprocess.DEVNULL)
    return higher


class Chroot:
    def __init__(self, path):
        self.path = path

    def run(self, *command, check=True, **more):
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive"}
        p = subprocess.run(["chroot", self.path, *command], env=environment, capture_output=True, text=True, **more)
        if check and p.returncode != 0:
            raise AssertionError(f"{shlex.join(command)} ended with {p.returncode}:\n{p.stdout[-2000:]}{p.stderr[-2000:]}")
        return p

    def install(self, package):
        shutil.copy(package, self.path / "tmp" / "selvedge.deb")
        return self.run(*APT, "/tmp/selvedge.deb").stdout

    @contextlib.contextmanager
    def daemon(self):
        """Runs ExecStart of the unit as the unit's user, with the folders that systemd would make."""
        unit = (self.path / "lib/systemd/system/selvedge.service").read_text()
        command = shlex.split(re.search(r"^ExecStart=(.*)$", unit, flags=re.M).group(1))
        user = re.search(r"^User=(.*)$", unit, flags=re.M).group(1)
        self.run("install", "-d", "-m", "700", "-o", user, "-g", user, "/" + DATA)
        with open(self.path.parent / "daemon.log", "ab") as log:
            process = subprocess.Popen(["chroot", f"--userspec={user}:{user}", self.path, *command], stdout=subprocess.PIPE, stderr=log, text=True,
                                       env={"PATH": "/usr/sbin:/usr/bin:/bin", "LC_ALL": "C.UTF-8"})
        try:
            line = process.stdout.readline()
            assert line.startswith("selvedged listens on "), f"no start; see {self.path.parent / 'daemon.log'}"
            yield line.split()[-1]
        finally:
            process.terminate()
            assert process.wait(60) == 0


def get(url, path):
    with urllib.request.urlopen(url + path, timeout=150) as reply:
        return reply.read()


def results(url, job):
    return hashlib.sha256(get(url, f"/v1/jobs/{job}/results/result.json")).hexdigest()


def write_sample(sample):
    sample.mkdir(exist_ok=True)
    (sample / "job.json").write_text(json.dumps(DOCUMENT))
    (sample / "cloth.hair").write_bytes(small_cloth.hair())
    (sample / "rows.csv").write_text(small_cloth.TABLE)


def run_a_job(chroot, url):
    write_sample(chroot.path / "tmp" / "sample")
    job = chroot.run("selvedge", "submit", "--server", url, "/tmp/sample/job.json", timeout=300).stdout.split()[-1]
    end = time.monotonic() + 300
    while time.monotonic() < end:
        state = json.loads(get(url, f"/v1/jobs/{job}"))
        if state["state"] in ("succeeded", "failed"):
            break
        time.sleep(0.5)
    assert state["state"] == "succeeded", state
    return job


def make_chroot(path):
    if (path / "usr/bin/apt-get").exists():
        return
    say("a new Debian 12 (minbase)")
    path.parent.mkdir(parents=True, exist_ok=True)
    made = subprocess.run(["mmdebstrap", "--variant=minbase", "--mode=root", "bookworm", path], capture_output=True, text=True)
    if made.returncode != 0:
        shutil.rmtree(path, ignore_errors=True)
        print(f"skipped: mmdebstrap could make no Debian 12: {made.stderr.strip().splitlines()[-1]}")
        sys.exit(0)
    # no service is started by its package, as without systemd
    (path / "usr/sbin/policy-rc.d").write_text("#!/bin/sh\nexit 101\n")
    (path / "usr/sbin/policy-rc.d").chmod(0o755)


def lifecycle(chroot, package):
    say(f"installs {package.name}")
    chroot.run("apt-get", "update")
    chroot.run("apt-get", "purge", "--yes", "selvedge", check=False)
    shutil.rmtree(chroot.path / DATA, ignore_errors=True)
    chroot.install(package)
    assert chroot.run("id", "-u", "selvedge").stdout.strip() != "0"
    assert (chroot.path / "etc/selvedge/secrets").stat().st_mode & 0o777 == 0o700
    conf = chroot.path / CONF
    changed = conf.read_text().replace("port = 7878", f"port = {PORT}")
    assert str(PORT) in changed
    conf.write_text(changed)

    (chroot.path / "etc/selvedge/secrets/webhook").write_text("a secret of the laboratory")

    say("runs a job by the unit's command, as its user, with a changed configuration")
    with chroot.daemon() as url:
        assert url == f"http://127.0.0.1:{PORT}"
        for path in ("/", "/v1/openapi.json", "/vendor/dygraph.min.js", "/vendor/three.min.js"):
            assert get(url, path), path
        job = run_a_job(chroot, url)
        before = results(url, job)

    say("upgrades to a higher version")
    chroot.install(higher_version(package, chroot.path.parent))
    assert "+higher" in chroot.run("dpkg-query", "-W", "selvedge").stdout
    assert conf.read_text() == changed, "the changed configuration is kept"
    assert "a later version" in (chroot.path / (CONF + ".dpkg-dist")).read_text()
    with chroot.daemon() as url:
        assert results(url, job) == before and url.endswith(str(PORT))

    say("removes: data and configuration stay")
    chroot.run("apt-get", "remove", "--yes", "selvedge")
    assert not (chroot.path / "usr/bin/selvedged").exists() and conf.read_text() == changed
    assert (chroot.path / DATA / "jobs" / job / "results" / "result.json").exists()

    say("purges: the configuration goes, the data stays and is named")
    said = chroot.run("apt-get", "purge", "--yes", "selvedge")
    assert "/var/lib/selvedge" in said.stdout + said.stderr
    assert not (chroot.path / "etc/selvedge").exists()
    assert (chroot.path / DATA / "jobs" / job / "results" / "result.json").exists()
    assert chroot.run("id", "-u", "selvedge").stdout.strip() != "0", "the owner of the data stays"


# systemd as first process of a container: it needs mounts that are shared, a hierarchy of control groups and these devices
BOOT = """
set -e
mount --make-rprivate /
mount --bind {0} {0} && cd {0}
mount -t proc proc proc
mount -t sysfs -o ro sysfs sys
mount -t tmpfs -o mode=755 cgroup sys/fs/cgroup
mkdir sys/fs/cgroup/unified sys/fs/cgroup/systemd
mount -t cgroup2 cgroup2 sys/fs/cgroup/unified
mount -t cgroup -o none,name=systemd,xattr cgroup sys/fs/cgroup/systemd || true
mount -t tmpfs -o mode=755 run run
mount -t tmpfs tmp tmp
mount -t tmpfs -o mode=755,nosuid dev dev
for d in null zero full random urandom tty; do touch dev/$d; mount --bind /dev/$d dev/$d; done
mkdir dev/mqueue dev/hugepages dev/pts dev/shm
ln -s pts/ptmx dev/ptmx
mount -t tmpfs shm dev/shm
mkdir -p old && pivot_root . old && umount -l old
mount --make-rshared /
exec env -i container=selvedge PATH=/usr/sbin:/usr/bin:/sbin:/bin /lib/systemd/systemd
"""


# only the chroot has this file; before systemd has entered it, its process still sees the machine's own files
MARK = "etc/selvedge-test-chroot"


class Booted:
    """The chroot with systemd as its first process."""

    def __init__(self, path):
        script = BOOT.format(shlex.quote(str(path)))
        (path / MARK).touch()
        self.process = subprocess.Popen(["unshare", "--mount", "--pid", "--fork", "--kill-child", "--cgroup", "--uts", "--ipc", "bash", "-c", script],
                                        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def __enter__(self):
        end = time.monotonic() + 60
        while time.monotonic() < end and self.process.poll() is None:
            if self.run("systemctl is-system-running --wait", check=False).stdout.strip() in ("running", "degraded"):
                return self
            time.sleep(0.5)
        self.process.kill()
        return None

    def __exit__(self, *unused):
        self.process.kill()
        self.process.wait()

    def run(self, script, check=True):
        children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        first = children.read_text().split() if children.exists() else []
        enter = ["nsenter", "--target", first[0] if first else "0", "--mount", "--pid", "--uts", "--ipc", "--cgroup", "sh", "-c",
                 f"[ -e /{MARK} ] || exit 97\n{script}"]
        p = subprocess.run(enter, env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive"},
                           capture_output=True, text=True, timeout=1500)
        assert p.returncode == 0 or not check, f"{script}:\n{p.stdout[-2000:]}{p.stderr[-2000:]}"
        return p


def under_systemd(chroot, package):
    say("boots systemd")
    shutil.copy(package, chroot.path / "root" / "selvedge.deb")
    deny = chroot.path / "usr/sbin/policy-rc.d"
    deny.rename(deny.with_suffix(".off"))
    try:
        with Booted(chroot.path) as booted:
            if booted is None:
                print("skipped: systemd cannot run here as the first process of a container")
                return
            say("installs, which starts the unit")
            booted.run("apt-get install --yes --no-install-recommends /root/selvedge.deb")
            booted.run("systemctl is-active selvedge")
            say("hands a secret over, and runs a job in the worker's sandbox")
            booted.run(f"sed -i 's/^port = 7878/port = {PORT}/' /{CONF}; echo 'a secret of the laboratory' > /etc/selvedge/secrets/webhook")
            booted.run(f"printf '[webhook]\\nurl = http://127.0.0.1:1/\\nsecret_file = /run/credentials/selvedge.service/secret_webhook\\n' >> /{CONF}")
            booted.run("systemctl restart selvedge; sleep 2; systemctl is-active selvedge")
            write_sample(chroot.path / "root" / "sample")
            booted.run(f"selvedge submit --watch --server http://127.0.0.1:{PORT} /root/sample/job.json")
            assert "the worker runs in a sandbox" in booted.run(f"cat /{DATA}/jobs/*/log.txt").stdout
            say("purges, which stops it")
            booted.run("apt-get purge --yes selvedge")
            assert booted.run("systemctl is-active selvedge", check=False).returncode != 0
    finally:
        deny.with_suffix(".off").rename(deny)
        shutil.rmtree(chroot.path / DATA, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fresh", action="store_true", help="make the chroot anew")
    arguments = parser.parse_args()
    folder = ROOT / "build" / "deb"
    for missing, why in ((os.geteuid() != 0, "this needs root"), (shutil.which("mmdebstrap") is None, "mmdebstrap is not installed")):
        if missing:
            print(f"skipped: {why}")
            return
    chroot = Chroot(folder / "chroot")
    if arguments.fresh:
        shutil.rmtree(chroot.path, ignore_errors=True)
    make_chroot(chroot.path)
    mounted = [("proc", "proc"), ("sysfs", "sys")]
    for kind, at in mounted:
        subprocess.run(["mount", "-t", kind, kind, chroot.path / at], check=True)
    try:
        lifecycle(chroot, newest_package(folder))
    finally:
        for _, at in mounted:
            subprocess.run(["umount", chroot.path / at], check=False)
    shutil.rmtree(chroot.path / DATA, ignore_errors=True)
    under_systemd(chroot, newest_package(folder))
    say("passed")


if __name__ == "__main__":
    main()
