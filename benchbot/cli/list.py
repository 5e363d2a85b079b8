"""`benchbot list`: everything that is installed, by kind."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from benchbot.cli.kit import console
from benchbot.cli.kit.options import QUICK, Json, group

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Declaration
    from benchbot.core.plugin_manager import Plugins

app = group("List everything of a kind that is installed.")

Columns = dict[str, Callable[[dict[str, Any]], Any]]

DECLARED: dict[str, tuple[str, Columns]] = {
    "tasks": (
        "List what a solution can be asked to do.",
        {
            "actions": lambda task: task.get("actions"),
            "localisation": lambda task: task.get("localisation", "ground_truth"),
            "scenes": lambda task: task.get("scene_count", 1),
            "results_format": lambda task: task.get("results_format"),
        },
    ),
    "robots": ("List the robots, simulated and real.", {"type": lambda robot: robot.get("type")}),
    "environments": (
        "List the environments, as name:variant.",
        {
            "type": lambda environment: environment.get("type"),
            "trajectory_poses": lambda environment: len(environment.get("trajectory_poses") or ()),
        },
    ),
    "formats": (
        "List the formats of results and ground truths.",
        {"functions": lambda declared: list(declared.get("functions") or ())},
    ),
    "examples": ("List the example solutions.", {"description": lambda example: example.get("description")}),
    "episodes": (
        "List the episodes: starts and goals in an environment.",
        {"episodes": lambda listed: len(listed.get("episodes") or ())},
    ),
    "batches": (
        "List the batches: named lists of environments.",
        {"environments": lambda batch: batch.get("environments")},
    ),
}
"""Kinds of declarations: a help line, and what is worth seeing of each at a glance."""


def declared(kind: str, as_json: bool = False) -> None:
    """Print a pool of declarations."""
    from benchbot.core.declarations.catalog import Catalog

    _, columns = DECLARED[kind]
    catalog = Catalog(_loaded())
    pool = catalog.pool(kind)
    for error in catalog.broken:
        console.note(f"Left out: {error.title} {error.why}")
    rows = [_row(pool[name], columns) for name in sorted(pool)]
    _print(rows, ["name", *columns, "distribution"], as_json)


def _loaded() -> "Plugins":
    """Return the loaded plug-ins; say on stderr which ones could not be loaded, since their things are not listed."""
    from benchbot.core.plugin_manager import load

    hint = load().broken_hint().strip()
    if hint:
        console.note(f"{hint} See: benchbot doctor")
    return load()


def _row(declaration: "Declaration", columns: Columns) -> dict[str, Any]:
    values = {name: read(declaration.data) for name, read in columns.items()}
    origin = {"distribution": declaration.distribution, "path": str(declaration.path)}
    return {"name": declaration.name, **values, **origin}


def _print(rows: list[dict[str, Any]], columns: list[str], as_json: bool) -> None:
    if as_json:
        console.data_json(rows)
    else:
        console.table(columns, ([_cell(row[column]) for column in columns] for row in rows))


def _cell(value: Any) -> str:
    if isinstance(value, list):
        return ",".join(map(str, value)) or "-"
    return "-" if value is None else " ".join(str(value).split())


def _add_command(kind: str, help_line: str) -> None:
    @app.command(kind, help=help_line, context_settings=QUICK)
    def command(as_json: Json = False) -> None:
        declared(kind, as_json)


for _kind, (_help_line, _columns) in DECLARED.items():
    _add_command(_kind, _help_line)


@app.command("methods", context_settings=QUICK)
def methods(as_json: Json = False) -> None:
    """List the methods of evaluation."""
    rows = [
        {
            "name": name,
            "version": provided.value.version,
            "headline": provided.value.headline or None,
            "result_formats": sorted(provided.value.result_formats),
            "ground_truth_formats": sorted(provided.value.ground_truth_formats),
            "distribution": provided.distribution,
        }
        for name, provided in sorted(_loaded().pool("evaluators").items())
    ]
    _print(rows, ["name", "version", "headline", "result_formats", "distribution"], as_json)


@app.command("simulators", context_settings=QUICK)
def simulators(as_json: Json = False) -> None:
    """List what robots run on: simulators, and drivers of real robots."""
    loaded = _loaded()
    rows = [
        {"name": name, "kind": noun, "distribution": provided.distribution}
        for kind, noun in (("simulators", "simulator"), ("robot_drivers", "driver"))
        for name, provided in sorted(loaded.pool(kind).items())
    ]
    _print(rows, ["name", "kind", "distribution"], as_json)


@app.command("executors", context_settings=QUICK)
def executors(as_json: Json = False) -> None:
    """List where the workers of a batch can run."""
    rows = [
        {"name": name, "description": provided.value.description, "distribution": provided.distribution}
        for name, provided in sorted(_loaded().pool("executors").items())
    ]
    _print(rows, ["name", "description", "distribution"], as_json)


@app.command("recorders", context_settings=QUICK)
def recorders(as_json: Json = False) -> None:
    """List what --record and benchbot record can write."""
    rows = [
        {"name": name, "description": provided.value.description or None, "distribution": provided.distribution}
        for name, provided in sorted(_loaded().pool("recorders").items())
    ]
    _print(rows, ["name", "description", "distribution"], as_json)


@app.command("modes", context_settings=QUICK)
def modes(as_json: Json = False) -> None:
    """List the ways to hold a solution while it runs."""
    rows = [
        {"name": name, "description": provided.value.description or None, "distribution": provided.distribution}
        for name, provided in sorted(_loaded().pool("submission_modes").items())
    ]
    _print(rows, ["name", "description", "distribution"], as_json)


@app.command("commands", context_settings=QUICK)
def commands(as_json: Json = False) -> None:
    """List the commands that plug-ins add to benchbot."""
    rows = [
        {"name": name, "help": provided.value.help, "distribution": provided.distribution}
        for name, provided in sorted(_loaded().pool("commands").items())
    ]
    _print(rows, ["name", "help", "distribution"], as_json)


@app.command("plugins", context_settings=QUICK)
def plugins(as_json: Json = False) -> None:
    """List the installed plug-ins, and add-ons of BenchBot v2."""
    from benchbot.core.plugin_manager import installed

    rows = [
        {"name": info.name, "module": info.module, "distribution": info.distribution, "version": info.version}
        for info in installed()
    ]
    for source in _loaded().pool("declaration_sources").values():
        rows += source.value.installed()
    _print(rows, ["name", "distribution", "version", "module"], as_json)
