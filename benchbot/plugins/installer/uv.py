"""Installing with uv. What it says is read as uv 0.13 says it."""

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchbot.plugins.installer.distributions import normal
from benchbot.plugins.installer.environment import Environment
from benchbot.plugins.installer.indexes import Indexes
from benchbot.plugins.installer.installer_errors import complaint
from benchbot.plugins.installer.installers import Order, Pin, write_lines
from benchbot.plugins.installer.running import Done, Runner

_PLAN = re.compile(r"^ ([+~]) ([\w.-]+)(?:==(\S+))?(?: \(from (.+)\))?$", re.MULTILINE)
_HASHES = re.compile(r"^([\w.-]+)==.*?(?=^\S|\Z)", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Uv:
    """uv, as the words that start it, for one environment."""

    command: Sequence[str]
    environment: Environment
    runner: Runner
    name: str = "uv"

    def resolve(self, order: Order) -> list[Pin]:
        """Return what would be installed; changes nothing."""
        done = self._install(order, "--dry-run")
        asked = {normal(line.partition(" @ ")[0]): line for line in order.lines if " @ " in line}
        return [
            Pin(normal(name), version, asked.get(normal(name)) or (f"{name} @ {url}" if url else f"{name}=={version}"))
            for _, name, version, url in _PLAN.findall(done.err)
        ]

    def unpack(self, order: Order, folder: Path) -> None:
        """Unpack exactly the pinned lines into a folder."""
        self._install(order, "--target", str(folder), "--no-deps")

    def install(self, order: Order) -> None:
        """Install exactly the pinned lines, over whatever is there."""
        self._install(order, "--no-deps", "--reinstall")

    def remove(self, names: Sequence[str]) -> None:
        """Uninstall distributions."""
        self._pip("uninstall", *names)

    def build(self, source: Path, folder: Path, indexes: Indexes) -> None:
        """Build a wheel of a project and put it into a folder."""
        words = ["build", "--wheel", "--python", str(self.environment.python), "--out-dir", str(folder)]
        self._run([*words, *indexes.words(), str(source)], indexes)

    def hashes(self, pins: Sequence[Pin], indexes: Indexes) -> dict[str, list[str]]:
        """Return by name the hashes `sha256:…` of the files that an index offers for pins."""
        with tempfile.TemporaryDirectory() as folder:
            lines = write_lines(Path(folder), [f"{pin.name}=={pin.version}" for pin in pins])
            words = ["pip", "compile", "--python", str(self.environment.python), "--no-deps", "--generate-hashes"]
            done = self._run([*words, "--no-header", "--no-annotate", *indexes.words(), str(lines)], indexes)
        found = {normal(match[1]): re.findall(r"--hash=(\w+:\w+)", match[0]) for match in _HASHES.finditer(done.out)}
        return {name: sorted(hashes) for name, hashes in found.items()}

    def _install(self, order: Order, *words: str) -> Done:
        with tempfile.TemporaryDirectory() as folder:
            lines = write_lines(Path(folder), order.lines)
            upgrades = [word for name in sorted(order.upgrade) for word in ("--upgrade-package", name)]
            fixed = write_lines(Path(folder), order.fixed, "constraints.txt")
            conditions = [
                *(["-c", str(fixed)] if order.fixed else []),
                *(["--require-hashes"] if order.require_hashes else []),
                *(["--no-deps"] if order.alone and "--no-deps" not in words else []),
                *([] if order.may_build else ["--only-binary", ":all:"]),
            ]
            options = [*order.indexes.words(), *conditions, *upgrades]
            return self._pip("install", *options, "-r", str(lines), *words, indexes=order.indexes)

    def _pip(self, verb: str, *words: str, indexes: Indexes | None = None) -> Done:
        return self._run(
            ["pip", verb, "--python", str(self.environment.python), "--no-progress", "--color", "never", *words],
            indexes,
        )

    def _run(self, words: Sequence[str], indexes: Indexes | None) -> Done:
        variables = (indexes or Indexes()).variables("UV_DEFAULT_INDEX", "UV_INDEX")
        done = self.runner.run([*self.command, *words], {"UV_NO_COMPILE_BYTECODE": "1", **variables})
        if done.code != 0:
            raise complaint("uv", done)
        return done
