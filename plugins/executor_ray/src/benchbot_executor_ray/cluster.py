"""The connection to a Ray cluster, and what its nodes offer."""

import logging
import os
import socket
from collections.abc import Mapping
from typing import Any

import ray
from ray._private import services

from benchbot.plugin import BenchbotError

LISTENING_S = 10.0
STANDARD = {"CPU": "cores", "GPU": "GPUs", "memory": "GiB of memory"}


def connect(address: str) -> str:
    """Connect this process to a cluster, and return its address.

    Raises BenchbotError when there is none that can be used. Connects once: a process may be connected to one cluster.
    """
    if ray.is_initialized():
        connected = str(ray.get_runtime_context().gcs_address)
        if address in ("auto", connected):
            return connected
        ray.shutdown()
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        _check_listening(address)
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR, configure_logging=False)
    except (OSError, RuntimeError, ValueError) as error:
        where = "on this machine" if address == "auto" else f"at {address}"
        raise BenchbotError(
            f"There is no Ray cluster {where} that can be used.",
            f"Ray says: {str(error).splitlines()[0] if str(error) else type(error).__name__}",
            "Start one (ray start --head; on the other nodes ray start --address=HEAD:6379), run this on one of its "
            "nodes, and name another address by --executor-option address=HEAD:6379.",
        ) from error
    return str(ray.get_runtime_context().gcs_address)


def _check_listening(address: str) -> None:
    """Raise OSError or ValueError if no server listens there: Ray itself would try for more than ten minutes."""
    if address.startswith("ray://"):
        return
    host, _, port = services.canonicalize_bootstrap_address_or_die(address).rpartition(":")
    socket.create_connection((host.strip("[]"), int(port)), LISTENING_S).close()


def nodes() -> list[dict[str, Any]]:
    """Return the nodes that are alive, as Ray describes them."""
    return [node for node in ray.nodes() if node["Alive"]]  # type: ignore[no-untyped-call]


def offered(asked: Mapping[str, float]) -> bool:
    """Return whether some node has all of it when nothing else runs there."""
    return any(all(node["Resources"].get(name, 0) >= amount for name, amount in asked.items()) for node in nodes())


def described(resources: Mapping[str, float]) -> str:
    """Return resources in words, leaving out what Ray adds for itself."""
    own = {
        name: amount for name, amount in resources.items() if not name.startswith(("node:", "object_store", "accel"))
    }
    if "memory" in own:
        own["memory"] /= 2**30
    return ", ".join(f"{amount:.3g} {STANDARD.get(name, name)}" for name, amount in sorted(own.items())) or "nothing"


def check_offered(asked: Mapping[str, float]) -> None:
    """Raise BenchbotError if no node has the requested resources: Ray itself would wait for ever, silently."""
    if not offered(asked):
        offers = "; ".join(f"{node['NodeManagerHostname']}: {described(node['Resources'])}" for node in nodes())
        raise BenchbotError(
            "No node of the Ray cluster can run a worker.",
            f"A worker needs {described(asked)}. The nodes have {offers or 'all gone'}.",
            "Ask for less (--cpus, --gpus, --memory-gb, --executor-option num_gpus=0.5), or add a node (ray start).",
        )
