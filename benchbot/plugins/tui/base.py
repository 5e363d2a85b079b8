"""The base of the app and of its watching screens: threads, errors, commands, jobs, and what is alive."""

import importlib
import os
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.cells import cell_len
from rich.segment import Segment
from textual.color import Color
from textual.driver import Driver
from textual.filter import LineFilter
from textual.message import Message
from textual.screen import Screen

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.request import RunRequest
from benchbot.core.text import visible
from benchbot.plugins.screens.command_screen import Services
from benchbot.plugins.tui import jobs, preferences, result_rows, thrift
from benchbot.plugins.tui.dialogs import QuestionDialog
from benchbot.plugins.tui.jobs import RUNNING, WELL, Alive, Job
from benchbot.plugins.tui.panels import Words
from benchbot.wire.run_state import RunState

if TYPE_CHECKING:
    from benchbot.plugins.watching.batch_feed import BatchFeed
    from benchbot.plugins.watching.run_feed import RunFeed

THREAD_NAME = "benchbot-tui"
START_TIMEOUT_S = 120.0
LOOK_PERIOD_S = 0.2


class Harmless(LineFilter):
    """Replaces in every line what would command the terminal, and keeps the number of cells."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """Return a line's segments as they may be shown."""
        return [segment if segment.control else Segment(_seen(segment.text), segment.style) for segment in segments]


def _seen(text: str) -> str:
    if visible(text) == text:
        return text
    return "".join(letter if visible(letter) == letter else "?" * cell_len(letter) for letter in text)


class BaseApp(Services):
    """The services of the app for its screens. Ending it ends nothing that it has started or watched."""

    class Looked(Message):
        """`alive` is new."""

    def __init__(
        self,
        *,
        run: RunState | None = None,
        batch: Path | None = None,
        images: str = "halfcell",
        look: Callable[[], Alive] | None = None,
        catalog: Callable[[], Catalog] = lambda: Catalog(plugin_manager.load()),
    ) -> None:
        super().__init__()
        self.alive = Alive()
        self._harmless = Harmless()
        self.images = images
        self._first_run, self._first_batch = run, batch
        self._look, self._make_catalog = look or jobs.looker(remembers=True), catalog
        self._catalog: Catalog | None = None
        self._looking = False
        self._begun: set[Path] = set()
        """The folders of jobs that were started here and whose end has not been notified yet."""
        self._watched: dict[Screen[Any], str] = {}
        """The screen that watches a run or batch, and the folder of that."""

    def get_driver_class(self) -> type[Driver]:
        """Return the driver of this platform, which sends only what changes."""
        return thrift.of(super().get_driver_class(), lambda: self.size)

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return what each line passes on its way to the terminal."""
        return [*super().get_line_filters(), self._harmless]

    def notify(self, message: str, *, markup: bool = False, **options: Any) -> None:
        """Show a message for a while; it may name what others have named, so that nothing in it is markup."""
        super().notify(message, markup=markup, **options)

    @property
    def catalog(self) -> Catalog:
        """The installed declarations; the first time it takes a moment: ask for it in a thread."""
        if self._catalog is None:
            self._catalog = self._make_catalog()
        return self._catalog

    def forget_catalog(self) -> None:
        """Read what is installed anew when it is next asked for: something was installed."""
        importlib.invalidate_caches()
        plugin_manager.load.cache_clear()
        self._catalog = None

    def preference(self, name: str) -> str:
        """Return one of the user's settings of the screens, empty where none was made."""
        return preferences.read().get(name, "")

    def prefer(self, name: str, value: str) -> None:
        """Make one of these settings, and keep it."""
        preferences.write(name, value)

    def result_sets(self) -> Mapping[str, Path]:
        """Return the results of batches, a set for each solution, and those in `results`; the watched one first."""
        watched = set(self._watched.values())
        folders = [entry.folder for entry in self.alive.batches]
        found: dict[str, Path] = {}
        for folder in sorted(folders, key=lambda each: str(each) not in watched):
            results = folder / "results"
            solutions = sorted(each for each in results.glob("*") if each.is_dir()) or [results]
            for each in solutions if results.is_dir() else ():
                name = each.name if each is not results else folder.name
                found[name if name not in found else f"{folder.name}-{name}"] = each
        for each in sorted((Path.cwd() / "results").glob("*")):
            if each.is_dir() and any(each.glob("*.json")):
                found.setdefault(each.name, each)
        return found

    def watch_run(self, state: RunState) -> None:
        """Show a run; it goes on when the screen is left."""
        raise NotImplementedError

    def watch_batch(self, folder: Path) -> None:
        """Show a batch; it goes on when the screen is left."""
        raise NotImplementedError

    def show_job(self, job: Job) -> None:
        """Show the log of a job."""
        raise NotImplementedError

    def tell(self, error: BenchbotError) -> None:
        """Show an error and the way around it."""
        self.notify(f"{error.why}\n{error.fix}", title=error.title, severity="error", timeout=12)

    def confirm(self, text: str, key: str, meaning: str, act: Callable[[], None]) -> None:
        """Ask a question that has one answer but "back", and act on that answer."""
        self.push_screen(QuestionDialog(text, {key: meaning}), lambda answer: act() if answer is not None else None)

    def ask(self, text: str, answers: Mapping[str, tuple[str, Callable[[], None]]]) -> None:
        """Ask a question: each answer is a key, its meaning, and what it does; "back" does nothing."""
        self.push_screen(
            QuestionDialog(text, {key: meaning for key, (meaning, _) in answers.items()}),
            lambda answer: answers[answer][1]() if answer is not None else None,
        )

    def in_thread(
        self, work: Callable[[], Any], done: Callable[[Any], None], finally_do: Callable[[], None] | None = None
    ) -> None:
        """Do `work` in a thread and pass its result to `done`; an error is shown. The thread may outlive the app."""

        def do() -> None:
            try:
                answer = work()
            except BenchbotError as error:
                self.call_later(self.tell, error)
            except OSError as error:
                self.call_later(self.notify, str(error), severity="error")
            else:
                self.call_later(done, answer)
            finally:
                if finally_do is not None:
                    self.call_later(finally_do)

        threading.Thread(target=do, daemon=True, name=THREAD_NAME).start()

    # What is alive

    def look(self) -> None:
        """Update `alive` in a thread, unless one is at it: a slow disk must not stop the keys."""
        if not self._looking:
            self._looking = True
            self.in_thread(self._look, self._show_alive, finally_do=self._looked)

    def _looked(self) -> None:
        self._looking = False

    def _show_alive(self, now: Alive) -> None:
        before = {each.job.folder: each.state for each in self.alive.jobs}
        for each in now.jobs:
            was = RUNNING if each.job.folder in self._begun else before.get(each.job.folder)
            if was == RUNNING != each.state:
                self._begun.discard(each.job.folder)
                self.notify(
                    each.summary,
                    title=f"Ended: {each.job.title}",
                    severity="information" if each.state == WELL else "error",
                    timeout=10,
                )
        news = now != self.alive
        self.alive = now
        # Of a run, the screens show how long it is alive.
        for screen in self.screen_stack if news or now.runs else ():
            screen.post_message(self.Looked())

    # Jobs

    def start(
        self,
        words: list[str],
        result: Path | None = None,
        *,
        watch: bool = False,
    ) -> None:
        """Start a command that goes on without the app, and watch the run that it begins."""

        def begin() -> tuple[Job, RunState | None]:
            job = jobs.start(words, result=result)
            self._begun.add(job.folder)
            return job, jobs.wait_for_run(job, START_TIMEOUT_S, LOOK_PERIOD_S) if watch else None

        def begun(found: tuple[Job, RunState | None]) -> None:
            job, state = found
            self.look()
            if state is not None:
                self.watch_run(state)
            elif watch:
                self.show_job(job)

        self.notify("Starting …" if watch else "Begun.", timeout=3)
        self.in_thread(begin, begun)

    def start_again(self, state: RunState) -> None:
        """Start a run once more: the submission from here that it was of, or the run alone."""
        for each in self.alive.jobs:
            words = each.job.words
            if each.job.is_submission and f"--env={state.environment}" in words and f"--seed={state.seed}" in words:
                self.start(list(words), each.job.result, watch=True)
                return
        from benchbot.plugins.tui.forms import run_words

        again = RunRequest(state.task, state.robot, state.environment, state.seed, secret=state.secret)
        self.start(run_words(again), watch=True)

    def end_job(self, text: str, job: Job) -> None:
        """End a job if the answer to a question is yes."""

        def end() -> None:
            try:
                jobs.end(job)
            except BenchbotError as error:
                self.tell(error)

        self.confirm(text, "x", "end it", end)

    def make_report(self, paths: list[Path]) -> None:
        """Make the report of results, notify its path, and show it in a browser where there is one."""

        def written(path: Path) -> None:
            self.notify(str(path), title="The report is written.", timeout=10)
            if self.is_web:
                self.deliver_text(path, open_method="browser", mime_type="text/html")
            # Over ssh there is no browser.
            elif "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ or sys.platform == "darwin":
                self.open_url(path.as_uri())

        self.notify("Making the report …", timeout=3)
        self.in_thread(lambda: result_rows.report(paths, self.catalog), written)


class WatchScreen(Screen[None]):
    """Shows the newest view of a feed until its user leaves; it closes its feed then, and nothing else.

    Its commands run one after the other in threads: a supervisor that does not answer never holds up the screen.
    """

    PERIOD_S = 0.2
    app: BaseApp
    feed: "RunFeed | BatchFeed"

    def __init__(self, feed: "RunFeed | BatchFeed", words: tuple[str, ...]) -> None:
        super().__init__()
        self.feed = feed
        self._words = {name: Words(id=name) for name in words}
        self._under_way: list[str] = []
        self._keys: object = None

    def on_mount(self) -> None:
        """Follow the feed from now on."""
        self._tick()
        self.set_interval(self.PERIOD_S, self._tick)

    def on_unmount(self) -> None:
        """Close the feed without waiting for it: one whose network or disk is gone must not hold up the screen."""
        threading.Thread(target=self.feed.close, daemon=True, name="benchbot-closing").start()

    def on_resize(self) -> None:
        """Lay out for the new size."""
        self.call_after_refresh(self._show_all)

    def action_leave(self) -> None:
        """Stop watching: the run or batch goes on."""
        self.dismiss(None)

    def _tick(self) -> None:
        if self._has_news():
            self._show_all()

    def _has_news(self) -> bool:
        raise NotImplementedError

    def _show_all(self) -> None:
        raise NotImplementedError

    def _ask_to_end(self, text: str, answers: Mapping[str, str], end: Callable[[], None]) -> None:
        """Ask whether to end the run or batch (`x`) or only to leave the screen (`q`)."""
        acts = {"x": end, "q": self.action_leave}
        self.app.push_screen(
            QuestionDialog(text, answers), lambda answer: acts[answer]() if answer is not None else None
        )

    def _show_keys(self, state: object) -> None:
        """Update the keys when the state on which they depend has changed."""
        if state != self._keys:
            self._keys = state
            self.refresh_bindings()

    def _command(
        self,
        name: str,
        call: Callable[[], Any],
        done: Callable[[Any], None] = lambda _: None,
        *,
        beside: bool = False,
    ) -> None:
        """Begin a command, and pass its result to `done`, unless another is under way and it may not go on `beside`."""
        if name in self._under_way or (self._under_way and not beside):
            return

        def ended() -> None:
            self._under_way.remove(name)
            if self.is_attached:
                self._show_all()

        self._under_way.append(name)
        self.app.in_thread(call, lambda value: done(value) if self.is_attached else None, ended)
        self._show_all()
