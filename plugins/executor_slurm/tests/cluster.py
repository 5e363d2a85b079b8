"""A real Slurm cluster of three machines: a head and two nodes of one core each, the first with a GPU by name only."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import which

from tests.machines import PATIENCE_S, Machine, machines
from tests.supervisor.harness import eventually

COMMANDS = ("sbatch", "scancel", "scontrol", "sinfo", "squeue")
# Each node's own. It has a short name, since there are sockets in it.
SPOOL = "/mnt"
# A node is given up after a few seconds, where a real cluster waits for minutes.
CONFIGURATION = """\
ClusterName=test
SlurmctldHost=head({head})
SlurmUser=root
SlurmdUser=root
AuthType=auth/none
CredType=cred/none
StateSaveLocation={folder}/state
SlurmdSpoolDir={spool}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=bf_interval=1,sched_interval=1
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
KillWait=20
GresTypes=gpu
SlurmdParameters=config_overrides
NodeName=node1 NodeAddr={node1} CPUs=1 RealMemory=4000 Gres=gpu:1
NodeName=node2 NodeAddr={node2} CPUs=1 RealMemory=4000
PartitionName=main Nodes=node1,node2 Default=YES MaxTime=INFINITE State=UP
PartitionName=graphics Nodes=node1 State=UP
"""


@dataclass(frozen=True)
class Cluster:
    """Its machines, and what the environment of a user on the head is."""

    head: Machine
    nodes: tuple[Machine, ...]
    commands: Path
    environment: dict[str, str]

    def ask(self, *words: str) -> str:
        """Run one of Slurm's commands; return what it says."""
        command = [str(self.commands / words[0]), *words[1:]]
        environment = {**os.environ, **self.environment}
        return subprocess.run(
            command, check=True, stdout=subprocess.PIPE, text=True, timeout=PATIENCE_S, env=environment
        ).stdout


@contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    """Yield a cluster that is ready for work, with its configuration and logs in an empty folder."""
    with machines(("head", "node1", "node2")) as (head, *nodes), (folder / "output.log").open("wb") as log:
        addresses = {machine.name: machine.address for machine in (head, *nodes)}
        (folder / "state").mkdir()
        (folder / "slurm.conf").write_text(CONFIGURATION.format(folder=folder, spool=SPOOL, **addresses), "utf-8")
        (folder / "gres.conf").write_text("NodeName=node1 Name=gpu File=/dev/null\n", "utf-8")
        (folder / "cgroup.conf").touch()
        made = Cluster(head, tuple(nodes), folder / "bin", {"SLURM_CONF": str(folder / "slurm.conf")})
        _write_commands(made)
        head.start(daemon("slurmctld"), "-D", log=log, environment={**os.environ, **made.environment})
        for node in nodes:
            node.run("mount", "-t", "tmpfs", "none", SPOOL)
            node.start(daemon("slurmd"), "-D", "-N", node.name, log=log, environment={**os.environ, **made.environment})
        assert eventually(
            lambda: made.ask("sinfo", "--noheader", "--Node", "--format=%T").split() == ["idle"] * 3, PATIENCE_S
        )
        yield made


def daemon(name: str) -> str:
    """Return where a daemon is, which need not be on a user's PATH."""
    found = which(name, path=f"{os.environ['PATH']}:/usr/sbin")
    assert found is not None
    return found


def _write_commands(cluster: Cluster) -> None:
    """Make Slurm's commands work from outside the cluster's network, as if typed on its head."""
    cluster.commands.mkdir()
    for name in COMMANDS:
        path = cluster.commands / name
        spaces = f"--target {cluster.head.first_process} --net --uts"
        path.write_text(f'#!/bin/sh\nexec nsenter {spaces} -- {which(name)} "$@"\n', "utf-8")
        path.chmod(0o755)
