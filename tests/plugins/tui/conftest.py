import json
import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
import yaml

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.plugins.tui import jobs
from benchbot.wire import run_state
from tests.plugin_factory import PluginFactory

SAMPLE = Path(__file__).parents[2] / "sample_plugin" / "benchbot_sample"
EXTRA = """\
from importlib.resources import files
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_robots():
    yield files(__name__) / "robots"

@hookimpl
def benchbot_ground_truths():
    yield files(__name__) / "ground_truths"
"""


@pytest.fixture(scope="session")
def extra(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a plug-in that brings a robot that nothing can run, and the truth of `arena:1`: one bottle."""
    folder = tmp_path_factory.mktemp("extra")
    robot = (SAMPLE / "robots" / "sample_robot.yaml").read_text()
    truth = {
        "environment": yaml.safe_load((SAMPLE / "environments" / "arena_1.yaml").read_text()),
        "format": {"name": "object_map_ground_truth", "functions": {"create": "json:loads"}},
        "ground_truth": {
            "objects": [
                {"class": "bottle", "ID_name": "b", "isgroup": False, "centroid": [2.2, -1.2, 0.5], "extent": [1, 1, 1]}
            ],
            "class_list": ["bottle", "background"],
            "synonyms": {},
        },
    }
    files = {
        "robots/walker.yaml": robot.replace("sample_robot", "walker").replace("sim_sample", "sim_walking"),
        "ground_truths/arena_1.json": json.dumps(truth),
    }
    PluginFactory(folder).make("benchbot-tui-extra", EXTRA, files)
    return folder


@pytest.fixture
def home(tmp_path: Path, extra: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A home of its own, with few plug-ins; the working folder is `work` in it."""
    for name in [name for name in os.environ if name.startswith("BENCHBOT_") and name != "BENCHBOT_REWRITE_SNAPSHOTS"]:
        monkeypatch.delenv(name)
    for name in ("NO_COLOR", "TEXTUAL_THEME", "COLUMNS", "LINES"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("BENCHBOT_DATA_DIR", str(tmp_path / "data"))
    monkeypatch.setenv("BENCHBOT_PLUGINS", "benchbot-sample,benchbot-eval-omq,benchbot-tui-extra")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(extra), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.syspath_prepend(extra)
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    plugin_manager.load.cache_clear()
    yield tmp_path
    # Of a test that failed, too, nothing goes on.
    for process in [state.pid for state in run_state.live()] + [job.pid for job in jobs.jobs() if job.alive]:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)


@pytest.fixture
def catalog(home: Path) -> Catalog:
    return Catalog(plugin_manager.load())
