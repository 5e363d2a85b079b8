import subprocess
import sys

import pytest

HEAVY = {
    "ssl",
    "httpx",
    "starlette",
    "uvicorn",
    "jsonschema",
    "cv2",
    "yaml",
    "pluggy",
    "scipy",
    "rich",
    "taichi",
    "anyio",
}


STARTED_OFTEN = (
    "benchbot.plugins.batch.worker",
    "benchbot.plugins.batch.command",
    "benchbot.cli.submit",
    "benchbot.api",
)


def imported_by(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return {name.partition(".")[0] for name in done.stdout.split()}


def test_a_solution_imports_no_server() -> None:
    assert not imported_by("import benchbot.api") & HEAVY


@pytest.mark.parametrize("module", STARTED_OFTEN)
def test_what_is_started_often_waits_for_numpy_until_there_is_an_array(module: str) -> None:
    """It takes as long to import as all that a solution needs without it, and a third of a worker's start."""
    assert "numpy" not in imported_by(f"import {module}")


def test_what_mappers_import_brings_neither_scipy_nor_opencv_nor_pillow() -> None:
    assert not imported_by("import benchbot.mapping") & (HEAVY | {"PIL", "matplotlib"})


def test_solutions_of_v2_find_what_they_import() -> None:
    import benchbot_api
    import benchbot_api.agent
    import benchbot_api.benchbot
    from benchbot import api

    assert benchbot_api.BenchBot is benchbot_api.benchbot.BenchBot
    assert issubclass(benchbot_api.BenchBot, api.BenchBot)
    assert benchbot_api.Agent is benchbot_api.agent.Agent is api.Agent
    assert benchbot_api.ActionResult is benchbot_api.agent.ActionResult is api.ActionResult
