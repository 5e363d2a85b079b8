import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.plugin_factory import PluginFactory


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
