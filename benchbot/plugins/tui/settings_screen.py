"""The screen of settings: what the screens keep, and where everything else is kept, with the variable that moves it."""

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from textual.app import ComposeResult
from textual.containers import VerticalScroll
from textual.widgets import Input, Select, Static

from benchbot.core import resources
from benchbot.core.errors import BenchbotError
from benchbot.plugins.screens.command_screen import CommandScreen
from benchbot.plugins.screens.widgets import ChoiceField, Facts, TextField

FOLDERS: Mapping[str, tuple[str, Callable[[], Path]]] = {
    "Caches, which are computed again": ("BENCHBOT_CACHE_DIR", resources.cache_dir),
    "Runs, logs and these settings": ("BENCHBOT_STATE_DIR", resources.state_dir),
    "What was installed beside distributions": ("BENCHBOT_DATA_DIR", resources.data_dir),
}
VARIABLES = ("BENCHBOT_PLUGINS", "BENCHBOT_ADDONS", "BENCHBOT_TAICHI", "NO_COLOR")
COLOR_BLIND_SAFE = ("textual-dark", "textual-light", "textual-ansi", "nord", "gruvbox", "solarized-light")
MIB = 2**20
WAYS: Mapping[str, str] = {
    "halfcell": "half cells  ▀▄",
    "sextant": "sextants, six pixels a cell  \U0001fb00\U0001fb0b\U0001fb28\U0001fb2d\U0001fb39",
    "octant": "octants, eight pixels a cell  \U0001cd00\U0001cd18\U0001cd4f\U0001cd70\U0001cdb1",
    "kitty": "kitty's graphics",
    "sixel": "sixel graphics",
    "none": "no pictures",
}
"""How pictures can be drawn; of characters that not every font has, some stand beside: who sees boxes has none."""


class SettingsScreen(CommandScreen):
    """Each setting is kept as soon as it is made."""

    HEADING = "Settings"

    def body(self) -> ComposeResult:
        """Yield the settings, then what is kept where."""
        themes = [name for name in COLOR_BLIND_SAFE if name in self.app.available_themes]
        themes += sorted(self.app.available_themes.keys() - set(themes))
        self._theme_field = ChoiceField("Colours", [(name, name) for name in themes], value=self.app.theme)
        yield self._theme_field
        ways = {"auto": "as the terminal answers when it is asked", **WAYS}
        chosen = self.app.preference("images")
        self._images_field = ChoiceField(
            "Pictures", [(words, way) for way, words in ways.items()], value=chosen if chosen in ways else "auto"
        )
        yield self._images_field
        yield TextField("Package index", self.app.preference("index"), placeholder="what pip and uv use", name="index")
        with VerticalScroll(classes="text"):
            yield Static("Folders", classes="heading")
            yield Facts(id="folders")
            yield Static("Variables of this session", classes="heading")
            yield Facts(id="variables")

    def on_mount(self) -> None:
        """Measure the folders in a thread."""
        super().on_mount()
        self.query_one("#variables", Facts).tell({name: os.environ.get(name, "not set") for name in VARIABLES})
        self.app.in_thread(folders, self._show_folders)

    def words(self) -> list[str]:
        """Raise BenchbotError: settings are the screens' own."""
        raise BenchbotError("These settings are of the screens alone; commands use the variables above.", "", "")

    def on_select_changed(self, event: Select.Changed | None = None) -> None:
        """Take a theme at once, and keep it; the way of pictures is kept, for the next start."""
        theme = self._theme_field.value
        way = self._images_field.value
        if event is not None and way != (self.app.preference("images") or "auto"):
            self._keep("images", way)
            self.say("Pictures are drawn so from the next start of benchbot tui on.")
        if event is not None and theme in self.app.available_themes and theme != self.app.theme:
            self.app.theme = theme
            self._keep("theme", theme)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Keep the package index."""
        self._keep("index", event.value.strip())
        self.notify("Kept.", timeout=2)

    def on_input_changed(self) -> None:
        """Wait for Enter."""

    def _keep(self, name: str, value: str) -> None:
        try:
            self.app.prefer(name, value)
        except BenchbotError as error:
            self.show_error(error)

    def _show_folders(self, found: Mapping[str, str]) -> None:
        if self.is_attached:
            self.query_one("#folders", Facts).tell(found)


def folders() -> dict[str, str]:
    """Return each folder that BenchBot keeps things in, its size, and the variable that names another."""
    found = {}
    for label, (variable, place) in FOLDERS.items():
        try:
            folder = place()
        except BenchbotError as error:
            found[label] = f"{error.title} {error.fix}"
            continue
        found[label] = f"{folder}  {_size(folder) / MIB:.1f} MiB; another one: export {variable}=FOLDER"
    return found


def _size(folder: Path) -> int:
    total = 0
    for path in folder.rglob("*"):
        # Files come and go while runs are alive.
        with suppress(OSError):
            total += path.lstat().st_size
    return total
