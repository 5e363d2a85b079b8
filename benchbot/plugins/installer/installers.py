"""uv and pip behind one interface. pip's report of a dry run is a documented format; uv's output is that of uv 0.13."""

import importlib.util
import json
import re
import shutil
import sys
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from packaging.utils import canonicalize_name

from benchbot.cli.kit.status_line import working
from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.environment import Environment
from benchbot.plugins.installer.indexes import Indexes
from benchbot.plugins.installer.installer_errors import installer_error
from benchbot.plugins.installer.subprocesses import ProcessResult, Runner

_UV_PLAN = re.compile(r"^ ([+~]) ([\w.-]+)(?:==(\S+))?(?: \(from (.+)\))?$", re.MULTILINE)
_UV_HASHES = re.compile(r"^([\w.-]+)==.*?(?=^\S|\Z)", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Requirements:
    """Lines of a requirements file, and the conditions under which they are resolved or installed.

    A line that means one version is a pin; `constraints` are pins of distributions that must not change. The newest
    version is wanted of the names in `upgrade`. `may_build` allows distributions without a wheel, whose own code runs
    to build one.
    """

    lines: Sequence[str]
    upgrade: frozenset[str] = frozenset()
    constraints: Sequence[str] = ()
    require_hashes: bool = False
    no_dependencies: bool = False
    may_build: bool = False
    indexes: Indexes = field(default_factory=Indexes)


@dataclass(frozen=True)
class Installer(ABC):
    """uv or pip, for one environment. Every method raises BenchbotError with the reason that the program gave."""

    environment: Environment
    runner: Runner
    name: ClassVar[str]
    _OVERWRITE: ClassVar[str]

    @abstractmethod
    def resolve(self, requirements: Requirements) -> dict[str, str]:
        """Return the pins of what would be installed, by normalized name; changes nothing."""

    def unpack(self, requirements: Requirements, folder: Path) -> None:
        """Unpack exactly the pinned lines into a folder."""
        self._install(requirements, "--no-deps", "--target", str(folder))

    def install(self, requirements: Requirements) -> None:
        """Install exactly the pinned lines, over whatever is there."""
        self._install(requirements, "--no-deps", self._OVERWRITE)

    def remove(self, names: Sequence[str]) -> None:
        """Uninstall distributions."""
        self._pip("uninstall", *names)

    @abstractmethod
    def build(self, source: Path, folder: Path, indexes: Indexes) -> None:
        """Build a wheel of a project and put it into a folder."""

    @abstractmethod
    def hashes(self, pins: Sequence[str], indexes: Indexes) -> dict[str, list[str]]:
        """Return the hashes `sha256:…` of the files that an index offers for pins, by normalized name."""

    @abstractmethod
    def _upgrades(self, names: frozenset[str]) -> list[str]: ...

    @abstractmethod
    def _pip(self, verb: str, *words: str, indexes: Indexes | None = None) -> ProcessResult: ...

    def _install(self, requirements: Requirements, *words: str) -> ProcessResult:
        with tempfile.TemporaryDirectory() as temporary:
            constraints = ["-c", _written(temporary, "constraints.txt", requirements.constraints)]
            conditions = [
                *requirements.indexes.options(),
                *(constraints if requirements.constraints else []),
                *(["--require-hashes"] if requirements.require_hashes else []),
                *(["--no-deps"] if requirements.no_dependencies and "--no-deps" not in words else []),
                *([] if requirements.may_build else ["--only-binary", ":all:"]),
                *self._upgrades(requirements.upgrade),
            ]
            lines = _written(temporary, "requirements.txt", requirements.lines)
            return self._pip("install", *conditions, "-r", lines, *words, indexes=requirements.indexes)

    def _run(self, words: Sequence[str], variables: dict[str, str], folder: Path | None = None) -> ProcessResult:
        with working(f"{self.name} is at work"):
            done = self.runner.run(words, variables, folder=folder)
        if done.code != 0:
            raise installer_error(self.name, done)
        return done


class Pip(Installer):
    """The pip of the environment."""

    name = "pip"
    _OVERWRITE = "--force-reinstall"

    def resolve(self, requirements: Requirements) -> dict[str, str]:
        """Return the pins of what would be installed, by normalized name; changes nothing."""
        pins = {}
        for item in self._report(requirements):
            name, url = item["metadata"]["name"], item["download_info"]["url"]
            line = f"{name} @ {url}" if item.get("is_direct") else f"{name}=={item['metadata']['version']}"
            digest = _pip_sha256(item)
            pins[str(canonicalize_name(name))] = f"{line} --hash=sha256:{digest}" if digest else line
        return pins

    def build(self, source: Path, folder: Path, indexes: Indexes) -> None:
        """Build a wheel of a project and put it into a folder."""
        words = ["--no-deps", "--wheel-dir", str(folder), *indexes.options(), str(source)]
        self._pip("wheel", *words, indexes=indexes)

    def hashes(self, pins: Sequence[str], indexes: Indexes) -> dict[str, list[str]]:
        """Return the hashes `sha256:…` of the files that an index offers for pins, by normalized name."""
        report = self._report(Requirements(pins, indexes=indexes), "--no-deps", "--ignore-installed")
        digests = {canonicalize_name(item["metadata"]["name"]): _pip_sha256(item) for item in report}
        return {name: [f"sha256:{digest}"] for name, digest in digests.items() if digest}

    def _report(self, requirements: Requirements, *words: str) -> list[dict[str, Any]]:
        with tempfile.TemporaryDirectory() as temporary:
            report = Path(temporary) / "report.json"
            self._install(requirements, "--dry-run", "--report", str(report), *words)
            return list(json.loads(report.read_text("utf-8"))["install"])

    def _upgrades(self, names: frozenset[str]) -> list[str]:
        return ["--upgrade"] if names else []

    def _pip(self, verb: str, *words: str, indexes: Indexes | None = None) -> ProcessResult:
        variables = (indexes or Indexes()).variables("PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL")
        quiet = {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INPUT": "1", "PIP_NO_COLOR": "1", "PIP_RETRIES": "2"}
        options = {"install": ["--no-compile"], "uninstall": ["--yes"]}.get(verb, [])
        command = [str(self.environment.python), "-m", "pip", verb, "--quiet", *options, *words]
        # In another folder than the user's: `python -m` looks for modules in the current one.
        return self._run(command, {**quiet, **variables}, self.environment.prefix)


@dataclass(frozen=True)
class Uv(Installer):
    """uv; `command` are the words that start it."""

    command: Sequence[str] = ("uv",)
    name = "uv"
    _OVERWRITE = "--reinstall"

    def resolve(self, requirements: Requirements) -> dict[str, str]:
        """Return the pins of what would be installed, by normalized name; changes nothing."""
        done = self._install(requirements, "--dry-run")
        asked = {canonicalize_name(line.partition(" @ ")[0]): line for line in requirements.lines if " @ " in line}
        found = [(canonicalize_name(name), *rest) for _, name, *rest in _UV_PLAN.findall(done.err)]
        return {
            name: asked.get(name) or (f"{name} @ {url}" if url else f"{name}=={version}")
            for name, version, url in found
        }

    def build(self, source: Path, folder: Path, indexes: Indexes) -> None:
        """Build a wheel of a project and put it into a folder."""
        python = str(self.environment.python)
        words = ["build", "--wheel", "--python", python, "--out-dir", str(folder), *indexes.options(), str(source)]
        self._uv(words, indexes)

    def hashes(self, pins: Sequence[str], indexes: Indexes) -> dict[str, list[str]]:
        """Return the hashes `sha256:…` of the files that an index offers for pins, by normalized name."""
        with tempfile.TemporaryDirectory() as temporary:
            lines = _written(temporary, "requirements.txt", pins)
            words = ["pip", "compile", "--python", str(self.environment.python), "--no-deps", "--generate-hashes"]
            done = self._uv([*words, "--no-header", "--no-annotate", *indexes.options(), lines], indexes)
        return {
            canonicalize_name(found[1]): sorted(re.findall(r"--hash=(\w+:\w+)", found[0]))
            for found in _UV_HASHES.finditer(done.out)
        }

    def _upgrades(self, names: frozenset[str]) -> list[str]:
        return [word for name in sorted(names) for word in ("--upgrade-package", name)]

    def _pip(self, verb: str, *words: str, indexes: Indexes | None = None) -> ProcessResult:
        options = ["--python", str(self.environment.python), "--no-progress", "--color", "never"]
        return self._uv(["pip", verb, *options, *words], indexes)

    def _uv(self, words: Sequence[str], indexes: Indexes | None) -> ProcessResult:
        variables = (indexes or Indexes()).variables("UV_DEFAULT_INDEX", "UV_INDEX")
        return self._run([*self.command, *words], {"UV_NO_COMPILE_BYTECODE": "1", **variables})


def choose(wanted: str | None, environment: Environment, runner: Runner) -> Installer:
    """Return the installer of this name, or uv if there is one, else pip; raises BenchbotError if there is none."""
    if wanted not in (None, "uv", "pip"):
        raise BenchbotError(
            f"'{wanted}' is no installer.", "There are uv and pip.", "Leave it out, or give --installer uv or pip."
        )
    if wanted != "pip":
        on_path = shutil.which("uv")
        if on_path is not None:
            return Uv(environment, runner, [on_path])
        if importlib.util.find_spec("uv") is not None:
            return Uv(environment, runner, [sys.executable, "-m", "uv"])
    if wanted == "uv":
        raise BenchbotError(
            "uv is not installed.", "It is neither on the PATH nor in this environment.", "pip install uv"
        )
    if importlib.util.find_spec("pip") is None:
        raise BenchbotError(
            "There is nothing to install with.",
            f"{environment.prefix} has neither uv nor pip.",
            f"Put pip into it: {sys.executable} -m ensurepip",
        )
    return Pip(environment, runner)


def _written(folder: str, name: str, lines: Sequence[str]) -> str:
    path = Path(folder, name)
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return str(path)


def _pip_sha256(item: dict[str, Any]) -> str | None:
    found = item["download_info"].get("archive_info", {}).get("hashes", {}).get("sha256")
    return None if found is None else str(found)
