"""The screens that plug-ins bring: which there are, and opening one, which imports it."""

import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass

from textual.screen import Screen

from benchbot.core import entry_points, plugin_manager
from benchbot.core.errors import BenchbotError
from benchbot.core.light_records import TuiScreen
from benchbot.plugins.tui.keys import MEANINGS

OWN = "benchbot"


@dataclass(frozen=True)
class Registered:
    """A screen, and the distribution that brings it."""

    record: TuiScreen
    distribution: str

    @property
    def key(self) -> str:
        """The key that opens it; empty where that key has another meaning already."""
        key = self.record.key
        is_meant = key in MEANINGS and self.record.name in MEANINGS[key].labels
        return key if is_meant or key not in MEANINGS else ""

    def make(self) -> Screen[None]:
        """Import and return the screen; raises BenchbotError that names the distribution where that fails."""
        try:
            made = pkgutil.resolve_name(self.record.target)()
        # A third party's module may fail in any way at all, and the other screens must go on.
        except (Exception, SystemExit) as error:
            raise self.failure(error) from error
        if not isinstance(made, Screen):
            raise self.failure(TypeError(f"{self.record.target} gave {made!r}, which is no Textual screen"))
        return made

    def failure(self, error: BaseException) -> BenchbotError:
        """Return the error for a screen that has failed."""
        if isinstance(error, BenchbotError):
            return error
        return BenchbotError(
            f"The screen '{self.record.name}' does not work.",
            f"{self.distribution} brings it: {plugin_manager.cause_of(error)}.",
            f"Report this to the author of {self.distribution}; everything else goes on. "
            f"Without it: benchbot uninstall {self.distribution}",
        )


def shipped() -> dict[str, Registered]:
    """Return the screens that BenchBot's own distribution brings, by name; imports no other plug-in."""
    return {record.name: Registered(record, OWN) for record in entry_points.shipped("screens")}


def installed() -> Mapping[str, Registered]:
    """Return all screens by name; raises BenchbotError for two of one name."""
    pool = plugin_manager.load().pool("screens")
    return {name: Registered(provided.value, provided.distribution) for name, provided in pool.items()}
