"""The distributions of this repository, as their pyproject.toml describe them."""

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Project:
    """A distribution: its name, its folder, and what its pyproject.toml says."""

    name: str
    folder: Path
    written: dict[str, Any] = field(hash=False)

    @property
    def packages(self) -> list[Path]:
        """The folders of its packages, in the checkout."""
        named = self.written["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
        return [self.folder / package for package in named]

    @property
    def requirements(self) -> list[Requirement]:
        """What it needs."""
        return [Requirement(text) for text in self.written["project"]["dependencies"]]

    @property
    def extras(self) -> dict[str, list[Requirement]]:
        """What its extras need."""
        extras = self.written["project"].get("optional-dependencies", {})
        return {extra: [Requirement(text) for text in texts] for extra, texts in extras.items()}


def projects(root: Path = ROOT) -> list[Project]:
    """Return all distributions, BenchBot's own first."""
    files = [root / "pyproject.toml", *sorted(root.glob("plugins/*/pyproject.toml"))]
    return [_project(path) for path in files]


def _project(path: Path) -> Project:
    written = tomllib.loads(path.read_text("utf-8"))
    return Project(canonicalize_name(written["project"]["name"]), path.parent, written)
