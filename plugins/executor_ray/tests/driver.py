"""A driver of batches on a machine of the cluster: JSON requests by line on stdin, JSON answers on stdout."""

import json
import sys
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.core.records import Resources, Workers, WorkOrder
from benchbot_executor_ray.plugin import benchbot_executors

(EXECUTOR,) = benchbot_executors()
known: dict[str, Workers] = {}


def answer(request: dict[str, Any]) -> Any:
    """Do what is asked: `launch` an order, or `alive` or `stop` of a reference."""
    if request["do"] == "launch":
        order = request["order"]
        resources = Resources(**order.pop("resources"))
        folder, command = Path(order.pop("folder")), tuple(order.pop("command"))
        workers = EXECUTOR.launch(WorkOrder(folder, command, resources=resources, **order))
        known[workers.reference] = workers
        return workers.reference
    reference = request["reference"]
    if reference not in known:
        known[reference] = EXECUTOR.attach(reference)
    return known[reference].alive() if request["do"] == "alive" else known[reference].stop()


for line in sys.stdin:
    try:
        print(json.dumps({"answer": answer(json.loads(line))}), flush=True)
    except BenchbotError as error:
        print(json.dumps({"error": error.as_dict()}), flush=True)
