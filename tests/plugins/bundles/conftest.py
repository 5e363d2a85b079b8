import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchbot.core import results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import Selection, select
from benchbot.core.session import Session
from benchbot.evaluation.result_document import ResultDocument

Drive = Callable[[Session], object]
StartHost = Callable[[Selection], InProcessHost]
SOLUTION = "print('I am a solution')\n"


@pytest.fixture(scope="session")
def start_host(tmp_path_factory: pytest.TempPathFactory) -> StartHost:
    """Starts the simulator of a selection in this process."""
    cache = tmp_path_factory.mktemp("cache")

    def start(selection: Selection) -> InProcessHost:
        robot = selection.robot.data
        kind = "simulators" if robot["type"] in load().pool("simulators") else "robot_drivers"
        spec = PlatformSpec(robot, selection.localisation, cache, selection.platform_options)
        platform = load().record(kind, robot["type"]).create(spec)
        scenes = [Scene(scene.data, scene.path.parent) for scene in selection.environments]
        return InProcessHost(platform, scenes, MotionConfig.from_robot(robot, selection.localisation))

    return start


@pytest.fixture(scope="session")
def made(start_host: StartHost) -> Callable[..., dict[str, Any]]:
    """Makes the result document of a drive through the sample simulator."""

    def make(drive: Drive, task: str = "sample:active", environment: str = "arena:1", **choices: Any) -> dict[str, Any]:
        robot = choices.pop("robot", "sample_robot")
        selection = select(Catalog(load()), RunRequest(task=task, robot=robot, environment=environment, **choices))
        session = Session(selection, lambda: start_host(selection))
        drive(session)
        solution = {"command": ["python", "solution.py"], "files": {}}
        document = results.finish(results.empty_result(selection), session, solution=solution)
        return dict(json.loads(json.dumps(document)))

    return make


@pytest.fixture(scope="session")
def driven(made: Callable[..., dict[str, Any]]) -> dict[str, Any]:
    """A result of arena:1 with a look, two actions and a turn."""

    def drive(session: Session) -> None:
        session.reset()
        session.step("move_distance", {"distance": 0.5})
        session.step(None)
        session.step("move_angle", {"angle": 30})
        session.step("move_distance", {"distance": 0.25})

    return made(drive, seed=3)


@pytest.fixture
def handed_in(driven: dict[str, Any]) -> ResultDocument:
    """That result, as it is handed in."""
    return ResultDocument("result.json", json.loads(json.dumps(driven)))


@pytest.fixture
def solution(tmp_path: Path) -> Path:
    """The folder of a solution."""
    folder = tmp_path / "solution"
    folder.mkdir()
    (folder / "solution.py").write_text(SOLUTION)
    return folder
