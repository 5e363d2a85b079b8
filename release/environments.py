"""Empty environments to install built wheels into, of any Python that is found."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PYTHONS = ("3.11", "3.12", "3.13")
_PYENV = Path(os.environ.get("PYENV_ROOT", "~/.pyenv")).expanduser() / "versions"


@dataclass(frozen=True)
class Environment:
    """A virtual environment."""

    folder: Path

    @property
    def commands(self) -> Path:
        """Where its commands are."""
        return self.folder / "bin"

    @property
    def python(self) -> Path:
        """Its interpreter."""
        return self.commands / "python"

    @property
    def packages(self) -> Path:
        """Where its packages are."""
        (found,) = (self.folder / "lib").glob("python*/site-packages")
        return found

    def install(self, wheels: Iterable[Path], extra: str = "") -> None:
        """Install wheels and, from the package index, what they need; `extra` is one of the first of them."""
        first, *rest = map(str, wheels)
        words = [f"{first}[{extra}]" if extra else first, *rest]
        uv = shutil.which("uv", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
        if uv is not None:
            subprocess.run([uv, "pip", "install", "--quiet", "--python", str(self.python), *words], check=True)
        else:
            pip = [sys.executable, "-m", "pip", "--python", str(self.python), "install", "--quiet"]
            subprocess.run([*pip, *words], check=True)

    def install_alone(self, wheel: Path) -> None:
        """Install a wheel without a network: what it needs, and nothing else, is linked to what is installed here."""
        pip = [sys.executable, "-m", "pip", "--python", str(self.python), "install", "--quiet"]
        words = ["--no-deps", "--no-index", "--no-compile", "--disable-pip-version-check"]
        subprocess.run([*pip, *words, str(wheel)], check=True)
        for found in _closure(_needed(self.packages)):
            for top in {Path(file).parts[0] for file in found.files or ()}:
                source, link = Path(str(found.locate_file(top))), self.packages / top
                if top != ".." and source.exists() and not link.exists():
                    link.symlink_to(source)


def create(folder: Path, python: str = sys.executable) -> Environment:
    """Make an empty environment: without pip, and blind for what else is installed."""
    subprocess.run([python, "-m", "venv", "--without-pip", str(folder)], check=True)
    return Environment(folder)


def interpreters() -> dict[str, str]:
    """Return which of the supported Pythons this machine has: version, such as 3.12, to the interpreter."""
    found: dict[str, str] = {}
    for version in PYTHONS:
        own = sys.executable if version == ".".join(map(str, sys.version_info[:2])) else None
        pyenv = sorted(_PYENV.glob(f"{version}.*/bin/python{version}"), key=_numbers)
        candidates = [own, *map(str, reversed(pyenv)), shutil.which(f"python{version}")]
        for candidate in filter(None, candidates):
            said = subprocess.run([candidate, "-c", "import venv"], check=False, capture_output=True)
            if said.returncode == 0:
                found[version] = candidate
                break
    return found


def _numbers(path: Path) -> list[int]:
    return [int(number) for number in re.findall(r"\d+", path.parts[-3])]


def _needed(packages: Path) -> list[Requirement]:
    (info,) = packages.glob("benchbot-*.dist-info")
    return _unconditional(Distribution.at(info))


def _unconditional(found: Distribution) -> list[Requirement]:
    requirements = [Requirement(text) for text in found.requires or ()]
    return [one for one in requirements if one.marker is None or one.marker.evaluate({"extra": ""})]


def _closure(requirements: Sequence[Requirement]) -> Iterable[Distribution]:
    found: dict[str, Distribution] = {}
    left = list(requirements)
    while left:
        name = canonicalize_name(left.pop().name)
        if name not in found:
            found[name] = distribution(name)
            left += _unconditional(found[name])
    return found.values()
