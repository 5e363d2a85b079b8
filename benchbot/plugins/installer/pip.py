"""Installing with the pip of the environment. Its report of a dry run is a documented format."""

import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.plugins.installer.distributions import normal
from benchbot.plugins.installer.environment import Environment
from benchbot.plugins.installer.indexes import Indexes
from benchbot.plugins.installer.installer_errors import complaint
from benchbot.plugins.installer.installers import Order, Pin, write_lines
from benchbot.plugins.installer.running import Done, Runner


@dataclass(frozen=True)
class Pip:
    """pip, for the environment that it is in."""

    environment: Environment
    runner: Runner
    name: str = "pip"

    def resolve(self, order: Order) -> list[Pin]:
        """Return what would be installed; changes nothing."""
        return [_pin(item) for item in self._report(order)]

    def unpack(self, order: Order, folder: Path) -> None:
        """Unpack exactly the pinned lines into a folder."""
        self._install(order, "--no-deps", "--no-compile", "--target", str(folder))

    def install(self, order: Order) -> None:
        """Install exactly the pinned lines, over whatever is there."""
        self._install(order, "--no-deps", "--no-compile", "--force-reinstall")

    def remove(self, names: Sequence[str]) -> None:
        """Uninstall distributions."""
        self._run(["uninstall", "--yes", *names], None)

    def build(self, source: Path, folder: Path, indexes: Indexes) -> None:
        """Build a wheel of a project and put it into a folder."""
        self._run(["wheel", "--no-deps", "--wheel-dir", str(folder), *indexes.words(), str(source)], indexes)

    def hashes(self, pins: Sequence[Pin], indexes: Indexes) -> dict[str, list[str]]:
        """Return by name the hashes `sha256:…` of the files that an index offers for pins."""
        order = Order([f"{pin.name}=={pin.version}" for pin in pins], indexes=indexes)
        report = self._report(order, "--no-deps", "--ignore-installed")
        return {_pin(item).name: [f"sha256:{found}"] for item in report if (found := _sha256(item))}

    def _report(self, order: Order, *words: str) -> list[dict[str, Any]]:
        with tempfile.TemporaryDirectory() as folder:
            report = Path(folder) / "report.json"
            self._install(order, "--dry-run", "--report", str(report), *words)
            return list(json.loads(report.read_text("utf-8"))["install"])

    def _install(self, order: Order, *words: str) -> Done:
        with tempfile.TemporaryDirectory() as folder:
            lines = write_lines(Path(folder), order.lines)
            fixed = write_lines(Path(folder), order.fixed, "constraints.txt")
            conditions = [
                *(["-c", str(fixed)] if order.fixed else []),
                *(["--require-hashes"] if order.require_hashes else []),
                *(["--no-deps"] if order.alone and "--no-deps" not in words else []),
                *([] if order.may_build else ["--only-binary", ":all:"]),
                *(["--upgrade"] if order.upgrade else []),
            ]
            return self._run(["install", *order.indexes.words(), *conditions, "-r", str(lines), *words], order.indexes)

    def _run(self, words: Sequence[str], indexes: Indexes | None) -> Done:
        variables = (indexes or Indexes()).variables("PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL")
        quiet = {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INPUT": "1", "PIP_NO_COLOR": "1", "PIP_RETRIES": "2"}
        command = [str(self.environment.python), "-m", "pip", words[0], "--quiet", *words[1:]]
        # Away from the user's folder: `python -m` looks for modules there.
        done = self.runner.run(command, {**quiet, **variables}, folder=self.environment.prefix)
        if done.code != 0:
            raise complaint("pip", done)
        return done


def _pin(item: dict[str, Any]) -> Pin:
    name, version = str(item["metadata"]["name"]), str(item["metadata"]["version"])
    line = f"{name} @ {item['download_info']['url']}" if item.get("is_direct") else f"{name}=={version}"
    found = _sha256(item)
    return Pin(normal(name), version, f"{line} --hash=sha256:{found}" if found else line)


def _sha256(item: dict[str, Any]) -> str | None:
    found = item["download_info"].get("archive_info", {}).get("hashes", {}).get("sha256")
    return None if found is None else str(found)
