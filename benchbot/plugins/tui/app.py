"""The app of `benchbot tui`: its keys, and which screen shows what."""

import threading
from ast import literal_eval
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar
from weakref import WeakKeyDictionary

from textual.app import SystemCommand
from textual.binding import Binding, BindingType
from textual.dom import DOMNode
from textual.screen import Screen
from textual.theme import Theme

from benchbot.cli.app import EVERYDAY
from benchbot.cli.kit import console
from benchbot.core import plugin_manager
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.light_records import Command
from benchbot.plugins.tui import registered_screens
from benchbot.plugins.tui.base import THREAD_NAME, BaseApp
from benchbot.plugins.tui.dialogs import HelpScreen
from benchbot.plugins.tui.home import HomeScreen
from benchbot.plugins.tui.jobs import Job
from benchbot.plugins.tui.registered_screens import Registered
from benchbot.plugins.watching.views import EpisodeCell
from benchbot.wire.run_state import RunState

if TYPE_CHECKING:
    from textual.actions import ActionParseResult

    from benchbot.plugins.drawing.map_model import SceneMap

PERIOD_S = 1.0
WIDTHS = [(0, "-narrow"), (60, "-usual"), (110, "-wide")]
HEIGHTS = [(0, "-flat"), (14, "-low"), (36, "-tall")]
"""The class of a screen from so many columns or lines of the terminal on."""
COLOUR_BLIND = Theme(
    "colour-blind", primary="#56B4E9", secondary="#0072B2", accent="#F0E442", success="#56B4E9", warning="#E69F00",
    error="#D55E00", dark=True,
)  # fmt: skip
"""Colours that eyes of all kinds tell apart (Okabe and Ito, https://jfly.uni-koeln.de/color/)."""
THEMES = ("textual-dark", "textual-light", COLOUR_BLIND.name, "ansi-dark", "ansi-light")
EVERYWHERE = (
    Binding("up,down,pageup,pagedown", "", "Move in a list; k and j do, too", key_display="↑ ↓ PgUp PgDn"),
    Binding("enter", "", "Choose, open", key_display="Enter"),
    Binding("tab", "", "Go to the next part of the screen", key_display="Tab"),
    Binding("escape", "", "Back", key_display="Esc"),
)
"""Keys that Textual handles, for the help."""


class BenchbotApp(BaseApp):
    """The app of `benchbot tui`. With a run or a batch it begins by watching that."""

    TITLE = "BenchBot"
    CSS_PATH = "app.tcss"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS = WIDTHS
    VERTICAL_BREAKPOINTS = HEIGHTS
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "help", "Help", key_display="?"),
        Binding(
            "ctrl+p,colon",
            "command_palette",
            "Commands",
            key_display="^p",
            show=False,
            tooltip="Every screen and action, by name",
        ),
        Binding(
            "right_square_bracket",
            "watched(1)",
            "Next run",
            tooltip="Watch the next run or batch that is alive",
            key_display="]",
            show=False,
        ),
        Binding(
            "left_square_bracket",
            "watched(-1)",
            "Run before",
            tooltip="Watch the one before",
            key_display="[",
            show=False,
        ),
        Binding("T", "theme", "Theme", tooltip="Dark, light, for the colour-blind, or the terminal's own", show=False),
        Binding("ctrl+c,ctrl+q", "quit", "Quit", show=False),
    ]

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._registered: Mapping[str, Registered] = {}
        self._commands: Sequence[Command] = ()
        self._all_read = False
        self._screen_keys: dict[str, Binding] = {}
        self._opened = WeakKeyDictionary[Screen[Any], Registered]()
        """The screens that were opened by the record of a plug-in, with that."""

    def on_mount(self) -> None:
        """Show what is alive, and what was asked for before it."""
        self.register_theme(COLOUR_BLIND)
        # Set here, since footers name the palette wherever the class has it.
        self.use_command_palette = True
        self.theme = self.preference("theme") or self.theme
        self.push_screen(HomeScreen())
        self._offer(registered_screens.shipped())
        if self._first_run is not None:
            self.watch_run(self._first_run)
        if self._first_batch is not None:
            self.watch_batch(self._first_batch)
        self.look()
        self.set_interval(PERIOD_S, self.look)
        # Not before the first screen: that would take longer for it.
        self.set_timer(PERIOD_S, self._read_screens)

    def watch_run(self, state: RunState) -> None:
        """Show a run; it goes on when the screen is left."""
        # Pictures need numpy and more: the first screen does not wait for them.
        from benchbot.plugins.drawing.scene_maps import installed_map
        from benchbot.plugins.tui.run_screen import RunScreen
        from benchbot.plugins.watching.run_feed import RunFeed

        def surroundings(environment: str) -> "SceneMap":
            return installed_map(self.catalog, environment)

        screen = RunScreen(
            RunFeed(state),
            again=self.start_again,
            report=lambda result: self.make_report([result]),
            surroundings=surroundings,
            images=self.images,
        )
        self._watch(state.folder, screen)

    def watch_batch(self, folder: Path) -> None:
        """Show a batch; it goes on when the screen is left."""
        from benchbot.plugins.tui.batch_screen import BatchScreen
        from benchbot.plugins.watching.batch_feed import BatchFeed

        def open_run(cell: EpisodeCell) -> None:
            wanted = (cell.environment, cell.robot, cell.seed)
            # Of runs with the same selection, those of this batch come first.
            for state in sorted(self.alive.runs, key=lambda state: str(folder) not in state.owner):
                if (state.environment, state.robot, state.seed) == wanted:
                    self.watch_run(state)
                    return
            self.notify(f"No run of {cell.name} is alive on this machine.")

        def go_on(going_on: Path) -> None:
            self.start(["batch", "attach", "--detach", str(going_on)])

        self._watch(str(folder), BatchScreen(BatchFeed(folder), open_run=open_run, go_on=go_on))

    # Screens that plug-ins bring

    def open_screen(self, name: str) -> None:
        """Open a screen by the name of its record; it is imported now. One that fails is told, and opens nothing."""
        registered = self._registered.get(name)
        if registered is None:
            self.in_thread(registered_screens.installed, partial(self._open_late, name))
            return
        try:
            screen = registered.make()
        except BenchbotError as error:
            self.tell(error)
            return
        self._opened[screen] = registered
        self.push_screen(screen)

    def forget_catalog(self) -> None:
        """Read what is installed anew, screens among it."""
        super().forget_catalog()
        self.in_thread(self._installed, self._offer)

    def _open_late(self, name: str, found: Mapping[str, Registered]) -> None:
        self._offer(found)
        if name in found:
            self.open_screen(name)
        else:
            self.notify(f"There is no screen '{name}'.", severity="error")

    def _offer(self, found: Mapping[str, Registered]) -> None:
        self._registered = found
        for name, registered in found.items():
            if registered.key:
                summary = registered.record.summary
                self.bind(registered.key, f"screen({name!r})", description=name, show=False)
                self._screen_keys[registered.key] = Binding(
                    registered.key, f"screen({name!r})", name, tooltip=summary, show=False
                )

    def action_screen(self, name: str) -> None:
        """Open a screen by name."""
        registered = self._registered.get(name)
        if self._opened.get(self.screen) is not registered or registered is None:
            self.open_screen(name)

    def get_system_commands(self, screen: Screen[Any]) -> Iterable[SystemCommand]:
        """Yield what the command palette offers: what the present screen can do, every screen, and the app's own."""
        found: dict[str, SystemCommand] = {}
        for binding in screen.active_bindings.values():
            one = binding.binding
            if binding.node is screen and binding.enabled and (one.show or one.tooltip):
                action = partial(screen.run_action, one.action)
                title = one.description.capitalize()
                found[title] = SystemCommand(title, one.tooltip or "Of this screen", action)
        for name, registered in self._registered.items():
            title = name.capitalize()
            found[title] = SystemCommand(title, registered.record.summary, partial(self.open_screen, name))
        for command in (
            SystemCommand("New run", "Choose a task, a robot and an environment", self.action_new_run),
            SystemCommand("Results", "Look at results, evaluate them, make reports", self.action_results),
            SystemCommand("Theme", "Dark, light, for the colour-blind, or the terminal's own", self.action_theme),
            SystemCommand("Keys", "Every key of every screen", self.action_help),
            SystemCommand("Quit", "What runs goes on", self.action_quit),
        ):
            found.setdefault(command.title, command)
        for record in self._commands:
            title = f"benchbot {record.name}"
            found[title] = SystemCommand(title, record.help, partial(self._open_command, record))
        yield from found.values()

    def action_command_palette(self) -> None:
        """Show the command palette; one that is opened at once waits for the screens of other distributions."""
        if self._all_read:
            super().action_command_palette()
        else:
            self._read_screens(super().action_command_palette)

    def _read_screens(self, then: Callable[[], None] = lambda: None) -> None:
        """Read in a thread which screens there are, those of other distributions among them."""
        self._all_read = True
        self.in_thread(self._installed, self._offer, then)

    def _installed(self) -> Mapping[str, Registered]:
        """Return the screens of all plug-ins; their commands are known then, too."""
        found = registered_screens.installed()
        brought = plugin_manager.load().pool("commands").values()
        records = [*EVERYDAY, *(provided.value for provided in brought)]
        self._commands = sorted((each for each in records if each.name != "tui"), key=lambda each: each.name)
        return found

    def _open_command(self, record: Command) -> None:
        from benchbot.plugins.tui.any_command import AnyCommandScreen

        self.push_screen(AnyCommandScreen(record))

    def action_new_run(self) -> None:
        """Choose a new run."""
        from benchbot.plugins.tui.new_run import NewRunScreen

        self.push_screen(NewRunScreen())

    def action_results(self) -> None:
        """Look at results: those in `results`, or in the current folder."""
        from benchbot.plugins.tui.results import ResultsScreen

        folder = Path.cwd() / "results"
        self.push_screen(ResultsScreen(folder if folder.is_dir() else Path.cwd()))

    async def run_action(
        self,
        action: "str | ActionParseResult",
        default_namespace: DOMNode | None = None,
        namespaces: Mapping[str, DOMNode] | None = None,
    ) -> bool:
        """Run an action; one of a screen of another distribution that fails makes that screen close."""
        try:
            return await super().run_action(action, default_namespace, namespaces)
        # A third party's code may fail in any way at all, and the app's own loop of messages must go on.
        except Exception as error:
            if not self._has_left(error):
                raise
            return True

    def _handle_exception(self, error: Exception) -> None:
        """End the app, as Textual does, unless the present screen is one that another distribution brings."""
        if not self._has_left(error):
            super()._handle_exception(error)

    def _has_left(self, error: Exception) -> bool:
        """Close the present screen, and tell why, if another distribution brings it; return whether it does."""
        shown = next((screen for screen in reversed(self.screen_stack) if not screen.is_modal), None)
        registered = None if shown is None else self._opened.get(shown)
        if shown is None or registered is None or registered.distribution == registered_screens.OWN:
            return False
        self.call_later(self._drop, shown, registered.failure(error))
        return True

    def _drop(self, screen: Screen[Any], error: BenchbotError) -> None:
        if screen in self.screen_stack:
            while self.screen is not screen:
                self.pop_screen()
            self.pop_screen()
            self.tell(error)

    def show_job(self, job: Job) -> None:
        """Show the log of a job."""
        from benchbot.plugins.tui.submissions import JobScreen

        self.push_screen(JobScreen(job))

    def action_watched(self, step: int) -> None:
        """Go to the next run or batch that is alive."""
        runs = {state.folder: state for state in self.alive.runs}
        batches = {str(entry.folder): entry.folder for entry in self.alive.batches if entry.alive}
        names = [*runs, *batches]
        if not names:
            self.notify("No run and no batch is alive.")
            return
        shown = self._watched.get(self.screen, "")
        name = names[(names.index(shown) + step) % len(names)] if shown in names else names[0]
        if name in runs:
            self.watch_run(runs[name])
        else:
            self.watch_batch(batches[name])

    def action_help(self) -> None:
        """Show the keys of the present screen, those that mean something now first, and those of every screen."""
        screen = self.screen
        if isinstance(screen, HelpScreen):
            return
        own = [each if isinstance(each, Binding) else Binding(*each) for each in screen.BINDINGS]
        now: list[BindingType] = []
        later: list[BindingType] = []
        for binding in own:
            name, _, given = binding.action.partition("(")
            known = screen.check_action(name, literal_eval(f"({given.rstrip(')')},)") if given else ()) is not False
            (now if known else later).append(binding)
        everywhere = [*EVERYWHERE, *self.BINDINGS, *self._screen_keys.values()]
        sections = [("Here, now", now), ("Here, at other times", later), ("Everywhere", everywhere)]
        self.push_screen(HelpScreen([(title, bindings) for title, bindings in sections if bindings]))

    def action_theme(self) -> None:
        """Change between dark, light, colours that the colour-blind tell apart, and the terminal's own."""
        self.theme = THEMES[(THEMES.index(self.theme) + 1) % len(THEMES)] if self.theme in THEMES else THEMES[0]
        self.prefer("theme", self.theme)

    def _watch(self, name: str, screen: Screen[None]) -> None:
        # Only one feed is open at a time: screens that are not shown cost nothing.
        watched, self._watched = self.screen in self._watched, {screen: name}
        if watched:
            self.switch_screen(screen)
        else:
            self.push_screen(screen)


def show(*, run: RunState | None = None, batch: Path | None = None, images: str) -> ExitCode:
    """Show the app until it is left; return the exit code. `images` is a way that this terminal shows pictures."""
    app = BenchbotApp(run=run, batch=batch, images=images)
    with _thread_errors_shown(app):
        app.run()
    if app.alive.runs and not app.is_web:
        console.note(f"{len(app.alive.runs)} of your runs go on; benchbot tui comes back to them.")
    return ExitCode.INTERNAL if app.return_code else ExitCode.OK


@contextmanager
def _thread_errors_shown(app: BenchbotApp) -> Iterator[None]:
    """Show unexpected exceptions of the app's threads: an error in BenchBot or in a plug-in is no reason to end."""
    before = threading.excepthook

    def show_failure(failed: threading.ExceptHookArgs) -> None:
        if failed.thread is not None and failed.thread.name == THREAD_NAME:
            text = f"{failed.exc_type.__name__}: {failed.exc_value}"
            app.call_later(app.notify, text, title="Internal error.", severity="error", timeout=12, markup=False)
        else:
            before(failed)

    threading.excepthook = show_failure
    try:
        yield
    finally:
        threading.excepthook = before
