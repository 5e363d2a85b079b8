"""BenchBot v2's Python API, member by member: what a solution written for it finds and how it behaves."""

import base64
import inspect
import io
import json
import re
import subprocess
import sys
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import requests
from PIL import Image

import benchbot_api
import benchbot_api.benchbot
from benchbot.core.errors import BenchbotError
from benchbot.supervisor.backend import Backend
from benchbot_api import RESULT_LOCATION, ActionResult, Agent, BenchBot
from benchbot_api.agent import Agent as AgentOfModule
from benchbot_api.api_callbacks import convert_to_rgb, decode_color_image
from benchbot_api.benchbot import BenchBot as BenchBotOfModule

StartBackend = Callable[..., Backend]


class Still(Agent):
    """Does nothing, at once."""

    def is_done(self, action_result: ActionResult) -> bool:
        return True

    def pick_action(self, observations: Any, action_list: Any) -> tuple[str, dict[str, Any]]:
        return "None", {}

    def save_result(self, filename: str, empty_results: Any, results_format_fns: Any) -> None:
        Path(filename).write_text(json.dumps(empty_results))


def parameters(function: Callable[..., Any]) -> list[str]:
    return list(inspect.signature(function).parameters)


def test_what_it_exports() -> None:
    assert (AgentOfModule, BenchBotOfModule) == (Agent, BenchBot)
    assert isinstance(RESULT_LOCATION, str)
    assert {"Agent", "ActionResult", "BenchBot", "RESULT_LOCATION"} <= set(benchbot_api.__all__)
    with pytest.raises(AttributeError, match="nothing_of_the_kind"):
        _ = benchbot_api.nothing_of_the_kind


@pytest.mark.parametrize("module", ["agent", "api_callbacks", "benchbot", "tools"])
def test_its_modules_need_no_import_of_their_own(module: str) -> None:
    code = f"import benchbot_api; print(benchbot_api.{module}.__name__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == f"benchbot_api.{module}\n"


def test_action_result() -> None:
    assert issubclass(ActionResult, Enum)
    assert {result.name: result.value for result in ActionResult} == {"SUCCESS": (0,), "FINISHED": (1,), "COLLISION": 2}


def test_agent() -> None:
    assert Agent.__abstractmethods__ == {"is_done", "pick_action", "save_result"}
    assert parameters(Agent.is_done) == ["self", "action_result"]
    assert parameters(Agent.pick_action) == ["self", "observations", "action_list"]
    assert parameters(Agent.save_result) == ["self", "filename", "empty_results", "results_format_fns"]


def test_the_arguments_of_benchbot() -> None:
    assert parameters(BenchBot) == ["agent", "supervisor_address", "auto_start"]
    bot = BenchBot(None, None, False)
    assert bot.agent is None


def test_route_type() -> None:
    assert {route.name: path for route, path in BenchBot.ROUTE_MAP.items()} == {
        "CONNECTION": "connections",
        "CONFIG": "config",
        "ROBOT": "robot",
        "RESULTS": "results_functions",
        "EXPLICIT": "",
    }


def test_the_constants_of_its_module() -> None:
    module = benchbot_api.benchbot
    assert (module.DEFAULT_ADDRESS, module.DEFAULT_PORT) == ("benchbot_supervisor", 10000)
    assert module.RESULT_LOCATION == benchbot_api.RESULT_LOCATION
    assert BenchBot(auto_start=False).supervisor_address == "http://benchbot_supervisor:10000/"


def test_v2s_name_for_its_supervisor_means_the_run_that_is_there(start_backend: StartBackend) -> None:
    start_backend("sample:active")
    assert BenchBot(supervisor_address="http://benchbot_supervisor:10000").actions == ["move_distance", "move_angle"]


def test_what_v2_raised_as_a_lost_connection_is_one(start_backend: StartBackend) -> None:
    with pytest.raises(requests.ConnectionError, match="No BenchBot run"):
        BenchBot()
    start_backend("sample:active")
    bot = BenchBot()
    with pytest.raises(requests.ConnectionError, match="not a valid object_map") as caught:
        bot.results_functions()["validate"]({"objects": 3})
    assert isinstance(caught.value, BenchbotError)
    with pytest.raises(ValueError, match="not an action of the task"):
        bot.step("move_next")


def test_set_agent() -> None:
    bot = BenchBot(auto_start=False)
    agent = Still()
    agents = []
    for given in (agent, None):
        bot.set_agent(given)
        agents.append(bot.agent)
    assert agents == [agent, None]
    with pytest.raises(ValueError, match="not an agent"):
        bot.set_agent(Still)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="not an agent"):
        BenchBot(agent="me", auto_start=False)  # type: ignore[arg-type]


def test_run_without_an_agent() -> None:
    with pytest.raises(RuntimeError, match="no agent"):
        BenchBot(auto_start=False).run()


def test_start_says_what_it_waits_for(start_backend: StartBackend, capsys: pytest.CaptureFixture[str]) -> None:
    start_backend()
    bot = BenchBot(auto_start=False)
    assert capsys.readouterr().out == ""
    bot.start()
    assert capsys.readouterr().out == "Waiting to establish connection to a running supervisor ... Connected!\n"


def test_a_start_that_fails_ends_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(Exception, match="No BenchBot run"):
        BenchBot()
    assert capsys.readouterr().out == "Waiting to establish connection to a running supervisor ... \n"


def test_the_properties(start_backend: StartBackend) -> None:
    start_backend("sample:active")
    bot = BenchBot()
    assert bot.actions == ["move_distance", "move_angle"]
    assert bot.observations == bot.config["task"]["observations"]
    assert sorted(bot.config) == ["environments", "results", "robot", "task"]
    assert bot.config["environments"] == bot.environment_details
    assert bot.config["task"] == bot.task_details
    assert Path(bot.result_filename).parent.is_dir()


@pytest.mark.parametrize(
    ("args", "kwargs"),
    [(({"distance": 0.25},), {}), ((), {"distance": 0.25}), (({"distance": 9.0},), {"distance": 0.25})],
)
def test_step_takes_arguments_in_both_ways(
    start_backend: StartBackend, args: tuple[Any, ...], kwargs: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    start_backend("sample:active")
    bot = BenchBot()
    observations, result = bot.step("move_distance", *args, **kwargs)
    assert result is ActionResult.SUCCESS
    assert set(observations) == {*bot.observations, "scene_number"}
    assert "Sending action 'move_distance' with args: {'distance': 0.25}\n" in capsys.readouterr().out


def test_step_of_none_only_observes(start_backend: StartBackend, capsys: pytest.CaptureFixture[str]) -> None:
    start_backend()
    bot = BenchBot()
    observations, result = bot.step(None)
    assert (observations["scene_number"], result) == (0, ActionResult.SUCCESS)
    assert "Sending action" not in capsys.readouterr().out


def test_an_action_that_is_unavailable_is_a_value_error(start_backend: StartBackend) -> None:
    start_backend("sample:active")
    bot = BenchBot()
    _, result = bot.step("move_distance", distance=30)
    assert (result, bot.actions) == (ActionResult.COLLISION, [])
    with pytest.raises(ValueError, match="Action 'move_distance' is unavailable due to: COLLISION"):
        bot.step("move_distance", distance=1)
    with pytest.raises(RuntimeError, match="after a collision"):
        bot.next_scene()


def test_next_scene_says_whether_there_was_one(start_backend: StartBackend, capsys: pytest.CaptureFixture[str]) -> None:
    start_backend("sample:two_scenes", "arena:1:2")
    bot = BenchBot()
    assert [bot.next_scene(), bot.next_scene()] == [True, False]
    printed = capsys.readouterr().out
    assert "Moving to next scene ... Done.\nMoving to next scene ... Failed.\n" in printed


def test_a_run_of_one_scene_ends_without_a_word_of_a_next_one(
    start_backend: StartBackend, capsys: pytest.CaptureFixture[str]
) -> None:
    start_backend()
    assert BenchBot().next_scene() is False
    assert "next scene" not in capsys.readouterr().out


def test_reset_restarts_what_is_dirty_only(start_backend: StartBackend, capsys: pytest.CaptureFixture[str]) -> None:
    start_backend()
    bot = BenchBot()
    assert isinstance(bot.reset(), tuple)
    bot.step("move_next")
    bot.reset()
    assert re.findall("Dirty robot state detected. Performing reset ... Complete.\n", capsys.readouterr().out) == [
        "Dirty robot state detected. Performing reset ... Complete.\n"
    ]


def test_results_functions_and_empty_results(start_backend: StartBackend) -> None:
    start_backend()
    bot = BenchBot()
    empty = bot.empty_results()
    assert list(empty) == ["task_details", "environment_details", "results"]
    assert empty["results"] == bot.results_functions()["create"]()


def test_run_saves_to_the_result_filename(start_backend: StartBackend) -> None:
    start_backend()
    bot = BenchBot()
    bot.run(Still())
    document = json.loads(Path(bot.result_filename).read_text("utf-8"))
    assert {"task_details", "environment_details", "results"} <= set(document)


def test_convert_to_rgb() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    converted = convert_to_rgb({"encoding": "bgr8", "data": image})
    np.testing.assert_array_equal(converted, image[:, :, ::-1])
    assert convert_to_rgb({"encoding": "rgb8", "data": image}) is image
    assert convert_to_rgb(image) is image


def test_decode_color_image() -> None:
    image = np.zeros((4, 5, 3), np.uint8)
    image[1, 2] = (200, 100, 0)
    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG")
    decoded = decode_color_image({"data": base64.b64encode(file.getvalue()).decode()})
    np.testing.assert_array_equal(decoded, image)
    for nothing in ("", base64.b64encode(b"no image").decode()):
        with pytest.raises(ValueError, match="not an image"):
            decode_color_image({"data": nothing})
