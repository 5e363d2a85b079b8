"""`python -m benchbot_executor_ray.helper`: the connection to Ray, in a process of its own.

Ray prints on stdout what happens in the cluster, and ends the process when the cluster's head is lost; neither may
happen to a driver. Requests are lines of JSON on stdin, `{number, do, …}`; answers are lines on stdout, `{number,
answer}` or `{number, error}`. It ends with stdin.
"""

import json
import os
import sys
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError, Resources, WorkOrder
from benchbot_executor_ray.actors import Actors
from benchbot_executor_ray.launching import check, launch


def main() -> None:
    """Answer until stdin ends."""
    known: dict[str, Actors] = {}
    # What Ray prints goes to stderr, which is kept for when the helper is lost.
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as answers:
        os.dup2(2, 1)
        for line in sys.stdin:
            request = json.loads(line)
            try:
                said = {"answer": _answer(request, known)}
            except BenchbotError as error:
                said = {"error": error.as_dict()}
            answers.write(json.dumps({"number": request["number"], **said}) + "\n")
            answers.flush()


def _answer(request: dict[str, Any], known: dict[str, Actors]) -> Any:
    if "order" in request:
        plain = {**request["order"], "folder": Path(request["order"]["folder"])}
        order = WorkOrder(**{**plain, "command": tuple(plain["command"]), "resources": Resources(**plain["resources"])})
        if request["do"] == "check":
            return check(order)[1]
        workers = launch(order, request["environment"])
        known[workers.reference] = workers
        return workers.reference
    reference = request["reference"]
    if reference not in known:
        known[reference] = Actors.attach(reference)
    return known[reference].alive() if request["do"] == "alive" else known[reference].stop()


if __name__ == "__main__":
    main()
