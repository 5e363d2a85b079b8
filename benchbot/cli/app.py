"""The `benchbot` command: its table of sub-commands, each imported only when it is called, and how errors are shown."""

import gc
import pkgutil
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup

from benchbot import __version__
from benchbot.cli.kit import console
from benchbot.cli.kit.options import QUICK
from benchbot.core import entry_points
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.light_records import Command
from benchbot.core.text import visible

EVERYDAY = (
    Command("run", "benchbot.cli.run:run", "Start a robot in an environment, ready for a solution.", True),
    Command(
        "submit", "benchbot.cli.submit:submit", "Run a solution, against a running robot or with one of its own.", True
    ),
    Command("eval", "benchbot.cli.evaluate:evaluate", "Score result files.", True),
    Command(
        "list", "benchbot.cli.list:app", "List tasks, robots, environments and everything else that is installed.", True
    ),
    Command("show", "benchbot.cli.show:app", "Print one declaration and where it is.", True),
    Command("stop", "benchbot.cli.stop:stop", "End a run at once: the emergency stop of a real robot."),
)
"""The commands of the core; all others come from plug-ins."""

EPILOGUE = """\
Other plug-ins may add commands: benchbot list commands.

\b
For commands that use declarations:
{source_options}
\b
Exit codes:
  0    ok
  1    the submission failed
  2    wrong usage, or an impossible selection
  3    internal error: BenchBot, the simulator or the machine failed
  4    scored below a --require threshold
  130  interrupted

\b
A first run, of an example in a small room (with what benchbot[full] brings):
  benchbot submit --example hello_passive --env miniroom:1 \\
      --robot carter_lowres --task semantic_slam:passive:ground_truth
"""


class Stub(TyperCommand):
    """A command of which only the record is known until it is called."""

    def __init__(self, record: Command) -> None:
        super().__init__(record.name, help=record.help, short_help=record.help, rich_markup_mode=None)
        self.record = record

    def load(self) -> Any:
        """Import and return the command itself: a typer app, or a function that becomes one."""
        found = pkgutil.resolve_name(self.record.target)
        if isinstance(found, typer.Typer):
            app = found
        else:
            app = typer.Typer(add_completion=False, rich_markup_mode=None)
            app.command(self.name)(found)
        command = typer.main.get_command(app)
        command.name = self.name
        return command


class LazyGroup(TyperGroup):
    """A group of stubs. The commands of plug-ins join it when they are listed or called."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        for record in EVERYDAY:
            self.add_command(Stub(record))

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of the everyday commands, then those of the other commands that ship in the box."""
        self._add(entry_points.shipped("commands"))
        everyday = [record.name for record in EVERYDAY]
        return [*everyday, *sorted(self.commands.keys() - set(everyday))]

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the epilogue, with the options of declaration sources."""
        options = "".join(source.help for source in entry_points.shipped("declaration_sources"))
        self.epilog = EPILOGUE.format(source_options=options)
        super().format_epilog(ctx, formatter)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the called command's name, the command itself and its arguments."""
        if args[0] not in self.commands:
            self._add(entry_points.shipped("commands"))
        if args[0] not in self.commands:
            self._add_all()
        name, command, rest = super().resolve_command(ctx, args)
        if not isinstance(command, Stub):
            return name, command, rest
        if command.record.takes_sources and not ctx.resilient_parsing:
            rest = _without_source_options(rest)
        return name, command.load(), rest

    def invoke(self, ctx: Any) -> Any:
        """Run the called command; the message of a wrong word is made visible, since a shell may have put it in."""
        try:
            return super().invoke(ctx)
        except Exception as error:
            if isinstance(getattr(error, "message", None), str):  # a usage error; typer has no name for all of them
                error.message = visible(error.message)  # type: ignore[attr-defined]
            raise

    def _add(self, records: Iterable[Command]) -> None:
        for record in records:
            if record.name not in self.commands:
                self.add_command(Stub(record))

    def _add_all(self) -> None:
        from benchbot.core import plugin_manager

        for name, provided in plugin_manager.load().pool("commands").items():
            if name in [record.name for record in EVERYDAY]:
                raise plugin_manager.conflict("commands", name, plugin_manager.Provided(None, "benchbot"), provided)
            self._add([provided.value])


def _without_source_options(words: list[str]) -> list[str]:
    """Return the words of a command without the options of declaration sources, which have been acted on."""
    from benchbot.core import plugin_manager

    rest = words
    for provided in plugin_manager.load().pool("declaration_sources").values():
        rest = provided.value.take_options(rest)
    if rest != words:
        plugin_manager.load.cache_clear()
    return rest


@dataclass
class Settings:
    """Options given before the sub-command's name."""

    verbose: bool = False


app = typer.Typer(
    cls=LazyGroup,
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings=QUICK,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        console.data(f"benchbot {__version__}")
        raise typer.Exit


@app.callback()
def benchbot(
    context: typer.Context,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Show tracebacks of errors.")] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Is my robotics algorithm any good? Observe, act and get a score, in simulation and on real robots."""
    context.obj.verbose = verbose


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; every error ends as a panel on stderr and an exit code."""
    settings = Settings()
    console.escape_unprintable()
    try:
        typer.main.get_command(app).main(args=arguments, prog_name="benchbot", obj=settings)
    except BenchbotError as error:
        console.error(error, verbose=settings.verbose)
        sys.exit(error.exit_code)
    # The last line of defence: whatever a command did not foresee is our mistake, never the user's.
    except Exception as error:  # noqa: BLE001
        console.internal_error(error, verbose=settings.verbose)
        sys.exit(ExitCode.INTERNAL)
    finally:
        # Python searches for garbage once more at its end; what a dying process holds need not be searched.
        gc.freeze()
    sys.exit(ExitCode.OK)
