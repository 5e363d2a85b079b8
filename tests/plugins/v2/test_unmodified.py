"""Solutions of BenchBot v2 as they are: each way to run one, with the published client and with the drop-in.

The solutions restate v2's own examples, the published client is restated, and the oracle is the exit code in v2.
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from tests.command_line import CommandLine, kill, wait_for
from tests.plugin_factory import DECLARES, PluginFactory
from tests.plugins.containers import base_image

# The published client saves its result to one file of the machine, also where it is started by hand.
pytestmark = pytest.mark.xdist_group("v2 result")

IN_V2 = {"hello_passive": 0, "hello_active": 0, "hello_benchbot": 0, "hello_args": 0, "hello_eval": 0, "aigym": 1}
"""The exit codes of the examples in v2; the last is a solution that fails."""
SAVES_NONE = [name for name, code in IN_V2.items() if code == 0 and name != "hello_eval"]
CLIENTS = ["published", "drop_in"]
PUBLISHED = "Connected, as v2's client does."

TASK = """\
name: {name}
actions: [move_next, move_distance, move_angle]
observations: [image_rgb_info, poses]
localisation: ground_truth
scene_count: 1
"""
TASKS = {
    "tasks/map.yaml": TASK.format(name="v2:map") + "results_format: object_map\n",
    "tasks/collect.yaml": TASK.format(name="v2:collect"),
}
WHERE = ("--robot", "sample_robot", "--env", "arena:1")
DOCKERFILE = f"""\
FROM {base_image.NAME}
COPY . /solution/
CMD ["python", "/solution/each.py"]
"""


@pytest.fixture(scope="module")
def solutions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for each client, with the examples beside it."""
    folder = tmp_path_factory.mktemp("solutions")
    here = Path(__file__).parent / "unmodified"
    for client in CLIENTS:
        shutil.copytree(here / "examples", folder / client)
    shutil.copytree(here / "published", folder / "published", dirs_exist_ok=True)
    return folder


@pytest.fixture(scope="module")
def v2(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CommandLine]:
    """A command line with tasks of v2's, and a run of one that is open to v2's client."""
    folder = tmp_path_factory.mktemp("v2")
    for name in ("home", "work", "site"):
        (folder / name).mkdir()
    PluginFactory(folder / "site").make("acme-v2", DECLARES.format(kind="tasks"), TASKS)
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(("BENCHBOT_", "http_proxy"))}
    variables = {
        **inherited,
        "PYTHONPATH": os.pathsep.join([str(folder / "site"), os.environ["PYTHONPATH"]]),
        "BENCHBOT_STATE_DIR": str(folder / "home" / "state"),
        "BENCHBOT_CACHE_DIR": str(folder / "home" / "cache"),
        "BENCHBOT_PLUGINS": "benchbot-sample,acme-v2",
        "COLUMNS": "120",
    }
    command_line = CommandLine(folder / "home", variables, folder / "work")
    run = command_line.start(
        "run", "--task", "v2:map", *WHERE, "--no-token", "--port", "0", "--unix-socket", "run.sock"
    )
    proxy = wait_for(run, "http_proxy=").split("http_proxy=")[1].split()[0]
    wait_for(run, "Ready.")
    yield replace(command_line, variables={**variables, "proxy": proxy})
    kill(run)


def exit_codes(said: str) -> dict[str, int]:
    (line,) = (line for line in said.splitlines() if "exit codes:" in line)
    told: dict[str, int] = json.loads(line.partition("exit codes:")[2])
    return told


@pytest.mark.parametrize("client", CLIENTS)
def test_started_by_hand_beside_a_run(client: str, v2: CommandLine, solutions: Path) -> None:
    variables = {**v2.variables, **({"http_proxy": v2.variables["proxy"]} if client == "published" else {})}

    done = subprocess.run(
        [sys.executable, "each.py", *IN_V2],
        capture_output=True, text=True, check=False, timeout=120, cwd=solutions / client, env=variables,
    )  # fmt: skip

    assert exit_codes(done.stdout) == IN_V2, done.stderr
    assert (PUBLISHED in done.stdout) is (client == "published")


@pytest.mark.parametrize(
    ("words", "wanted", "code"),
    [
        (["each.py", *SAVES_NONE], [], 0),
        (["hello_eval.py"], ["-r", "result.json"], 0),
        (["aigym.py"], [], IN_V2["aigym"]),
        (["hits.py"], [], 1),
    ],
    ids=["no-result", "result", "fails", "collides"],
)
@pytest.mark.parametrize("client", CLIENTS)
def test_submitted(
    client: str, words: list[str], wanted: list[str], code: int, v2: CommandLine, solutions: Path
) -> None:
    flags = ["--v2-client"] if client == "published" else []
    script, *names = words

    done = v2("submit", *flags, "--native", f"{sys.executable} {solutions / client / script}", *names, *wanted)

    assert done.returncode == code, done.stderr
    assert (PUBLISHED in done.stderr) is (client == "published")
    if names:
        assert exit_codes(done.stderr) == {name: IN_V2[name] for name in names}
        assert "The solution saved no results, and nothing asked for them" in done.stderr
    if wanted:
        document = json.loads((v2.folder / "result.json").read_text())
        assert [each["centroid"] for each in document["results"]["objects"]] == [[1.0, 2.0, 3.0]]
        assert document["provenance"]["failure"] is None


def test_in_a_batch(v2: CommandLine, solutions: Path) -> None:
    named = {f"{client}-{name}": solutions / client / f"{name}.py" for client in CLIENTS for name in SAVES_NONE}
    words = [word for name, path in named.items() for word in ("--solution", f"{name}={sys.executable} {path}")]

    done = v2("batch", "--v2-client", "--task", "v2:collect", *WHERE, *words, "-o", "batch", "--no-canary")

    assert done.returncode == 0, done.stderr
    documents = [json.loads(path.read_text()) for path in (v2.folder / "batch").glob("episodes/*/result.json")]
    assert len(documents) == len(named)
    assert [each["provenance"]["failure"] for each in documents] == [None] * len(named)
    assert {each["provenance"]["solution"]["mode"] for each in documents} == {"v2-client"}
    said = [path.read_text() for path in (v2.folder / "batch").glob("episodes/*/log.txt")]
    assert sum(PUBLISHED in text for text in said) == len(SAVES_NONE), said


@pytest.mark.xdist_group("containers")
@pytest.mark.parametrize("client", CLIENTS)
def test_in_a_container(
    client: str, engine_variables: dict[str, str], v2: CommandLine, solutions: Path, tmp_path: Path
) -> None:
    import jsonpickle

    import benchbot_api

    context = shutil.copytree(solutions / client, tmp_path / "context")
    package = jsonpickle if client == "published" else benchbot_api
    shutil.copytree(Path(str(package.__file__)).parent, context / package.__name__)
    (context / "Dockerfile").write_text(DOCKERFILE)
    flags = ["--v2-client"] if client == "published" else []

    done = v2(
        *("submit", *flags, "--containerised", str(context), "--args", " ".join(IN_V2), "-r", "result.json"),
        **engine_variables,
    )

    assert done.returncode == 0, done.stderr
    assert exit_codes(done.stderr) == IN_V2
    assert (PUBLISHED in done.stderr) is (client == "published")
    document = json.loads((v2.folder / "result.json").read_text())
    assert len(document["results"]["objects"]) == 1
    assert document["provenance"]["solution"]["mode"] == "container"
