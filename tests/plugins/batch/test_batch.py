"""`benchbot batch` as a person uses it."""

import json
import os
import signal
import subprocess
import sys
import zipfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.worker import Worker
from benchbot.plugins.batch.worker_pool import WorkerPool
from tests.cli.solutions import CRASHING, PASSIVE, RESETTING
from tests.plugins.batch.conftest import Batches, wait_until

MakePlugin = Callable[..., Path]

TRUTHS = """\
from pathlib import Path
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_ground_truths():
    yield Path(__file__).parent / "ground_truths"
"""


GATED = f"""\
import pathlib, sys, time
gate = pathlib.Path(sys.argv.pop())
try:
    (gate / "first").mkdir()
except FileExistsError:
    while not (gate / "open").exists():
        time.sleep(0.05)
{PASSIVE}"""
"""Of all episodes the first one ends, and the others when somebody opens the gate, a folder that is its argument."""


def truth(variant: int) -> str:
    bottle = {"class": "bottle", "ID_name": "b", "isgroup": False, "centroid": [0, 0, 0.5], "extent": [1, 1, 1]}
    return json.dumps(
        {
            "environment": {"name": "arena", "variant": variant},
            "format": {"name": "object_map_ground_truth"},
            "ground_truth": {"objects": [bottle], "class_list": ["bottle", "background"], "synonyms": {}},
        }
    )


def test_a_warm_back_end_gives_the_bytes_of_a_cold_one_also_to_a_solution_in_a_sandbox(batches: Batches) -> None:
    secret = batches.cli.folder.with_suffix(".secret")  # beside the folder that the solution sees
    secret.write_text(16 * "0f")
    words = ["--task", "sample:passive", "--env", "arena:1", "--sandbox", batches.solution, "--memory", "1GiB"]
    words += ["--secret", str(secret)]
    done = batches.cli("batch", *words, "--robots", "sample_robot", "--seeds", "0..2", "--jobs", "1", "-o", "b")
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{batches.path('b')}\n"
    assert "The solution runs in a sandbox" in done.stderr
    batches.cli("submit", *words, "--robot", "sample_robot", "--seed", "2", "--results-location", "cold.json")
    warm = json.loads(batches.results("b")["sample_robot_arena-1_seed2"])
    assert len(warm["provenance"]["solution"].pop("snapshot")) == 64
    assert warm == json.loads((batches.cli.folder / "cold.json").read_text())
    assert batches.told("b", "started") == 1


def test_one_command_leaves_results_scores_report_test_cases_and_an_archive(
    batches: Batches,
    make_plugin: MakePlugin,
) -> None:
    make_plugin("arena-truths", TRUTHS, {f"ground_truths/{n}.json": truth(n) for n in (1, 2)})
    done = batches.run(
        "b", "--jobs", "2", "--evaluate-with", "omq", "--zip", "--record", "frames", "-p", "old", seeds="0"
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("OMQ 0.")
    folder = batches.path("b")
    scores = json.loads((folder / "scores.json").read_text())
    assert [row["environment"] for row in scores["rows"]] == ["arena:1", "arena:2"]
    assert "<html" in (folder / "report.html").read_text()
    assert 'tests="2"' in (folder / "junit.xml").read_text()
    assert len(zipfile.ZipFile(folder / "results.zip").namelist()) == len(list((folder / "results").iterdir())) == 2
    assert len(list(folder.glob("episodes/*/frames/*.jpg"))) == 8
    left = sorted(path.name for path in batches.cli.folder.glob("old*"))
    assert left == ["old.zip", "old_0.json", "old_1.json", "old_scores.json"]

    assert batches.cli("eval", "b/results", "--method", "omq").stdout == done.stdout


def test_the_same_command_goes_on_and_another_says_what_it_would_cost(batches: Batches) -> None:
    assert batches.run("b", "--jobs", "1", seeds="0").returncode == 0
    assert "2 done, 0 to do" in batches.run("b", "--jobs", "1", seeds="0").stderr
    assert batches.told("b", "began") == 2

    refused = batches.run("b", "--jobs", "1", seeds="0..1")
    assert refused.returncode == 2
    assert "2 of 4 episodes would stay, 2 would be computed" in refused.stderr
    assert batches.run("b", "--jobs", "1", "--update", seeds="0..1").returncode == 0
    assert batches.told("b", "began") == 4
    dry = batches.run("b", "--dry-run", "--json", seeds="0..2")
    assert [row["done"] for row in json.loads(dry.stdout)["episodes"]] == [True, True, False] * 2
    assert batches.told("b", "began") == 4


def test_workers_simulate_on_the_device_that_is_there_or_asked_for(batches: Batches) -> None:
    refused = batches.run("none", "--device", "cuda")
    assert (refused.returncode, "There is no GPU here." in refused.stderr) == (2, True)

    batches.cli.variables["SAMPLE_GPU"] = "Test GPU"
    free = batches.run("free", seeds="0")
    assert batches.run("chosen", "--device", "cpu", seeds="0").returncode == 0

    assert "Workers simulate on cuda: Test GPU" in free.stderr
    for name, device in (("free", "cuda: Test GPU"), ("chosen", "cpu")):
        results = map(json.loads, batches.results(name).values())
        assert {result["provenance"]["machine"]["device"] for result in results} == {device}


def test_a_worker_on_a_cluster_uses_a_gpu_that_it_was_given_and_no_other(
    batches: Batches, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert batches.run("b", seeds="0", envs="arena:1").returncode == 0
    folder = Folder(batches.path("b"))

    def device() -> str:
        with ExitStack() as stack:
            return Worker(folder, "w", stack)._backend._plan.device

    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    assert device() == "auto"
    WorkerPool("slurm").write(folder)
    assert device() == "cpu"
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "1")
    assert device() == "auto"


def test_repeats_are_told_apart_in_their_results(batches: Batches) -> None:
    assert batches.run("b", "--jobs", "1", "--repeats", "2", seeds="0", envs="arena:1").returncode == 0
    found = [json.loads(text)["provenance"]["selection"] for text in batches.results("b").values()]
    assert sorted(selection["repeat"] for selection in found) == [0, 1]


def test_what_a_solution_does_wrong_is_a_result_and_not_tried_again(batches: Batches) -> None:
    crashing = Batches(batches.cli, batches.cli.script("crashing.py", CRASHING))
    done = crashing.run("b", "--jobs", "1", seeds="0", envs="arena:1")
    assert done.returncode == 1
    assert "1 failed (agent)" in done.stderr
    assert crashing.told("b", "began") == 1
    assert "no idea what a chair is" in batches.cli("batch", "logs", "b", "arena").stdout


def test_retry_leaves_failures_of_the_solution_and_says_how_to_have_them(batches: Batches) -> None:
    crashing = Batches(batches.cli, batches.cli.script("crashing.py", CRASHING))
    assert crashing.run("b", "--jobs", "1", seeds="0", envs="arena:1").returncode == 1

    left = batches.cli("batch", "retry", "b")
    asked = batches.cli("batch", "retry", "b", "--failed", "agent")

    assert "0 episodes are computed once more." in left.stderr
    assert "Failed in other ways, and left as they are: 1 agent. For these: --failed agent" in left.stderr
    assert "1 episode is computed once more." in asked.stderr
    assert "left as they are" not in asked.stderr
    assert crashing.told("b", "began") == 2


def test_limits_hold_in_a_batch_are_in_its_keys_and_each_attempt_of_the_batch_has_its_own(batches: Batches) -> None:
    resetting = Batches(batches.cli, batches.cli.script("resetting.py", RESETTING) + " 9")
    words = ["--task", "sample:active", "--jobs", "1", "--rerun-collided", "1"]
    limited = [*words, "--max-restarts", "0"]

    done = resetting.run("b", *limited, seeds="0", envs="arena:1")
    again = resetting.run("b", *limited, seeds="0", envs="arena:1")
    unlimited = resetting.run("b", *words, seeds="0", envs="arena:1")

    assert "1 failed (collision)" in done.stderr
    ((result,),) = [[json.loads(text)["provenance"]] for text in resetting.results("b").values()]
    assert (result["steps"], result["restarts"], result["failure"]["class"]) == (1, 0, "collision")
    assert resetting.told("b", "began") == 2  # it collided in both attempts, each time in its first step
    assert "1 done, 0 to do" in again.stderr
    assert unlimited.returncode == 2
    assert "limits: Limits(" in unlimited.stderr


def test_a_simulator_that_crashes_is_tried_again_and_then_given_up(batches: Batches) -> None:
    done = batches.run("b", "--jobs", "1", "--retries", "1", "--json", seeds="0", envs="faulty:crash,arena:1")
    assert done.returncode == 3
    told = json.loads(done.stdout)["status"]
    assert (told["finished"], told["failures"], told["retried"]) == (2, {"platform": 1}, 1)
    (journal,) = (entries for name, entries in batches.journals("b").items() if "crash" in name)
    assert [entry["ended"] for entry in journal if "ended" in entry] == ["failed", "done"]
    logs = json.loads(batches.cli("batch", "logs", "b", "--json").stdout)
    assert sorted(row["state"] for row in logs) == ["done", "platform", "platform"]
    assert list(batches.path("b").glob("episodes/*crash*/platform.log"))

    again = batches.cli("batch", "retry", "b")
    assert "1 episode is computed once more" in again.stderr
    assert again.returncode == 3
    assert len(list(batches.path("b").glob("episodes/*crash*/attempt-*"))) == 3


def test_a_solution_that_stands_still_is_ended_and_its_failure_is_a_result(batches: Batches) -> None:
    done = batches.run("b", "--jobs", "1", "--stall-after", "2", "--args", "600", seeds="0", envs="arena:1")
    assert done.returncode == 1
    (text,) = batches.results("b").values()
    assert json.loads(text)["provenance"]["failure"]["class"] == "timeout"
    assert "The solution is stuck." in text


def test_ctrl_c_ends_it_in_order_and_attach_goes_on(batches: Batches) -> None:
    process = batches.cli.start(*batches.words("b", "--jobs", "2", "--args", "0.3", seeds="0..2"))
    wait_until(lambda: batches.told("b", "finished"))
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "Go on with: benchbot batch attach" in err
    assert batches.cli.no_process_is_left()
    assert list((batches.path("b") / "claims").iterdir()) == []
    finished = batches.told("b", "finished")

    done = batches.cli("batch", "attach", "b", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"]["finished"] == 6
    assert batches.told("b", "finished") == 6
    assert finished < 6


def test_a_detached_batch_sees_to_itself_until_it_is_scored(
    batches: Batches,
    make_plugin: MakePlugin,
) -> None:
    make_plugin("arena-truths", TRUTHS, {f"ground_truths/{n}.json": truth(n) for n in (1, 2)})
    batches.solution = f"{batches.cli.script('gated.py', GATED)} {batches.cli.home}"
    folder = batches.path("b")

    def detach(*words: str) -> None:
        detached = batches.cli(*words, "--detach")
        assert detached.returncode == 0, detached.stderr
        wait_until((folder / "driver.lock").read_text)

    detach(*batches.words("b", "--jobs", "1", "--evaluate-with", "omq", "--zip", seeds="0"))
    wait_until(lambda: batches.told("b", "finished"))
    (worker,) = batches.processes("benchbot.plugins.batch.worker")
    os.kill(worker, signal.SIGKILL)
    wait_until(lambda: batches.told("b", "started") == 2)
    status = json.loads(batches.cli("batch", "status", "b", "--json").stdout)
    assert (status["workers"], status["episodes"], status["complete"]) == (1, 2, False)
    assert batches.cli("batch", "cancel", "b").returncode == 0
    assert batches.cli.no_process_is_left()

    detach("batch", "attach", "b")
    person = batches.cli.start("batch", "attach", "b")
    wait_until(lambda: not WorkerPool.read(Folder(folder)).detached)
    wait_until(lambda: not batches.processes("benchbot.plugins.batch.driver"))
    assert batches.processes("benchbot.plugins.batch.worker")
    person.send_signal(signal.SIGINT)
    person.communicate(timeout=120)
    assert batches.cli.no_process_is_left()

    detach("batch", "attach", "b")
    (driver,) = batches.processes("benchbot.plugins.batch.driver")
    os.kill(driver, signal.SIGKILL)
    (batches.cli.home / "open").touch()
    wait_until((folder / "conclusion.json").exists)
    assert [event["who"][:6] for event in batches.events("b") if event["what"] == "evaluating"] == ["local-"]
    assert json.loads((folder / "scores.json").read_text())["coverage"]["scored"] == 2
    assert len(zipfile.ZipFile(folder / "results.zip").namelist()) == 2

    detach("batch", "attach", "b")
    assert batches.cli.no_process_is_left()
    assert batches.told("b", "evaluating") == 1
    assert f"Scores       {folder / 'scores.json'}" in batches.cli("batch", "status", "b").stdout


def test_cancel_ends_a_driver_too(batches: Batches) -> None:
    process = batches.cli.start(*batches.words("b", "--jobs", "1", "--args", "0.3", seeds="0..5"))
    wait_until(lambda: batches.told("b", "began"))
    assert "Somebody drives the batch" in batches.run("b", "--args", "0.3", seeds="0..5").stderr
    batches.cli("batch", "cancel", "b")
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "The batch was cancelled." in err


def test_workers_that_cannot_work_are_said_with_their_last_words(batches: Batches) -> None:
    plan = batches.run("b", "--jobs", "1", "--executor", "local", "--executor-option", "queue=fast", seeds="0")
    assert "The executor 'local' has no option 'queue'." in plan.stderr
    assert plan.returncode == 2


def test_a_batch_file_and_v2s_command(batches: Batches) -> None:
    (batches.cli.folder / "night.yaml").write_text(
        "name: night\ntask: sample:passive\nrobots: [sample_robot]\nenvironments: [arena:1]\nexample: hello_passive\n"
        "seeds: 0..1\njobs: 1\n"
    )
    done = batches.cli("batch", "night.yaml", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"]["finished"] == 2
    script = "from benchbot.plugins.v2.command import batch; batch()"
    words = ["-t", "sample:passive", "-r", "sample_robot", "-e", "arena:1", "--example", "hello_passive", "-z"]
    v2 = subprocess.run(
        [sys.executable, "-c", script, *words],
        cwd=batches.cli.folder,
        env=batches.cli.variables,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert v2.returncode == 0, v2.stderr
    assert sorted(path.name for path in batches.cli.folder.glob("batch*.*")) == ["batch.zip", "batch_0.json"]
    wrong = batches.cli("batch", "night.yaml", "--robots", "roomba")
    assert "'roomba' is not a known robot." in wrong.stderr
    (batches.cli.folder / "night.yaml").write_text("name: night\nenvironments: [arena:1]\nseedz: 1\n")
    wrong = batches.cli("batch", "night.yaml")
    assert "night.yaml:3: unknown key 'seedz'. Did you mean 'seeds'?" in wrong.stderr
