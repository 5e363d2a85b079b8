"""`benchbot list`: everything that is installed, by kind."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from benchbot.cli.kit import console
from benchbot.cli.kit.options import QUICK, Json, group

if TYPE_CHECKING:
    from benchbot.core.plugin_manager import Plugins

app = group("List everything of a kind that is installed.")


@dataclass(frozen=True)
class Listing:
    """A table of one kind: its help line, and its columns, each read from a declaration's data or from a record.

    `pools` are the pools of records that the rows come from, with what a row of each is called in the column `kind`;
    without, the rows are declarations. `json_only` are columns that only `--json` shows.
    """

    help: str
    columns: Mapping[str, Callable[[Any], Any]]
    pools: Mapping[str, str] = field(default_factory=dict)
    json_only: tuple[str, ...] = ()


def _attribute(name: str) -> Callable[[Any], Any]:
    return lambda record: getattr(record, name) or None


_MOST_ITEMS = 12
_DESCRIPTION = {"description": _attribute("description")}

LISTINGS: Mapping[str, Listing] = {
    "tasks": Listing(
        "List what a solution can be asked to do.",
        {
            "actions": lambda task: task.get("actions"),
            "localisation": lambda task: task.get("localisation", "ground_truth"),
            "scenes": lambda task: task.get("scene_count", 1),
            "results_format": lambda task: task.get("results_format"),
        },
    ),
    "robots": Listing("List the robots, simulated and real.", {"type": lambda robot: robot.get("type")}),
    "environments": Listing(
        "List the environments, as name:variant.",
        {
            "type": lambda environment: environment.get("type"),
            "trajectory_poses": lambda environment: len(environment.get("trajectory_poses") or ()),
        },
    ),
    "formats": Listing(
        "List the formats of results and ground truths.",
        {"functions": lambda declared: list(declared.get("functions") or ())},
    ),
    "examples": Listing("List the example solutions.", {"description": lambda example: example.get("description")}),
    "episodes": Listing(
        "List the episodes: starts and goals in an environment.",
        {"episodes": lambda listed: len(listed.get("episodes") or ())},
    ),
    "batches": Listing(
        "List the batches: named lists of environments.", {"environments": lambda batch: batch.get("environments")}
    ),
    "methods": Listing(
        "List the methods of evaluation.",
        {
            "version": _attribute("version"),
            "headline": _attribute("headline"),
            "result_formats": lambda method: sorted(method.result_formats),
            "ground_truth_formats": lambda method: sorted(method.ground_truth_formats),
        },
        {"evaluators": "method"},
        json_only=("ground_truth_formats",),
    ),
    "simulators": Listing(
        "List what robots run on: simulators, and drivers of real robots.",
        {},
        {"simulators": "simulator", "robot_drivers": "driver"},
    ),
    "executors": Listing("List where the workers of a batch can run.", _DESCRIPTION, {"executors": ""}),
    "recorders": Listing("List what --record and benchbot record can write.", _DESCRIPTION, {"recorders": ""}),
    "modes": Listing("List the ways to hold a solution while it runs.", _DESCRIPTION, {"submission_modes": ""}),
    "commands": Listing(
        "List the commands that plug-ins add to benchbot.", {"help": _attribute("help")}, {"commands": ""}
    ),
    "screens": Listing(
        "List the screens that plug-ins add to benchbot tui.",
        {"key": _attribute("key"), "summary": _attribute("summary")},
        {"screens": ""},
    ),
}


def show(kind: str, as_json: bool = False) -> None:
    """Print everything of a kind."""
    listing = LISTINGS[kind]
    rows = list(_records(listing) if listing.pools else _declarations(kind, listing))
    kinds = ["kind"] if len(listing.pools) > 1 else []
    shown = [name for name in listing.columns if name not in listing.json_only]
    _print(rows, ["name", *kinds, *shown, "distribution"], as_json)


def _declarations(kind: str, listing: Listing) -> list[dict[str, Any]]:
    from benchbot.core.declarations.catalog import Catalog

    catalog = Catalog(_loaded())
    pool = catalog.pool(kind)
    for names in catalog.made_environments if kind == "environments" else ():
        console.note(f"Besides, made when they are first used: {names}")
    for error in catalog.broken:
        console.note(f"Left out: {error.title} {error.why}")
    return [
        {
            "name": name,
            **{column: read(found.data) for column, read in listing.columns.items()},
            "distribution": found.distribution,
            "path": str(found.path),
        }
        for name, found in sorted(pool.items())
    ]


def _records(listing: Listing) -> list[dict[str, Any]]:
    plugins = _loaded()
    return [
        {
            "name": name,
            **({"kind": noun} if len(listing.pools) > 1 else {}),
            **{column: read(found.value) for column, read in listing.columns.items()},
            "distribution": found.distribution,
        }
        for pool, noun in listing.pools.items()
        for name, found in sorted(plugins.pool(pool).items())
    ]


def _loaded() -> "Plugins":
    """Return the loaded plug-ins; say on stderr which ones could not be loaded, since their things are not listed."""
    from benchbot.core.plugin_manager import load

    hint = load().broken_hint().strip()
    if hint:
        console.note(f"{hint} See: benchbot doctor")
    return load()


def _print(rows: list[dict[str, Any]], columns: list[str], as_json: bool) -> None:
    if as_json:
        console.data_json(rows)
    else:
        console.table(columns, ([_cell(row[column]) for column in columns] for row in rows))


def _cell(value: Any) -> str:
    if isinstance(value, list):
        items = list(map(str, value))
        # A batch may have hundreds of environments; a column is as wide as its widest cell.
        return ",".join(items if len(items) <= _MOST_ITEMS else [*items[:2], "…", f"{items[-1]} ({len(items)})"]) or "-"
    return "-" if value is None else " ".join(str(value).split())


def _add_command(kind: str, name: str) -> None:
    @app.command(name, help=LISTINGS[kind].help, context_settings=QUICK, hidden=name != kind)
    def command(as_json: Json = False) -> None:
        show(kind, as_json)


for _kind, _name in (*zip(LISTINGS, LISTINGS, strict=True), ("methods", "evaluators")):  # as hook and `new` call them
    _add_command(_kind, _name)


@app.command("plugins", context_settings=QUICK)
def plugins(as_json: Json = False) -> None:
    """List the installed plug-ins, and add-ons of BenchBot v2; nothing of others' is imported."""
    from benchbot.core import entry_points
    from benchbot.core.plugin_manager import installed

    rows = [
        {"name": info.name, "module": info.module, "distribution": info.distribution, "version": info.version}
        for info in installed()
    ]
    for source in entry_points.shipped("declaration_sources"):
        rows += source.installed()
    _print(rows, ["name", "distribution", "version", "module"], as_json)
