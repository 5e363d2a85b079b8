"""Workers as detached actors."""

import hashlib
import uuid
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import ray

from benchbot.plugin import WorkOrder
from benchbot_executor_ray import cluster, options
from benchbot_executor_ray.actors import Actors
from benchbot_executor_ray.worker_actor import Work, WorkerActor

RESTARTS = 5
"""So often a worker may lose its node, or be ended by Ray for want of memory, and begin anew."""
CALLS_AT_ONCE = 4
"""`run` waits all the time; `problem` and `stop` are asked meanwhile."""


def check(order: WorkOrder) -> tuple[dict[str, float], str]:
    """Return what a worker needs, by Ray's names, and the cluster's address; raises BenchbotError as `launch` does."""
    options.check(order)
    asked = options.resources(order)
    address = cluster.connect(options.address(order))
    cluster.check_offered(asked)
    return asked, address


def launch(order: WorkOrder, environment: Mapping[str, str]) -> Actors:
    """Create the actors, whose workers have the driver's `environment`.

    Raises BenchbotError when there is no cluster, or none of its nodes could ever run them.
    """
    asked, address = check(order)
    order = replace(order, folder=order.folder.resolve())
    batch = hashlib.sha256(str(order.folder).encode()).hexdigest()[:8]
    namespace = f"benchbot-{batch}-{uuid.uuid4().hex[:8]}"
    work = Work(order.plan, order.logs, order.command, dict(environment), order.resources.time_s, Path.cwd())
    own = {name: amount for name, amount in asked.items() if name not in cluster.STANDARD}
    actor = ray.remote(WorkerActor)
    for number in range(order.count):
        actor.options(
            name=f"worker-{number}",
            namespace=namespace,
            lifetime="detached",
            max_restarts=RESTARTS,
            max_concurrency=CALLS_AT_ONCE,
            scheduling_strategy="SPREAD",
            num_cpus=asked.get("CPU", 0),
            num_gpus=asked.get("GPU", 0),
            memory=asked.get("memory") or None,
            resources=own,
        ).remote(work)
    return Actors(address, namespace, asked)
