"""The `benchbot` command: its table of sub-commands, each imported only when it is called, and how errors are shown."""

import gc
import pkgutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup

from benchbot import __version__
from benchbot.cli.kit import console
from benchbot.cli.kit.options import QUICK
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.v2 import addon_options

COMMANDS: dict[str, tuple[str, str]] = {
    "run": ("benchbot.cli.run:run", "Start a robot in an environment, ready for a solution."),
    "submit": ("benchbot.cli.submit:submit", "Run a solution, against a running robot or with one of its own."),
    "batch": (
        "benchbot.plugins.batch.command:app",
        "Compute many episodes: robots, environments, seeds, settings; resumable.",
    ),
    "eval": ("benchbot.cli.evaluate:evaluate", "Score result files."),
    "report": ("benchbot.plugins.report.report_command:report", "Make a page, tables or test cases of results."),
    "compare": (
        "benchbot.plugins.report.compare_command:compare",
        "Say whether one set of results scores higher than another.",
    ),
    "bundle": (
        "benchbot.plugins.bundles.bundle_command:bundle",
        "Make one file of results and their solution, for others to repeat.",
    ),
    "reproduce": (
        "benchbot.plugins.bundles.reproduce_command:reproduce",
        "Run a bundle's solution again: does the same come of it?",
    ),
    "verify": (
        "benchbot.plugins.bundles.verify_command:verify",
        "Replay results in the simulator: is it what they say?",
    ),
    "record": ("benchbot.plugins.recorders.command:record", "Record a run that is under way, from another terminal."),
    "draw": (
        "benchbot.plugins.drawing.draw_command:draw",
        "Draw frames, map or way of results, as figures for a paper.",
    ),
    "tui": ("benchbot.plugins.tui.command:tui", "Choose, start, watch, submit and browse on screens, in any terminal."),
    "picture": ("benchbot.plugins.drawing.picture_command:picture", "Draw a result beside the truth, with its score."),
    "list": ("benchbot.cli.list:app", "List tasks, robots, environments and everything else that is installed."),
    "show": ("benchbot.cli.show:app", "Print one declaration and where it is."),
    "check": (
        "benchbot.plugins.authoring.check_command:check",
        "Say what is wrong with declarations and documents, line by line.",
    ),
    "doctor": ("benchbot.plugins.doctor.command:doctor", "Find what is broken on this machine, and how to mend it."),
    "stop": ("benchbot.cli.stop:stop", "End a run at once: the emergency stop of a real robot."),
    "ready": ("benchbot.plugins.watching.ready_command:ready", "Say that you have done what a real robot asked you."),
    "schema": (
        "benchbot.plugins.authoring.schema_command:schema",
        "Print the JSON Schema of a declaration or document.",
    ),
    "install": (
        "benchbot.plugins.installer.install_command:install",
        "Install plug-ins, and undo it when they do not work.",
    ),
    "uninstall": ("benchbot.plugins.installer.uninstall_command:uninstall", "Uninstall plug-ins."),
    "upgrade": ("benchbot.plugins.installer.upgrade_command:upgrade", "Upgrade plug-ins to their newest versions."),
    "plugins": (
        "benchbot.plugins.installer.plugins_command:app",
        "List, show and search plug-ins; lock those of a project.",
    ),
    "new": (
        "benchbot.plugins.authoring.new_command:new",
        "Make a plug-in of your own: a complete project, tested and ready to publish.",
    ),
}
"""Sub-commands: name to (`module:attribute`, help line)."""

EPILOGUE = """\
Plug-ins may add commands: benchbot list commands.

\b
Add-ons of BenchBot v2, for run, submit, batch, eval, report, compare, picture, list, show, check, doctor, bundle,
reproduce and verify:
  --addons FOLDER  use those in this folder, too; repeatable
  --trust-addons   let their Python code run, until it changes

\b
Exit codes:
  0    ok
  1    the submission failed
  2    wrong usage, or an impossible selection
  3    internal error: BenchBot, the simulator or the machine failed
  4    scored below a --require threshold
  130  interrupted
"""


class Stub(TyperCommand):
    """A command of which only name and help line are known until it is called."""

    def __init__(self, name: str, target: str, help_line: str) -> None:
        super().__init__(name, help=help_line, short_help=help_line, rich_markup_mode=None)
        self.target = target

    def load(self) -> Any:
        """Import and return the command itself: a typer app, or a function that becomes one."""
        found = pkgutil.resolve_name(self.target)
        if isinstance(found, typer.Typer):
            app = found
        else:
            app = typer.Typer(add_completion=False, rich_markup_mode=None)
            app.command(self.name)(found)
        command = typer.main.get_command(app)
        command.name = self.name
        return command


class LazyGroup(TyperGroup):
    """A group of stubs. Commands of plug-ins join it when a name is called that BenchBot itself does not have."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        for name, (target, help_line) in COMMANDS.items():
            self.add_command(Stub(name, target, help_line))

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the called command's name, the command itself and its arguments."""
        if args[0] not in self.commands:
            self._add_commands_of_plugins()
        name, command, rest = super().resolve_command(ctx, args)
        if name in addon_options.COMMANDS and not ctx.resilient_parsing:
            rest = addon_options.take(rest)
        return name, command.load() if isinstance(command, Stub) else command, rest

    def _add_commands_of_plugins(self) -> None:
        from benchbot.core import plugin_manager

        for name, provided in plugin_manager.load().pool("commands").items():
            if name in COMMANDS:
                raise plugin_manager.conflict("commands", name, "benchbot", provided.distribution)
            self.add_command(Stub(name, provided.value.target, provided.value.help))


@dataclass
class Settings:
    """What was asked for before the sub-command's name."""

    verbose: bool = False


app = typer.Typer(
    cls=LazyGroup,
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings=QUICK,
    epilog=EPILOGUE,
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
    # Few objects die young while a command line starts: looking for them less often makes `benchbot list` faster.
    gc.set_threshold(50_000, 20, 20)
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
