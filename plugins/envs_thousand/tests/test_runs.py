"""The places with the other parts: sandbox, recordings, bundles, scores, pages, maps, batches and Gymnasium."""

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from benchbot_envs_thousand.making import digest, places
from plugins.envs_thousand.tests.short_runs import WHAT, prepare
from tests.machines import PATIENCE_S
from tests.ray_tracing import benchbot
from tests.supervisor.harness import eventually

pytestmark = pytest.mark.slow

SPY = """\
import json, os
from importlib.util import find_spec
from benchbot.api import BenchBot

benchbot = BenchBot()
for _ in range(3):
    observations, _ = benchbot.step("move_next")
modules = ["benchbot_scenes", "benchbot_envs_thousand", "benchbot_assets_household"]
secret = {*modules, "places.csv", "catalogue.json", "thousand_7_1.yaml", "thousand_7_1.json", "thousand_7_1.png"}
found = [name for name in modules if find_spec(name)]
for folder, folders, names in os.walk("/"):
    folders[:] = [name for name in folders if name not in ("proc", "sys")]
    found += [os.path.join(folder, name) for name in (*folders, *names) if name in secret]
told = [benchbot.empty_results(), {key: str(observations[key]) for key in observations}]
with open(benchbot.result_filename, "w") as file:
    json.dump({**benchbot.empty_results(), "spied": {"found": found, "told": told}}, file)
"""
"""Looks for the generator, its models, the seeds, and all files of the place."""

PATIENT = """\
import json, sys, time
from pathlib import Path
from benchbot.api import BenchBot

benchbot = BenchBot()
benchbot.step("move_next")
answer = benchbot.empty_results()
while answer["environment_details"][0]["name"] == "thousand_903" and not Path(sys.argv[1], "gate").exists():
    time.sleep(0.05)
Path(benchbot.result_filename).write_text(json.dumps(answer))
"""
"""Ends its episode in the third place no sooner than the file `gate` is in a folder."""

DRIVES = """\
import json
import gymnasium, numpy
import benchbot.gymnasium

what = {"task": "navigation:point_goal:ground_truth:laser", "robot": "carter_blind", "env": "thousand_3:1"}
goals = []
for make, action in ((gymnasium.make, 0), (lambda *it, **how: gymnasium.make_vec(*it, 2, **how), numpy.zeros(2, int))):
    envs = make("benchbot/PointGoal-v0", **what)
    observation, info = envs.reset(seed=1)
    _, reward, *_ = envs.step(action)
    goals.append([observation["goal"].tolist(), numpy.asarray(reward).tolist()])
    envs.close()
print(json.dumps([str(info["env"][0]), *goals]))
"""


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which a sandboxed solution was run, scored and recorded in `thousand_7:1`, with nothing cached."""
    # The sandbox shows the folder that the solution runs in, to a user of its own: the cache is not in there.
    folder = prepare(tmp_path_factory.mktemp("places") / "home")
    (folder / "solution" / "look.py").write_text(SPY, "utf-8")
    benchbot(
        folder,
        *("submit", *WHAT, "--env", "thousand_7:1", "--sandbox", f"{sys.executable} solution/look.py"),
        *("--results-location", "results/result.json", "--evaluate-with", "omq", "--output-location", "scores.json"),
        *("--record", "mcap=recorded/bag", "--record", "rerun=recorded/rerun", "--record", "steps=recorded/steps"),
        cache=folder.with_name("cache"),
    )
    return folder


def is_made(cache: Path, number: int) -> bool:
    return digest(cache / "places" / "thousand" / str(number), number) == places()[number].sha256


def test_a_sandboxed_solution_finds_neither_truth_nor_generator_nor_seed(home: Path) -> None:
    spied = json.loads((home / "results" / "result.json").read_text())["spied"]
    truth = home.with_name("cache") / "places" / "thousand" / "7" / "ground_truths" / "thousand_7_1.json"
    told = json.dumps(spied["told"])
    assert spied["found"] == []
    assert "thousand_7" in told
    assert str(places()[7].seed) not in told
    assert not [item for item in json.loads(truth.read_text())["ground_truth"]["objects"] if item["ID_name"] in told]


def test_a_run_is_recorded(home: Path) -> None:
    (bag,) = (home / "recorded" / "bag").glob("*.mcap")
    (run,) = (home / "recorded" / "rerun").glob("*.rrd")
    steps = (home / "recorded" / "steps" / "steps.jsonl").read_text().splitlines()
    assert min(bag.stat().st_size, run.stat().st_size) > 10_000
    assert len(steps) >= 3


def test_elsewhere_a_bundle_gives_the_same_and_a_result_its_score(home: Path, tmp_path: Path) -> None:
    words = ("--addons", "addons", "--solution", ".", "--evaluate-with", "omq", "--output-location", "one.zip")
    others = [word for name in ("results", "recorded") for word in ("--leave-out", name)]
    benchbot(home, "bundle", "results", *words, *others, cache=home.with_name("cache"))

    told = benchbot(home, "reproduce", "one.zip", "--addons", "addons", cache=tmp_path / "elsewhere")
    assert told == "identical  thousand_7:1, seed 0\n"
    assert is_made(tmp_path / "elsewhere", 7)

    third = tmp_path / "a third machine"
    scored = ("eval", "--addons", "addons", "--method", "omq", "one.zip", "--output-location", str(tmp_path / "s.json"))
    benchbot(home, *scored, cache=third)
    assert is_made(third, 7)
    here, there = (json.loads(path.read_text())["rows"] for path in (home / "scores.json", tmp_path / "s.json"))
    assert [row["scores"] for row in here] == [row["scores"] for row in there]


def test_reports_the_viewer_and_maps_know_a_place(home: Path, tmp_path: Path) -> None:
    cache = home.with_name("cache")
    report, pages, maps = tmp_path / "report.html", tmp_path / "pages", tmp_path / "maps"
    benchbot(home, "report", "results", "--addons", "addons", "--output-location", str(report), cache=cache)
    benchbot(home, "view", "results", "--export", str(pages), cache=cache)
    benchbot(home, "map", "thousand_7:1", "--output-location", str(maps), cache=cache)

    assert "thousand_7:1" in report.read_text("utf-8")
    (page,) = (pages / "episode").glob("*.html")
    assert "thousand_7:1" in page.read_text("utf-8")
    assert {path.name for path in maps.iterdir()} == {f"thousand_7_1{end}" for end in (".png", ".yaml", "_above.png")}


def test_a_batch_goes_on_after_everything_was_killed(tmp_path: Path) -> None:
    folder = prepare(tmp_path / "home")
    (folder / "solution" / "look.py").write_text(PATIENT, "utf-8")
    variables = {"BENCHBOT_CACHE_DIR": str(tmp_path / "cache"), "BENCHBOT_STATE_DIR": str(tmp_path / "state")}
    command = [
        *(sys.executable, "-m", "benchbot", "batch", *WHAT, "--envs", "thousand_901:1,thousand_902:1,thousand_903:1"),
        *("--native", f"{sys.executable} solution/look.py {tmp_path}", "--evaluate-with", "omq", "--jobs", "2"),
        *("--no-canary", "--stale-after", "3", "--output-location", "batch"),
    ]

    def finished() -> dict[str, bytes]:
        return {path.parent.name: path.read_bytes() for path in (folder / "batch" / "episodes").glob("*/result.json")}

    with (tmp_path / "log").open("wb") as log:
        driver = subprocess.Popen(command, cwd=folder, env={**os.environ, **variables}, stdout=log, stderr=log)
        assert eventually(lambda: len(finished()) == 2, PATIENCE_S)
        while found := processes_of(tmp_path / "state"):
            for number in found:
                with suppress(ProcessLookupError):
                    os.kill(number, signal.SIGKILL)
            driver.poll()
    before = finished()
    (tmp_path / "gate").touch()
    benchbot(folder, *command[3:], cache=tmp_path / "cache")

    after = finished()
    assert len(before) == 2
    assert len(after) == 3
    assert before.items() <= after.items()
    scored = json.loads((folder / "batch" / "scores.json").read_text())
    assert {row["environment"] for row in scored["rows"]} == {f"thousand_{number}:1" for number in (901, 902, 903)}


def processes_of(state: Path) -> list[int]:
    """Return the numbers of the processes that keep their state in a folder, found by their environment."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            is_dead = b"State:\tZ" in (entry / "status").read_bytes()
            if f"BENCHBOT_STATE_DIR={state}".encode() in (entry / "environ").read_bytes() and not is_dead:
                found.append(int(entry.name))
    return found


def test_gymnasium_drives_to_points_of_a_place_that_episodes_were_made_for(tmp_path: Path) -> None:
    folder = prepare(tmp_path)
    environment = {**os.environ, "BENCHBOT_CACHE_DIR": str(tmp_path / "cache"), "BENCHBOT_ADDONS": "addons"}
    make = ["-m", "benchbot_task_navigation.make_episodes", "thousand_3:1", "--count", "5", "--output", "addons"]
    for words in (make, ["-c", DRIVES]):
        command = [sys.executable, *words]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    place, (goal, reward), (goals, rewards) = json.loads(done.stdout.splitlines()[-1])
    assert place == "thousand_3:1"
    assert goals[0] == goal
    assert rewards[0] == pytest.approx(reward)
    assert is_made(tmp_path / "cache", 3)
