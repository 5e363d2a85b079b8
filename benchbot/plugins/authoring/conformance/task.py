"""The conformance of tasks."""

import json
from functools import partial

from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Finding, Level
from benchbot.plugins.authoring.conformance.bench import Declared, Found, find
from benchbot.plugins.authoring.conformance.properties import Wrong, look


def check_task(task: Declared, *, catalog: Catalog | None = None) -> list[Finding]:
    """Return what is right and wrong with a task: its declaration, its results format, its method, who can run it.

    `catalog` is what is installed, where that has been read already.
    """
    from benchbot.core.plugin_manager import load

    known = catalog or Catalog(load())
    found: list[Found] = []

    def declared() -> str:
        found.append(find("tasks", task, known))
        return str(found[0].data["name"])

    findings = [look("declaration", declared)]
    if found:
        findings += [
            look("description", partial(describes_itself, found[0])),
            look("results format", partial(_has_a_format, known, found[0])),
            look("evaluation", partial(_can_be_scored, known, found[0])),
            look("episodes", partial(_has_episodes, known, found[0])),
            look("robots", partial(_has_a_robot, known, found[0])),
        ]
    return findings


def describes_itself(found: Found) -> str:
    """People who choose from a list are told what it is."""
    if not found.data.get("description"):
        raise Wrong("It has no description.", "Add a line 'description: …': people choose by it.", Level.WARNING)
    return str(found.data["description"])


def _has_a_format(catalog: Catalog, found: Found) -> str:
    name = found.data.get("results_format")
    if name is None:
        return "none: results are what solutions make of them"
    declaration = catalog.get("formats", name)
    if "create" not in formats.functions(declaration):
        raise Wrong(f"The format '{name}' has no function 'create'.", "Add one that returns an empty result.")
    created = formats.call(declaration, "create", [], {})
    try:
        json.dumps(created, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise Wrong(f"What create() of '{name}' returns is not JSON: {error}.", "Return plain data.") from error
    formats.validate(declaration, created)
    return f"{name}: {', '.join(declaration.data['functions'])}"


def _can_be_scored(catalog: Catalog, found: Found) -> str:
    name, results = found.data.get("evaluation_method"), found.data.get("results_format")
    methods = catalog.plugins.pool("evaluators")
    if name is not None:
        method = catalog.plugins.record("evaluators", name)
        if results not in method.result_formats:
            raise Wrong(
                f"The method '{name}' does not read results of the format '{results}'.",
                f"Name a method that does; it reads {', '.join(sorted(method.result_formats))}.",
            )
        return str(name)
    able = [known for known, method in methods.items() if results in method.value.result_formats]
    if results is not None and len(able) != 1:
        raise Wrong(
            f"{'Several methods read' if able else 'No installed method reads'} the format '{results}'.",
            "Name one with 'evaluation_method: …'.",
            Level.WARNING,
        )
    return ", ".join(able) or "none"


def _has_episodes(catalog: Catalog, found: Found) -> str:
    name = found.data.get("episodes")
    if name is None:
        return "none: starts where the environment says"
    lists = [known for known in catalog.names("episodes") if known.startswith(f"{name}:")]
    if not lists:
        raise Wrong(f"There is no list of episodes '{name}'.", "Install one, or yield it from benchbot_episodes.")
    return f"in {len(lists)} environments"


def _has_a_robot(catalog: Catalog, found: Found) -> str:
    from benchbot.core.channels import GIVEN_BY_EPISODES

    wanted = {*found.data["actions"], *found.data["observations"]} - GIVEN_BY_EPISODES
    able = [name for name, robot in catalog.pool("robots").items() if wanted <= set(robot.data["connections"])]
    if not able:
        raise Wrong(
            "No installed robot has all that it observes and does.",
            f"Install one that has {', '.join(sorted(wanted))}.",
            Level.WARNING,
        )
    return ", ".join(able)
