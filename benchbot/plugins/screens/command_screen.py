"""A screen that does with a form what a command does with words: it runs that command, and shows it, to be copied."""

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.widgets import Footer, Static

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.screens.child_command import ChildCommand, Outcome, as_typed


class Services(App[None]):
    """The app of `benchbot tui`, as far as screens use it. Errors are told by it, and threads may outlive it."""

    @property
    def catalog(self) -> Catalog:
        """The installed declarations; the first time it takes a moment: ask for it in a thread."""
        raise NotImplementedError

    def forget_catalog(self) -> None:
        """Read what is installed anew when it is next asked for: something was installed."""
        raise NotImplementedError

    def in_thread(
        self, work: Callable[[], Any], done: Callable[[Any], None], finally_do: Callable[[], None] | None = None
    ) -> None:
        """Do `work` in a thread and pass its result to `done`, in the app; a BenchbotError or OSError is told."""
        raise NotImplementedError

    def tell(self, error: BenchbotError) -> None:
        """Show an error and the way around it."""
        raise NotImplementedError

    def ask(self, text: str, answers: Mapping[str, tuple[str, Callable[[], None]]]) -> None:
        """Ask a question: each answer is a key, its meaning, and what it does; "back" does nothing."""
        raise NotImplementedError

    def start(self, words: list[str], result: Path | None = None, *, watch: bool = False) -> None:
        """Start a command that goes on without the app, and watch the run that it begins."""
        raise NotImplementedError

    def watch_batch(self, folder: Path) -> None:
        """Show a batch."""
        raise NotImplementedError

    def make_report(self, paths: list[Path]) -> None:
        """Make the report of results and show where it is."""
        raise NotImplementedError

    def result_sets(self) -> Mapping[str, Path]:
        """Return the sets of results that are known here, by name; those of the batch that was watched last first."""
        raise NotImplementedError

    def open_screen(self, name: str) -> None:
        """Open a screen that a plug-in brings, by the name of its record."""
        raise NotImplementedError

    def preference(self, name: str) -> str:
        """Return one of the user's settings of the screens, empty where none was made."""
        raise NotImplementedError

    def prefer(self, name: str, value: str) -> None:
        """Make one of these settings, and keep it."""
        raise NotImplementedError


class CommandLine(Static):
    """The command line that does what a form says, to be copied: the words that it was told last."""

    DEFAULT_CSS = "CommandLine { height: auto; max-height: 3; padding: 0 1; background: $boost; color: $text-muted; }"

    def __init__(self) -> None:
        super().__init__(id="words", markup=False)
        self.words: list[str] = []

    def tell(self, make: Callable[[], Sequence[str]]) -> None:
        """Show the words that are made, or why there are none; files below the working folder are shown from there."""
        try:
            self.words = list(make())
        except BenchbotError as error:
            self.words = []
            self.update(Text(error.title, "dim"))
        else:
            here = f"{Path.cwd()}{os.sep}"
            self.update(Text(f"$ {as_typed([word.replace(here, '') for word in self.words])}"))

    def copy(self) -> None:
        """Copy the command line, as far as the terminal lets programs do that."""
        if self.words:
            self.app.copy_to_clipboard(as_typed(self.words))
            self.notify("Copied.", timeout=2)
        else:
            self.notify("There is no command yet.")


COPY = Binding("ctrl+y", "copy", "Copy command", tooltip="Copy the command line that does the same")


class CommandScreen(Screen[None]):
    """The base of such screens. A subclass composes its `body`, says the command's `words`, and calls `run`.

    The command is a child process: its progress is shown, Esc asks whether to end it, and what it would print as an
    error is shown. It goes on when the screen is left, unless it only looks.
    """

    DEFAULT_CSS = """
    CommandScreen > .bar { height: 1; background: $primary; color: $text; padding: 0 1; text-style: bold; }
    CommandScreen > #said { height: auto; max-height: 8; padding: 0 1; }
    CommandScreen > FormField { padding: 0 1; }
    CommandScreen .pane { height: 1fr; }
    CommandScreen .form { height: 1fr; padding: 0 1; scrollbar-size-vertical: 1; }
    CommandScreen .details { width: 42%; height: 1fr; padding: 0 1; border-left: solid $panel; }
    CommandScreen .heading { height: 1; text-style: bold; color: $text-accent; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Back", tooltip="Back; while something is under way, it asks whether to end that"),
        COPY,
    ]
    HEADING = ""
    """The title of the screen."""
    app: Services

    def __init__(self) -> None:
        super().__init__()
        self._child: ChildCommand | None = None
        self._only_looks = False
        self._doing = ""
        self.log_lines: list[str] = []
        """The lines that the last command said on stderr so far."""

    def compose(self) -> ComposeResult:
        """Lay out title, body, what is said, and the command line."""
        yield Static(self.HEADING, classes="bar", id="title", markup=False)
        yield from self.body()
        yield Static(id="said", markup=False)
        yield CommandLine()
        yield Footer()

    def body(self) -> ComposeResult:
        """Yield the widgets between title and command line."""
        raise NotImplementedError

    def words(self) -> list[str]:
        """Return the words of the command that does what the screen says now; raises BenchbotError if there is none."""
        raise NotImplementedError

    @property
    def is_busy(self) -> bool:
        """Whether a command is under way."""
        return self._child is not None

    def on_mount(self) -> None:
        """Show the command."""
        self.query_one("#said").display = False
        self.show_words()

    def show_words(self) -> None:
        """Show the command line as it is now."""
        self.query_one(CommandLine).tell(self.words)

    def on_input_changed(self) -> None:
        """Show the command as it is now."""
        self.show_words()

    def on_select_changed(self) -> None:
        """Show the command as it is now."""
        self.show_words()

    def say(self, text: str, style: str = "") -> None:
        """Show what is under way, or what came of it; nothing for an empty text."""
        said = self.query_one("#said", Static)
        said.display = bool(text)
        said.update(Text(text, style))

    def show_error(self, error: BenchbotError) -> None:
        """Show an error, and the way around it, until something else is begun."""
        lines = [Text(f"✗ {error.title}", "bold red"), Text(error.why), Text(f"→ {error.fix}", "bold")]
        said = self.query_one("#said", Static)
        said.display = True
        said.update(Text("\n").join(line for line in lines if line.plain.strip("→ ")))

    def run_words(
        self, more: Sequence[str], done: Callable[[Outcome], None], *, doing: str, only_looks: bool = False
    ) -> None:
        """Run what the screen says now, with more words, as `run_command`; show why there is no command, if so."""
        try:
            words = self.words()
        except BenchbotError as error:
            self.show_error(error)
            return
        self.run_command([*words, *more], done, doing=doing, only_looks=only_looks)

    def run_command(
        self,
        words: Sequence[str],
        done: Callable[[Outcome], None],
        *,
        doing: str,
        allowed: Collection[int] = (0,),
        folder: Path | None = None,
        only_looks: bool = False,
    ) -> None:
        """Run a command, and pass its outcome to `done` while the screen is there; one at a time.

        `allowed` are the exit codes that are no error; one that `only_looks` is ended when the screen is left.
        """
        if self.is_busy:
            self.notify(f"{self._doing} is under way: Esc asks whether to end that.")
            return
        app = self.app  # the thread that reads the command's output has none
        try:
            command = ChildCommand(words, lambda line: app.call_later(self._progress, command, line), folder)
        except BenchbotError as error:
            self.show_error(error)
            return
        self._child, self._only_looks, self._doing, self.log_lines = command, only_looks, doing, []
        self.say(f"{doing} …")

        def wait() -> Outcome | BenchbotError:
            try:
                return command.wait(allowed)
            except BenchbotError as error:
                return error

        def ended(outcome: Outcome | BenchbotError) -> None:
            self._child = None
            self.settled(words)
            if not self.is_attached:
                self._tell_of_end(outcome)
            elif isinstance(outcome, BenchbotError):
                self.show_error(outcome)
                self.failed(outcome)
            else:
                self.say("")
                try:
                    done(outcome)
                except BenchbotError as error:
                    self.show_error(error)

        self.app.in_thread(wait, ended)

    def settled(self, words: Sequence[str]) -> None:
        """Act on the end of a command, however it ended and whether the screen is still there."""

    def failed(self, error: BenchbotError) -> None:
        """Act on the end of a command with an error, which is shown already."""

    def action_copy(self) -> None:
        """Copy the command line, as far as the terminal lets programs do that."""
        self.query_one(CommandLine).copy()

    def action_leave(self) -> None:
        """Leave the screen; ask first when something is under way."""
        command = self._child
        if command is None:
            self.dismiss(None)
        elif self._only_looks:
            command.cancel()
            self.dismiss(None)
        else:
            answers: dict[str, tuple[str, Callable[[], None]]] = {
                "x": ("end it: what it has begun is undone", command.cancel),
                "w": ("only leave the screen: it goes on", self._close),
            }
            self.app.ask(f"{self._doing} is under way. End it?", answers)

    def _close(self) -> None:
        self.dismiss(None)

    def _progress(self, command: ChildCommand, line: str) -> None:
        if self.is_attached and self._child is command:
            self.log_lines.append(line)
            self.say(f"{self._doing} …\n{line.strip()}")

    def _tell_of_end(self, outcome: Outcome | BenchbotError) -> None:
        if isinstance(outcome, BenchbotError):
            if not self._only_looks:
                self.app.tell(outcome)
        elif not self._only_looks:
            self.app.notify("It has ended well.", title=self._doing)
