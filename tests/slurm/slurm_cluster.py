"""A Slurm cluster of virtual nodes on loopback, with all of its files in one folder: munged, slurmctld and a slurmd for
each node, from Debian's packages. No service of the machine is touched, and everything is stopped at the end.

with SlurmCluster(folder) as cluster: Daemon(data, options=cluster.options(), environment=cluster.environment)"""
import ctypes
import os
import shutil
import signal
import socket
import subprocess
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "scontrol", "sinfo")
PACKAGES = "munge, slurmctld, slurmd and slurm-client"
SYSTEM_PATH = os.environ.get("PATH", "") + ":/usr/local/sbin:/usr/sbin:/sbin"

CONFIGURATION = """
ClusterName=selvedge
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0,sched_min_interval=0
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SlurmdParameters=config_overrides
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
KillWait=2
MinJobAge=300
SlurmdTimeout={node_timeout_s}
NodeName=n[1-{n_node}] NodeHostname={host} NodeAddr=127.0.0.1 Port=[{first_port}-{last_port}] CPUs={n_cpu} RealMemory={memory_mb}
PartitionName=cloth Nodes=n[1-{n_node}] Default=YES MaxTime=INFINITE State=UP PriorityTier=1
PartitionName=urgent Nodes=n[1-{n_node}] MaxTime=INFINITE State=UP PriorityTier=9
"""


def missing():
    """Why no cluster can be started here, or None."""
    absent = [p for p in PROGRAMS if shutil.which(p, path=SYSTEM_PATH) is None]
    return f"the Debian packages {PACKAGES} are not installed: no {', '.join(absent)}" if absent else None


def free_ports(n):
    """The first of n neighbouring TCP ports that are free on loopback."""
    for first in range(20000 + os.getpid() % 10000, 60000, n):
        held = []
        try:
            for port in range(first, first + n):
                held.append(socket.socket())
                held[-1].bind(("127.0.0.1", port))
            return first
        except OSError:
            continue
        finally:
            for s in held:
                s.close()
    raise RuntimeError("no free ports")


def die_with_parent():
    """Has the kernel end this child with the process that made it."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)


class SlurmCluster:
    def __init__(self, folder, n_node=2, n_cpu=1, memory_mb=4000, node_timeout_s=10):
        self.folder = os.path.abspath(str(folder))
        self.nodes = [f"n{i + 1}" for i in range(n_node)]
        self.n_cpu, self.memory_mb, self.node_timeout_s = n_cpu, memory_mb, node_timeout_s
        self.configuration = os.path.join(self.folder, "slurm.conf")
        self.environment = {"SLURM_CONF": self.configuration, "PATH": SYSTEM_PATH}
        self.process = {}

    def __enter__(self):
        try:
            return self.start()
        except BaseException:
            self.stop()
            raise

    def __exit__(self, *unused):
        self.stop()

    def options(self, **more):
        """Settings of a daemon that uses the cluster."""
        return {"jobs.backend": "slurm", "jobs.workers": 64, "slurm.poll_s": 1, "slurm.file_delay_s": 2, "slurm.cores": 1,
                "slurm.memory_bytes": 600 << 20, "jobs.pass_environment": "PATH PYTHON LANG LC_ALL", **more}

    def run(self, *command, check=True):
        """What a command of Slurm prints."""
        done = subprocess.run(command, env=dict(os.environ, **self.environment), capture_output=True, text=True, check=False, timeout=300)
        if check and done.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}: {done.stderr}")
        return done.stdout

    def launch(self, name, *command):
        with open(os.path.join(self.folder, name + ".out"), "ab") as out:
            self.process[name] = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, env=dict(os.environ, **self.environment),
                start_new_session=True, preexec_fn=die_with_parent)

    def start(self):
        os.makedirs(os.path.join(self.folder, "state"), mode=0o700)
        first = free_ports(len(self.nodes) + 1)
        for name in self.nodes:
            os.mkdir(os.path.join(self.folder, "spool-" + name))
        with open(self.configuration, "w") as f:
            f.write(CONFIGURATION.format(
                host=socket.gethostname().split(".")[0], folder=self.folder, user=self.run("id", "--user", "--name").strip(),
                controller_port=first, first_port=first + 1, last_port=first + len(self.nodes), n_node=len(self.nodes),
                n_cpu=self.n_cpu, memory_mb=self.memory_mb, node_timeout_s=self.node_timeout_s))
        key = os.path.join(self.folder, "munge.key")
        with open(os.open(key, os.O_WRONLY | os.O_CREAT, 0o400), "wb") as f:
            f.write(os.urandom(1024))
        self.launch("munged", "munged", "--foreground", "--force", f"--key-file={key}", f"--socket={self.folder}/munge.sock",
                    f"--pid-file={self.folder}/munged.pid", f"--seed-file={self.folder}/munge.seed", "--num-threads=2")
        self.wait(lambda: os.path.exists(os.path.join(self.folder, "munge.sock")), "munged")
        self.start_controller()
        for name in self.nodes:
            self.start_node(name)
        self.wait(lambda: self.node_states() == ["idle"] * len(self.nodes), "the nodes")
        return self

    def node_states(self):
        return self.run("sinfo", "--noheader", "--Node", "--format=%t", "--partition=cloth", check=False).split()

    def start_controller(self):
        self.launch("slurmctld", "slurmctld", "-D")

    def start_node(self, name):
        self.launch(name, "slurmd", "-D", "-N", name)

    def wait(self, condition, what, timeout_s=30):
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            if condition():
                return
            time.sleep(0.05)
        raise RuntimeError(f"{what} did not come up within {timeout_s} s: see {self.folder}")

    def end(self, name, how=signal.SIGTERM):
        """Stops one of the programs: munged, slurmctld, or the slurmd of a node."""
        p = self.process.pop(name)
        p.send_signal(how)
        try:
            p.wait(20)
        except subprocess.TimeoutExpired:
            p.kill()
            p.wait()

    def lose_node(self, name):
        """Ends a node's slurmd and everything that runs there, as when its power fails."""
        self.end(name, signal.SIGKILL)
        found = []
        for pid in self.strays():
            with open(f"/proc/{pid}/cmdline", "rb") as f:
                watches = b"slurmstepd" in f.read()
            with open(f"/proc/{pid}/environ", "rb") as f:
                if watches or f"SLURMD_NODENAME={name}\0".encode() in f.read():
                    found.append((not watches, pid))
        for _, pid in sorted(found):  # who watches a worker first, or it would report the worker's end
            os.kill(pid, signal.SIGKILL)

    def jobs(self):
        """Slurm's jobs, {id: state}."""
        return dict(line.split("|") for line in self.run("squeue", "--noheader", "--states=all", "--format=%i|%T").split())

    def strays(self):
        """Ids of the processes that have the environment of this cluster."""
        mark = f"SLURM_CONF={self.configuration}\0".encode()
        for pid in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{pid}/environ", "rb") as f:
                    if mark in f.read() and int(pid) not in (os.getpid(), *(p.pid for p in self.process.values())):
                        yield int(pid)
            except OSError:
                continue

    def stop(self):
        if "slurmctld" in self.process:
            self.run("scancel", "--me", check=False)
        for name in [n for n in self.process if n not in ("slurmctld", "munged")] + ["slurmctld", "munged"]:
            if name in self.process:
                self.end(name)
        for pid in list(self.strays()):  # workers and their slurmstepd
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
