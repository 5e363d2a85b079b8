"""A real virtual environment with BenchBot in it, made in a moment: its files are links to those of this one."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

from benchbot.plugins.installer.distributions import Distribution, found_in, with_dependencies

HERE = Path(sysconfig.get_path("purelib"))
SAMPLE = Path(__file__).parents[2] / "sample_plugin"
Entry = tuple[int, str]
LOCKS = (".benchbot", ".benchbot/lock", ".lock")


@dataclass
class Environment:
    """The environment, in a home of its own, and what runs in it."""

    prefix: Path
    home: Path
    _hashes: dict[tuple[int, int, int], str] = field(default_factory=dict)

    @property
    def python(self) -> Path:
        return self.prefix / "bin" / "python"

    @property
    def site(self) -> Path:
        (found,) = self.prefix.glob("lib/python*/site-packages")
        return found

    def words(self, *words: str) -> list[str]:
        return [str(self.python), "-m", "benchbot", *words]

    def environ(self, changes: Mapping[str, str] | None = None) -> dict[str, str]:
        """Nothing of this machine's settings of pip, uv and BenchBot, and a home of its own."""
        kept = {
            name: value
            for name, value in os.environ.items()
            if not re.match(r"BENCHBOT_|PYTEST_|PIP_|UV_|VIRTUAL_ENV|PYTHONPATH|.*_proxy$", name, re.IGNORECASE)
        }
        own = {
            "HOME": str(self.home),
            "XDG_CONFIG_HOME": str(self.home / "config"),
            "PATH": os.pathsep.join([str(self.home / "bin"), "/usr/bin", "/bin"]),
            "PYTHONPATH": str(SAMPLE),
            "BENCHBOT_STATE_DIR": str(self.home / "state"),
            "BENCHBOT_CACHE_DIR": str(self.home / "cache"),
            "PIP_CONFIG_FILE": "/dev/null",
            "UV_NO_CONFIG": "1",
            "UV_CACHE_DIR": str(self.home / "uv"),
            "UV_HTTP_RETRIES": "0",
            "COLUMNS": "200",
        }
        return {**kept, **own, **(changes or {})}

    def run(
        self, *words: str, cwd: Path | None = None, changes: Mapping[str, str] | None = None
    ) -> "subprocess.CompletedProcess[str]":
        """Run `benchbot` to its end."""
        return subprocess.run(
            self.words(*words),
            cwd=cwd or self.home,
            env=self.environ(changes),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )

    def start(self, *words: str, changes: Mapping[str, str] | None = None) -> "subprocess.Popen[str]":
        return subprocess.Popen(
            self.words(*words),
            cwd=self.home,
            env=self.environ(changes),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            process_group=0,
        )

    def remove(self, *names: str) -> None:
        """Remove what `benchbot uninstall` leaves alone, such as a library."""
        words = [str(self.home / "bin" / "uv"), "pip", "uninstall", "--quiet", "--python", str(self.python), *names]
        subprocess.run(words, env=self.environ(), check=True)

    def listing(self) -> dict[str, Entry]:
        """Return mode and content of every file in the environment; what Python compiles, and locks, are left out."""
        found = {}
        for path in sorted(self.prefix.rglob("*")):
            relative = path.relative_to(self.prefix).as_posix()
            if "__pycache__" in path.parts or relative in LOCKS:
                continue
            found[relative] = (path.lstat().st_mode, self._content(path))
        return found

    def _content(self, path: Path) -> str:
        if path.is_symlink():
            return str(path.readlink())
        if path.is_dir():
            return "folder"
        stat = path.stat()
        key = (stat.st_ino, stat.st_size, stat.st_mtime_ns)
        if key not in self._hashes:
            self._hashes[key] = sha256(path.read_bytes()).hexdigest()
        return self._hashes[key]


def make(folder: Path, extra: Iterable[str] = ("pip",)) -> Environment:
    """Make an environment with BenchBot (its sources, editable), all that it needs, and what is named."""
    environment = Environment(folder / "environment", folder / "home")
    (environment.home / "bin").mkdir(parents=True)
    venv.create(environment.prefix, symlinks=True)
    for distribution in with_dependencies(["benchbot", *extra], found_in([HERE])).values():
        _link(distribution, environment)
    return environment


def add_uv(environment: Environment) -> None:
    """Put uv where the commands of the environment find it."""
    uv = shutil.which("uv", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    assert uv is not None
    (environment.home / "bin" / "uv").symlink_to(uv)


def _link(distribution: Distribution, environment: Environment) -> None:
    for path in distribution.files:
        source = HERE / path
        target = Path(os.path.normpath(environment.site / path))
        if "__pycache__" in path or not source.is_file() or not target.is_relative_to(environment.prefix):
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            target.hardlink_to(source)
        except OSError:  # another disk
            shutil.copy2(source, target)
