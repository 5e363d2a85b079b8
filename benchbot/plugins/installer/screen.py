"""The screen of plug-ins: what is installed, what an index offers, and changing it, each change shown before it."""

import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from packaging.utils import canonicalize_name
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Input

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.distributions import Distribution, found_in
from benchbot.plugins.installer.index_search import KINDS, PREFIX
from benchbot.plugins.installer.plan import Action, Change
from benchbot.plugins.installer.plugins_command import addon_row, plugin_row
from benchbot.plugins.screens.child_command import Outcome
from benchbot.plugins.screens.command_screen import CommandScreen
from benchbot.plugins.screens.widgets import Facts, OptionsField, Table, TextField
from benchbot.plugins.v2 import addons as v2_addons
from benchbot.plugins.v2 import trust

INDEX = "index"
"""The name of the setting that keeps the address of the package index."""
SOURCE_MARKS = ("/", "\\", ".whl", "git+", "==")
"""A text with one of these is a source to install from, no word to search for."""

Row = dict[str, Any]


class PluginsScreen(CommandScreen):
    """Lists what is installed; with a word, what an index offers. Nothing changes without a question."""

    HEADING = "Plug-ins"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("slash", "search", "Find", key_display="/", tooltip="Search an index, or name a source to install"),
        Binding("i", "install", "Install", tooltip="Show what would be installed, and ask"),
        Binding("u", "upgrade", "Upgrade", tooltip="Show what a newer version would change, and ask"),
        Binding("X", "uninstall", "Uninstall", tooltip="Show what would be removed, and ask"),
        Binding("f5", "look", "Look again", show=False),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._installed: dict[str, Row] = {}
        self._offers: dict[str, Row] = {}

    def body(self) -> ComposeResult:
        """Yield the search, the list, and what is known of the marked one."""
        self._search_field = TextField(
            "Search", placeholder="a word or kind; or a folder, wheel or git address to install from"
        )
        self._index_field = TextField("Index", self.app.preference(INDEX), placeholder="the one that pip and uv use")
        self._more_field = OptionsField(placeholder="to install, upgrade or uninstall: --find-links FOLDER …")
        yield self._search_field
        yield self._index_field
        yield self._more_field
        with Horizontal(classes="pane"):
            yield Table({"": 1, "Name": 27, "Version": 7, "Kind": 11, "Summary": None})
            with VerticalScroll(classes="details aside", can_focus=False):
                yield Facts(id="facts")

    def on_mount(self) -> None:
        """List what is installed."""
        super().on_mount()
        self.query_one(Table).focus()
        self.action_look()

    def words(self) -> list[str]:
        """Return the command of the search, else the one that concerns the marked plug-in."""
        typed, marked, more = self._typed, self.query_one(Table).marked, self._more_field.words
        if self.focused is not None and self.focused in (self._search_field.widget, self._index_field.widget):
            if _is_source(typed):
                return [*self._install(typed), *more]
            return ["plugins", "search", typed or "WORD", *self._where]
        if marked is None:
            raise BenchbotError("Nothing is marked.", "The list is empty.", "Search for a word.")
        if marked not in self._installed:
            return [*self._install(marked), *more]
        return ["upgrade", marked, *self._where, *more] if more else ["plugins", "show", marked]

    def action_look(self) -> None:
        """Read what is installed, in a thread."""
        self.app.in_thread(installed, self._show_installed)

    def action_search(self) -> None:
        """Move the cursor into the field of the search."""
        self._search_field.focus_input()

    def on_descendant_focus(self) -> None:
        """Show the command of what has the focus."""
        self.show_words()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Search, or look at a source."""
        self.query_one(Table).focus()
        typed = self._typed
        if event.input.name == "Index":
            self.app.prefer(INDEX, event.value.strip())
        if not typed:
            self._offers = {}
            self._show()
        elif _is_source(typed):
            self._plan(self._install(typed), "install it")
        else:
            words = ["plugins", "search", typed, *self._where]
            self.run_command([*words, "--json"], self._found, doing=f"Searching for {typed}", only_looks=True)

    def on_data_table_row_highlighted(self) -> None:
        """Say what is known of the marked one."""
        name = self.query_one(Table).marked
        row = {} if name is None else self._rows.get(name, {})
        self.query_one("#facts", Facts).tell(_facts(row))
        if name in self._installed and "brings" not in row:
            # Its code is looked through for that, which takes a moment.
            self.app.in_thread(partial(details, name), partial(self._tell, name))
        self.show_words()

    def on_data_table_row_selected(self) -> None:
        """Offer to install what is not installed."""
        if self.query_one(Table).marked in self._offers:
            self.action_install()

    def action_install(self) -> None:
        """Look what installing the marked one would change."""
        name = self.query_one(Table).marked
        if name is not None and name not in self._installed:
            self._plan(self._install(name), "install it")
        else:
            self.notify("Search for one first, or press u to upgrade.")

    def action_upgrade(self) -> None:
        """Look what upgrading the marked one would change."""
        name = self._own()
        if name is not None:
            self._plan(["upgrade", name, *self._where], "upgrade it")

    def action_uninstall(self) -> None:
        """Look what uninstalling the marked one would change."""
        name = self._own()
        if name is not None:
            self._plan(["uninstall", name], "uninstall it")

    def settled(self, words: Sequence[str]) -> None:
        """Have what is installed read anew, wherever it may have changed."""
        if words[0] in ("install", "upgrade", "uninstall") and "--dry-run" not in words:
            self.app.forget_catalog()
            if self._is_open:
                self.action_look()

    def failed(self, error: BenchbotError) -> None:
        """Say what was tried, and that it was undone."""
        self.query_one("#facts", Facts).tell({"What was done": "\n  ".join(self.log_lines)})

    @property
    def _is_open(self) -> bool:
        """True while its table is there: when a screen is closed, its widgets go before it does."""
        return self.is_attached and bool(self.query(Table))

    @property
    def _typed(self) -> str:
        return self._search_field.value

    @property
    def _where(self) -> list[str]:
        address = self._index_field.value
        return ["--index-url", address] if address else []

    @property
    def _rows(self) -> Mapping[str, Row]:
        return {**self._offers, **self._installed}

    def _install(self, source: str) -> list[str]:
        return ["install", source, *self._where]

    def _own(self) -> str | None:
        """Return the marked plug-in if it is installed and not BenchBot itself; else say why not."""
        name = self.query_one(Table).marked
        if name in self._installed and name != "benchbot":
            return name
        self.notify("Mark one that is installed and is not BenchBot itself.")
        return None

    def _tell(self, name: str, row: Row) -> None:
        if name in self._installed:
            self._installed[name] = {**self._installed[name], **row}
        if self._is_open and self.query_one(Table).marked == name:
            self.query_one("#facts", Facts).tell(_facts(self._rows[name]))

    def _show_installed(self, rows: dict[str, Row]) -> None:
        self._installed = rows
        if self._is_open:
            self._show()

    def _found(self, outcome: Outcome) -> None:
        self._offers = {row["name"]: row for row in outcome.document}
        self._show()
        if not self._offers:
            self.say("Nothing of that name, kind or summary. Names that do not begin with benchbot- are not looked at.")

    def _show(self) -> None:
        """List what was found, with ✓ where it is installed; without a search what is installed."""
        names = self._offers or self._installed
        table = self.query_one(Table)
        table.fill((name, _cells(self._rows[name], name in self._installed)) for name in names)
        self.on_data_table_row_highlighted()

    def _plan(self, words: list[str], meaning: str) -> None:
        try:
            words = [*words, *self._more_field.words]
        except BenchbotError as error:
            self.show_error(error)
            return
        looking = [*words, "--dry-run", "--json"]
        self.run_command(looking, partial(self._ask, words, meaning), doing="Looking what would change")

    def _ask(self, words: list[str], meaning: str, outcome: Outcome) -> None:
        """Show every change and what it brings; ask, and then make just these."""
        changes = [_change(row) for row in outcome.document["changes"]]
        if not changes:
            self.say("Nothing to do: everything is there already.")
            return
        unknown = [change for change in changes if change.needs_consent]
        lines = [*map(str, changes)]
        if unknown:
            names = ", ".join(change.name for change in unknown)
            lines += ["", f"The code of {names} runs with all your rights, also that of mere dependencies."]
        elif any(change.action is not Action.REMOVE for change in changes):
            lines += ["", "It asks for nothing: no code comes that you have not allowed already."]

        def go() -> None:
            for change in unknown:
                # Just this content: if another comes, the command refuses it.
                trust.give(change.consent_digest, f"{change.name} {change.new}")
            self.run_command([*words, "--json"], self._changed, doing=f"benchbot {words[0]}")

        self.app.ask("\n".join(lines), {"y": (meaning + (" and let its code run" if unknown else ""), go)})

    def _changed(self, outcome: Outcome) -> None:
        done = "\n".join(str(_change(row)) for row in outcome.document["changes"])
        self.say(f"✓ Done, and checked.\n{done}" if done else "Nothing to do.", "green")
        self._offers = {}


def installed() -> dict[str, Row]:
    """Return name, version and summary of each installed plug-in, BenchBot's own last, and of v2's add-ons."""
    plugins = [one for one in _found().values() if one.is_plugin]
    rows = {
        one.name: {"name": one.name, "version": one.version, "summary": one.metadata.metadata["Summary"] or ""}
        for one in sorted(plugins, key=lambda one: (one.name == "benchbot", one.name))
    }
    return {**rows, **{name: {"name": name, "version": "v2", "kind": "add-ons"} for name in v2_addons.installed()}}


def details(name: str) -> Row:
    """Return what `benchbot plugins show` says of a plug-in; empty for one that is gone."""
    if name in v2_addons.installed():
        return addon_row(name)
    found = _found()
    return plugin_row(found[name]) if name in found else {}


def _found() -> dict[str, Distribution]:
    return found_in(dict.fromkeys(Path(folder) for folder in sys.path))


def _is_source(text: str) -> bool:
    return any(mark in text for mark in SOURCE_MARKS)


def _change(row: Mapping[str, Any]) -> Change:
    """Return a change of a plan that was printed as JSON."""
    return Change(
        row["name"],
        Action(row["action"]),
        row["kind"],
        row["from"],
        row["to"],
        row["brings"],
        tuple(row["code"]),
        row["digest"],
        row["origin"],
    )


def _cells(row: Row, is_installed: bool) -> tuple[str, ...]:
    name = str(row["name"])
    kind = row.get("kind") or KINDS.get(str(canonicalize_name(name)).removeprefix(PREFIX).partition("-")[0], "")
    return "✓" if is_installed else "", name, row.get("version", ""), kind, row.get("summary", "")


def _facts(row: Row) -> dict[str, str]:
    """Return what a plug-in is, what it brings, and where it came from."""
    points = row.get("entry_points") or {}
    code = row.get("code") or ()
    brings = row.get("brings", "")
    return {
        "Name": f"{row.get('name', '')} {row.get('version', '')}".strip(),
        "Summary": row.get("summary", ""),
        "Kind": row.get("kind", ""),
        "Brings": f"{brings}: {', '.join(code)}" if code else brings,
        "From": row.get("from", ""),
        "Needs": ", ".join(row.get("requires") or ()),
        "Plug-ins": ", ".join(f"{name} = {module}" for name, module in points.items()),
        "Folder": row.get("path", ""),
    }
