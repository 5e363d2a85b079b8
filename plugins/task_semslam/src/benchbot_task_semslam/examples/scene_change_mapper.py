"""Scene change detection: map both visits, and report the objects that only one of the maps has.

A loop of its own, as an alternative to an Agent. What one visit never looked at is not called a change.
"""

import json
from pathlib import Path

from benchbot.api import ActionResult, BenchBot
from benchbot.mapping import ObjectMap, Views, changes, confirmed, describe_changes


def visit(benchbot: BenchBot) -> tuple[ObjectMap, Views, ActionResult]:
    """Follow the trajectory of the current scene to its end; return what was seen, and how it ended."""
    objects, views = ObjectMap(), Views()
    observations, result = benchbot.step(None)
    while True:
        objects.add(observations)
        views.add(observations)
        if result is not ActionResult.SUCCESS:
            return objects, views, result
        observations, result = benchbot.step("move_next")


def main() -> None:
    """Visit both scenes and save their difference."""
    benchbot = BenchBot()
    benchbot.reset()
    before, views_before, result = visit(benchbot)
    document = benchbot.empty_results()
    if result is not ActionResult.COLLISION and benchbot.next_scene():
        after, views_after, _ = visit(benchbot)
        found = confirmed(changes(before.objects, after.objects), views_before, views_after)
        document["results"]["objects"] = describe_changes(found, document["results"])
        for item, state in found:
            print(f"{state}: {item.label}")
        print(f"{len(found)} changes")
    Path(benchbot.result_filename).write_text(json.dumps(document), encoding="utf-8")


if __name__ == "__main__":
    main()
