"""The screen of any command: a form of its arguments and options, and what it printed."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.events import DescendantFocus
from textual.widgets import Input, Select

from benchbot.cli.app import Stub
from benchbot.core.errors import BenchbotError
from benchbot.core.light_records import Command
from benchbot.plugins.screens.child_command import Outcome
from benchbot.plugins.screens.command_screen import CommandScreen
from benchbot.plugins.screens.widgets import ChoiceField, Facts, TextField, words_of

ALTERNATIVES = re.compile(r"[a-z0-9_-]+(\|[a-z0-9_-]+)+")
"""A metavar that is a list of all values."""
KEPT_LINES = 1000


class AnyCommandScreen(CommandScreen):
    """Runs a command, or one of its sub-commands, by a form. It has no terminal there: what it would ask is refused."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "start", "Run it", tooltip="Run the command as the line at the bottom says"),
        Binding(
            "ctrl+b", "begin", "As a job", tooltip="Run it as a job: it goes on without the screens, home lists it"
        ),
    ]
    DEFAULT_CSS = """
    AnyCommandScreen .form { width: 50%; }
    AnyCommandScreen FormField > Label { width: 22; }
    """

    def __init__(self, record: Command) -> None:
        super().__init__()
        self.HEADING = f"benchbot {record.name}"
        self._record = record
        self._forms: dict[str, Any] = {}
        self._which: ChoiceField | None = None
        self._chosen = ""
        self._help = record.help
        self.fields: dict[str, tuple[Any, TextField | ChoiceField]] = {}
        """The parameters of the chosen command, each with its field, by label."""

    def body(self) -> ComposeResult:
        """Yield room for the form, for what is said of it, and for what the command prints."""
        with Horizontal(classes="pane"):
            yield VerticalScroll(classes="form", can_focus=False)
            with VerticalScroll(classes="details main"):
                yield Facts(self._record.help, id="about")
                yield Facts(id="printed")

    def on_mount(self) -> None:
        """Import the command in a thread: some take a while."""
        super().on_mount()
        self.app.in_thread(lambda: dict(leaves(Stub(self._record).load())), self._take)

    def words(self) -> list[str]:
        """Return the command; raises BenchbotError for what is missing of it."""
        options: list[str] = []
        arguments: list[str] = []
        for label, (parameter, field) in self.fields.items():
            value = field.value
            if parameter.required and not value:
                raise BenchbotError(f"{label.rstrip(' *')} is missing.", parameter.help or "", "Fill it in.")
            if not value:
                continue
            several = parameter.nargs == -1 or getattr(parameter, "multiple", False)
            values = words_of(value) if several else [value]
            if parameter.param_type_name == "argument":
                arguments += values
            elif parameter.is_flag:
                options.append(value)
            else:
                options += [f"{parameter.opts[0]}={each}" for each in values]
        separator = ["--"] if any(each.startswith("-") for each in arguments) else []
        return [self._record.name, *self._chosen.split(), *options, *separator, *map(_at_home, arguments)]

    def on_select_changed(self, event: Select.Changed | None = None) -> None:
        """Show the form of the chosen sub-command, and the command as it is now."""
        if event is not None and self._which is not None and event.select is self._which.widget:
            self._show_form(self._which.value)
        self.show_words()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Go on to the next field."""
        self.focus_next()

    def on_descendant_focus(self, event: DescendantFocus) -> None:
        """Say what the field is for."""
        parameter, _ = self.fields.get(str(event.widget.name), (None, None))
        if parameter is not None:
            self._about(parameter.help or "", " ".join(_names(parameter)))

    def action_start(self) -> None:
        """Run the command."""
        words = self._complete()
        if words:
            self.query_one("#printed", Facts).update("")
            self.run_command(words, self._ended, doing=f"benchbot {words[0]}", allowed=range(256))

    def action_begin(self) -> None:
        """Run the command as a job."""
        words = self._complete()
        if words:
            self.app.start(words)

    def _complete(self) -> list[str]:
        """Return the command; empty, and said why, when something is missing of it."""
        try:
            return self.words()
        except BenchbotError as error:
            self.show_error(error)
            return []

    def _take(self, forms: Mapping[str, Any]) -> None:
        if not self.is_attached:
            return
        self._forms = dict(forms)
        if len(self._forms) > 1 or "" not in self._forms:
            self._which = ChoiceField("Command", [(name or self._record.name, name) for name in self._forms])
            self.query_one(".form").mount(self._which)
        self._show_form(next(iter(self._forms)))

    def _show_form(self, chosen: str) -> None:
        self._chosen = chosen
        form = self.query_one(".form")
        form.remove_children([field for _, field in self.fields.values()])
        command = self._forms[chosen]
        self.fields = {label: (parameter, _field(label, parameter)) for label, parameter in _labelled(command)}
        form.mount(*(field for _, field in self.fields.values()))
        self._help = " ".join((command.help or "").partition("\n\n")[0].split())
        self._about("", "")
        self.show_words()

    def _about(self, text: str, name: str) -> None:
        parts = (f"{self._help}\n\n", (f"{name}\n", "bold"), f"{text}\n") if name else (f"{self._help}\n",)
        self.query_one("#about", Facts).update(Text.assemble(*parts))

    def _ended(self, outcome: Outcome) -> None:
        lines = [*outcome.said, *outcome.output.splitlines()][-KEPT_LINES:]
        self.query_one("#printed", Facts).update(Text("\n".join(lines)))
        if outcome.code:
            self.show_error(outcome.error())
        else:
            self.say("✓ It has ended well.", "green")


def leaves(command: Any, words: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the commands that do something: the words after the first one's name, and the command."""
    children: Mapping[str, Any] = getattr(command, "commands", {})
    if not children or command.invoke_without_command:
        yield words, command
    for name, child in children.items():
        if not child.hidden:
            yield from leaves(child, f"{words} {name}".strip())


def offered(command: Any) -> list[Any]:
    """Return the parameters of a command that can be given, required ones first."""
    shown = [each for each in command.params if not getattr(each, "hidden", False) and each.name != "help"]
    return sorted(shown, key=lambda each: (not each.required, each.param_type_name != "argument"))


def _labelled(command: Any) -> Iterator[tuple[str, Any]]:
    for parameter in offered(command):
        yield f"{_names(parameter)[0]}{' *' if parameter.required else ''}", parameter


def _names(parameter: Any) -> list[str]:
    return [*parameter.opts, *getattr(parameter, "secondary_opts", ())]


def _field(label: str, parameter: Any) -> TextField | ChoiceField:
    if getattr(parameter, "is_flag", False):
        flags = [name for name in _names(parameter) if name.startswith("--")]
        return ChoiceField(label, [("", ""), *((name, name) for name in flags)])
    metavar = parameter.metavar or ""
    if ALTERNATIVES.fullmatch(metavar) and not getattr(parameter, "multiple", False) and parameter.nargs == 1:
        return ChoiceField(label, [("", ""), *((value, value) for value in metavar.split("|"))])
    return TextField(label, placeholder=metavar, name=label)


def _at_home(word: str) -> str:
    """Return a word with the home folder in place of a tilde, as a shell does."""
    return str(Path(word).expanduser()) if word.startswith("~") else word
