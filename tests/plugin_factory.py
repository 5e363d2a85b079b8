"""Real, installed-looking plug-in distributions, made in a folder that a test puts on `sys.path`."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class PluginFactory:
    """Writes a distribution: its metadata, its module, and the files beside it."""

    folder: Path

    def make(self, distribution: str, code: str, files: dict[str, str] | None = None) -> Path:
        """Make `distribution` with the module's `code` and declaration files; return the module's folder."""
        module = distribution.replace("-", "_")
        package = self.folder / module
        package.mkdir()
        (package / "__init__.py").write_text(code)
        for name, text in (files or {}).items():
            path = package / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        info = self.folder / f"{module}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.2\n")
        (info / "entry_points.txt").write_text(f"[benchbot]\n{module} = {module}\n")
        return package


@pytest.fixture
def plugin_factory(tmp_path: Path) -> Iterator[PluginFactory]:
    """Makes plug-in distributions that are discovered and imported like installed ones, for one test."""
    folder = tmp_path / "site"
    folder.mkdir()
    sys.path.insert(0, str(folder))
    yield PluginFactory(folder)
    sys.path.remove(str(folder))
    for name, module in list(sys.modules.items()):
        if str(folder) in str(getattr(module, "__file__", "")):
            del sys.modules[name]


DECLARES = """\
from importlib.resources import files
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_{kind}():
    yield files(__name__) / "{kind}"
"""
