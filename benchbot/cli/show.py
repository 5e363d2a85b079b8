"""`benchbot show`: one declaration as it was written, and the file it is in; and v2's options that list and show."""

from collections.abc import Mapping
from dataclasses import asdict
from itertools import chain
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json, group
from benchbot.core.errors import did_you_mean

Name = Annotated[str, typer.Argument(metavar="NAME", help="Its name, as benchbot list prints it.")]

SHOWN: Mapping[str, tuple[str, str]] = {
    "task": ("tasks", "Print a task."),
    "robot": ("robots", "Print a robot."),
    "environment": ("environments", "Print an environment, given as name:variant. The ground truth is never shown."),
    "env": ("environments", "Print an environment, given as name:variant. The ground truth is never shown."),
    "format": ("formats", "Print a format of results or ground truths."),
    "example": ("examples", "Print an example solution's declaration."),
    "batch": ("batches", "Print a batch."),
    "episodes": ("episodes", "Print an episode list, given as task:name:variant."),
    "method": ("evaluators", "Print a method of evaluation."),
    "simulator": ("simulators", "Print a simulator."),
}
"""Sub-commands to the pool that they look into and their help line."""
_RECORDS = ("evaluators", "simulators")


class AnyKind(TyperGroup):
    """A group whose sub-command need not be named for what alone has a name: `benchbot show carter`."""

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Put its kind before a name that is no sub-command."""
        if args[0] not in self.commands:
            from benchbot.core.declarations.catalog import Catalog
            from benchbot.core.plugin_manager import load

            catalog = Catalog(load())
            pools = {pool: (load().pool if pool in _RECORDS else catalog.pool)(pool) for pool, _ in SHOWN.values()}
            kinds = [word for word, (pool, _) in SHOWN.items() if word != "env" and args[0] in pools[pool]]
            if len(kinds) > 1:
                ctx.fail(f"There is a {' and a '.join(kinds)} called '{args[0]}'. Say which: show {kinds[0]} {args[0]}")
            if not kinds:
                near = did_you_mean(args[0], [*self.commands, *chain(*pools.values())])
                ctx.fail(f"Nothing that is installed is called '{args[0]}'.{near}")
            args = [*kinds, *args]
        return super().resolve_command(ctx, args)


app = group("Print one declaration and where it is. What alone has a name needs no kind: show carter.", AnyKind)


def declaration(kind: str, name: str, as_json: bool = False) -> None:
    """Print a declaration of a pool; raises BenchbotError for an unknown name.

    It is printed even when it is not valid, so that it can be mended.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load

    catalog = Catalog(load())
    found = catalog.find(kind, name)
    if found is None:
        raise catalog.unknown(kind, name)
    if as_json:
        origin = {"name": name, "distribution": found.distribution, "path": str(found.path)}
        console.data_json({**origin, "declaration": found.data})
    else:
        console.data(f"# {found.path} ({found.distribution})")
        console.document(found.path.read_text("utf-8").rstrip())


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
        console.document(yaml.safe_dump(document, sort_keys=False, allow_unicode=True).rstrip())


def listing(kind: str, *flags: str) -> Any:
    """Return v2's option that lists a kind and ends the command, such as `--list-tasks`."""

    def callback(wanted: bool) -> None:
        from benchbot.cli import list as lists

        if wanted:
            lists.show(kind)
            raise typer.Exit

    return typer.Option(*flags, callback=callback, is_eager=True, help=f"List the {kind} and exit.")


def showing(kind: str, *flags: str) -> Any:
    """Return v2's option that shows one thing of a kind and ends the command, such as `--show-task NAME`."""

    def callback(name: str | None) -> None:
        if name:
            record("evaluators", name) if kind == "methods" else declaration(kind, name)
            raise typer.Exit

    help_line = f"Print one of the {kind} and exit."
    return typer.Option(*flags, metavar="NAME", callback=callback, is_eager=True, help=help_line)


def _add_command(word: str, pool: str, help_line: str) -> None:
    @app.command(word, help=help_line, hidden=word == "env")
    def command(name: Name, as_json: Json = False) -> None:
        (record if pool in _RECORDS else declaration)(pool, name, as_json)


for _word, (_pool, _help_line) in SHOWN.items():
    _add_command(_word, _pool, _help_line)
