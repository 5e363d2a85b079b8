"""The app: its screens, what it watches, and what is alive. Ending it ends nothing that it has started or watched."""

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

from textual.app import App
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.screen import Screen

from benchbot.cli.kit import console
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.plugin_manager import load
from benchbot.plugins.tui import alive, opening, served
from benchbot.plugins.tui.alive import RUNNING, WELL, Alive
from benchbot.plugins.tui.help import HelpScreen
from benchbot.plugins.tui.home import HomeScreen
from benchbot.plugins.tui.watching import picture_boxes
from benchbot.wire.run_state import RunState

PERIOD_S = 1.0
THREADS = "benchbot-tui"
WIDTHS = [(0, "-narrow"), (60, "-usual"), (110, "-wide")]
HEIGHTS = [(0, "-flat"), (14, "-low"), (36, "-tall")]
"""Where the layout changes: columns and rows of the terminal, and the class that a screen has from there on."""


class BenchbotApp(App[None]):
    """`benchbot tui`. With a run or a batch it begins by watching that."""

    TITLE = "BenchBot"
    CSS_PATH = "app.tcss"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS = WIDTHS
    VERTICAL_BREAKPOINTS = HEIGHTS
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "help", "Help", key_display="?"),
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
        Binding("L", "light", "Light or dark", show=False),
        Binding("ctrl+c,ctrl+q", "quit", "Quit", show=False),
    ]

    class Looked(Message):
        """There is news of what is alive."""

    def __init__(
        self,
        *,
        run: RunState | None = None,
        batch: Path | None = None,
        images: str = "halfcell",
        look: Callable[[], Alive] = alive.look,
        catalog: Callable[[], Catalog] = lambda: Catalog(load()),
    ) -> None:
        super().__init__()
        self.alive = Alive()
        self.images = images
        self.begun: set[Path] = set()
        """The folders of jobs that were started here and whose end has not been told yet."""
        self._first = (run, batch)
        self._look, self._make_catalog = look, catalog
        self._catalog: Catalog | None = None
        self._looking = False
        self._watched: dict[Screen[Any], str] = {}

    @property
    def catalog(self) -> Catalog:
        """What is installed; the first time it takes a moment: ask for it in a thread."""
        if self._catalog is None:
            self._catalog = self._make_catalog()
        return self._catalog

    @property
    def has_browser(self) -> bool:
        """Whether a page can be shown beside the terminal; over ssh there is none."""
        return self.is_web or "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ or sys.platform == "darwin"

    def on_mount(self) -> None:
        """Show what is alive, and what was asked for before it."""
        self.push_screen(HomeScreen())
        run, batch = self._first
        if run is not None:
            self.watch_run(run)
        if batch is not None:
            self.watch_batch(batch)
        self.look()
        self.set_interval(PERIOD_S, self.look)

    def look(self) -> None:
        """Look in a thread what is alive, unless one is looking: a slow disk must not stop the keys."""
        if not self._looking:
            self._looking = True
            self.in_thread(self._look, self._take, finally_do=self._looked)

    def tell(self, error: BenchbotError) -> None:
        """Show an error and the way around it."""
        self.notify(f"{error.why}\n{error.fix}", title=error.title, severity="error", timeout=12, markup=False)

    def in_thread(
        self, work: Callable[[], Any], done: Callable[[Any], None], finally_do: Callable[[], None] | None = None
    ) -> None:
        """Do `work` in a thread and hand what it returns to `done`; an error is shown. Nobody waits for it to end."""

        def do() -> None:
            try:
                answer = work()
            except BenchbotError as error:
                self.call_later(self.tell, error)
            except OSError as error:
                self.call_later(self.notify, str(error), severity="error", markup=False)
            else:
                self.call_later(done, answer)
            finally:
                if finally_do is not None:
                    self.call_later(finally_do)

        threading.Thread(target=do, daemon=True, name=THREADS).start()

    def watch_run(self, state: RunState) -> None:
        """Show a run; it goes on when the screen is left."""
        self._watch(state.folder, opening.run_screen(self, state))

    def watch_batch(self, folder: Path) -> None:
        """Show a batch; it goes on when the screen is left."""
        self._watch(str(folder), opening.batch_screen(self, folder))

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
        """Show every key."""
        if not isinstance(self.screen, HelpScreen):
            self.push_screen(HelpScreen(self.screen))

    def action_light(self) -> None:
        """Change between light and dark."""
        self.theme = "textual-dark" if self.theme == "textual-light" else "textual-light"

    def _watch(self, name: str, screen: Screen[None]) -> None:
        # One is watched at a time: what nobody looks at costs nothing.
        watched, self._watched = self.screen in self._watched, {screen: name}
        if watched:
            self.switch_screen(screen)
        else:
            self.push_screen(screen)

    def _looked(self) -> None:
        self._looking = False

    def _take(self, now: Alive) -> None:
        before = {each.job.folder: each.state for each in self.alive.started}
        for each in now.started:
            was = RUNNING if each.job.folder in self.begun else before.get(each.job.folder)
            if was == RUNNING != each.state:
                self.begun.discard(each.job.folder)
                self.notify(
                    each.said,
                    title=f"Ended: {each.title}",
                    severity="information" if each.state == WELL else "error",
                    timeout=10,
                    markup=False,
                )
        self.alive = now
        for screen in self.screen_stack:
            screen.post_message(self.Looked())


def show(*, run: RunState | None = None, batch: Path | None = None, images: str = "halfcell") -> ExitCode:
    """Show the app until it is left; return the exit code."""
    served.die_with_server()
    picture_boxes.prepare(images)
    app = BenchbotApp(run=run, batch=batch, images=images)
    with _told_in(app):
        app.run()
    if app.alive.runs and not app.is_web:
        console.note(f"{len(app.alive.runs)} of your runs go on; benchbot tui comes back to them.")
    return ExitCode.INTERNAL if app.return_code else ExitCode.OK


@contextmanager
def _told_in(app: BenchbotApp) -> Iterator[None]:
    """Show what a thread of the app did not foresee; it is our mistake or a plug-in's, and no reason to end."""
    before = threading.excepthook

    def tell(failed: threading.ExceptHookArgs) -> None:
        if failed.thread is not None and failed.thread.name == THREADS:
            said = f"{failed.exc_type.__name__}: {failed.exc_value}"
            app.call_later(app.notify, said, title="Internal error.", severity="error", timeout=12, markup=False)
        else:
            before(failed)

    threading.excepthook = tell
    try:
        yield
    finally:
        threading.excepthook = before
