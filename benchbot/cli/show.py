"""`benchbot show`: one declaration as it was written, and the file it is in."""

from dataclasses import asdict
from typing import Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json, group

app = group("Print one declaration and where it is.")

Name = Annotated[str, typer.Argument(metavar="NAME", help="Its name, as benchbot list prints it.")]


def declaration(kind: str, name: str, as_json: bool = False) -> None:
    """Print a declaration of a pool; raises BenchbotError for an unknown name.

    It is printed even when it is not valid: whoever mends it must see it.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load

    catalog = Catalog(load())
    pool = catalog.pool(kind)
    if name not in pool:
        raise catalog.unknown(kind, name)
    found = pool[name]
    if as_json:
        origin = {"name": name, "distribution": found.distribution, "path": str(found.path)}
        console.data_json({**origin, "declaration": found.data})
    else:
        console.data(f"# {found.path} ({found.distribution})\n{found.path.read_text('utf-8').rstrip()}")


def record(kind: str, name: str, as_json: bool = False) -> None:
    """Print what a plug-in says of a record (an evaluation method, a simulator); raises BenchbotError if unknown."""
    import yaml

    from benchbot.core.plugin_manager import load

    pool = load().pool(kind)
    if name not in pool:
        raise load().unknown(kind, name)
    found = pool[name].value
    document: dict[str, Any] = {"name": name, "distribution": pool[name].distribution}
    for field in ("version", "headline", "result_formats", "ground_truth_formats", "description"):
        if hasattr(found, field):
            value = getattr(found, field)
            document[field] = sorted(value) if isinstance(value, frozenset) else value
    if getattr(found, "scores", None):
        document["scores"] = {score: asdict(reading) for score, reading in found.scores.items()}
    if as_json:
        console.data_json(document)
    else:
        console.data(yaml.safe_dump(document, sort_keys=False, allow_unicode=True).rstrip())


@app.command("task")
def task(name: Name, as_json: Json = False) -> None:
    """Print a task."""
    declaration("tasks", name, as_json)


@app.command("robot")
def robot(name: Name, as_json: Json = False) -> None:
    """Print a robot."""
    declaration("robots", name, as_json)


@app.command("environment")
def environment(name: Name, as_json: Json = False) -> None:
    """Print an environment, given as name:variant. The ground truth is never shown."""
    declaration("environments", name, as_json)


@app.command("env", hidden=True)
def env(name: Name, as_json: Json = False) -> None:
    """Print an environment, given as name:variant. The ground truth is never shown."""
    declaration("environments", name, as_json)


@app.command("format")
def format_(name: Name, as_json: Json = False) -> None:
    """Print a format of results or ground truths."""
    declaration("formats", name, as_json)


@app.command("example")
def example(name: Name, as_json: Json = False) -> None:
    """Print an example solution's declaration."""
    declaration("examples", name, as_json)


@app.command("batch")
def batch(name: Name, as_json: Json = False) -> None:
    """Print a batch."""
    declaration("batches", name, as_json)


@app.command("episodes")
def episodes(name: Name, as_json: Json = False) -> None:
    """Print an episode list, given as task:name:variant."""
    declaration("episodes", name, as_json)


@app.command("method")
def method(name: Name, as_json: Json = False) -> None:
    """Print a method of evaluation."""
    record("evaluators", name, as_json)


@app.command("simulator")
def simulator(name: Name, as_json: Json = False) -> None:
    """Print a simulator."""
    record("simulators", name, as_json)
