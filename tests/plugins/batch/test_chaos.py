"""Whatever is killed, and whenever: after it goes on, the results are those of an undisturbed batch."""

import os
import random
import resource
import signal
import subprocess
from contextlib import suppress

import pytest

from tests.plugins.batch.conftest import Batches, Solution, wait_until
from tests.supervisor.harness import alive

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("batch chaos")]

VICTIMS = {
    "worker": ("benchbot.plugins.batch.worker",),
    "simulator": ("benchbot.supervisor.platform.process",),
    "supervisor": ("-m benchbot.supervisor ",),
    "driver": ("-m benchbot batch",),
}
KILLS = 8
MOMENTS = 20
HANGING = """\
import os, time
with open({pids!r}, "a") as file:
    file.write(str(os.getpid()) + "\\n")
time.sleep(600)
"""


def kill(batches: Batches, chance: random.Random) -> None:
    """Kill one of the processes that there are just now."""
    victims = list(VICTIMS)
    chance.shuffle(victims)
    for victim in victims:
        found = batches.processes(*VICTIMS[victim])
        if found:
            with suppress(ProcessLookupError):
                os.kill(chance.choice(found), signal.SIGKILL)
            return


def test_kill_9_at_any_moment_changes_nothing(batches: Batches) -> None:
    assert batches.run("calm", "--jobs", "2", "--args", "0.05", seeds="0..3").returncode == 0
    for seed in (1, 2):
        folder, chance = f"disturbed {seed}", random.Random(seed)
        disturb(batches, folder, chance)
        assert batches.results(folder) == batches.results("calm")
    assert all('"failure": null' in text for text in batches.results("calm").values())


def disturb(batches: Batches, folder: str, chance: random.Random) -> None:
    """Compute a batch, again and again until it ends well, while somebody kills whatever there is."""
    words = batches.words(folder, "--jobs", "2", "--retries", "50", "--args", "0.05", seeds="0..3")
    process = batches.cli.start(*words)
    for _ in range(KILLS):
        seen, news = len(batches.events(folder)), chance.randint(1, 5)
        wait_until(lambda: len(batches.events(folder)) >= seen + news or process.poll() is not None)  # noqa: B023
        kill(batches, chance)
        if process.poll() is not None:
            process.communicate()
            process = batches.cli.start(*words)
    process.communicate(timeout=300)
    ended = batches.cli(*words)

    assert ended.returncode == 0, ended.stderr
    for entries in batches.journals(folder).values():
        assert [entry.get("ended") for entry in entries].count("done") == 1
        assert entries[-1]["ended"] == "done", "nothing was computed after it was finished"


def test_kills_and_edits_at_20_random_moments_leave_the_results_of_the_first_content(
    batches: Batches, solution: Solution
) -> None:
    words = ("--jobs", "2", "--retries", "50", "--args", "0.05")
    first = solution.write("one")
    assert batches.run("calm", *words, seeds="0..5").returncode == 0
    chance = random.Random(21)
    process = batches.cli.start(*batches.words("b", *words, seeds="0..5"))
    for moment in range(MOMENTS):
        seen, news = len(batches.events("b")), chance.randint(1, 3)
        wait_until(lambda: len(batches.events("b")) >= seen + news or process.poll() is not None)  # noqa: B023
        if chance.random() < 0.5:
            kill(batches, chance)
        else:
            solution.write(f"edited {moment}")
        if process.poll() is not None:
            process.communicate()
            begin = chance.choice([["attach", "b"], ["retry", "b"]])
            process = batches.cli.start("batch", *begin)
    process.communicate(timeout=300)
    attached = batches.cli("batch", "attach", "b")

    assert attached.returncode == 0, attached.stderr
    assert "its files have changed since" in attached.stderr.splitlines()[0]
    assert solution.told("b") == {("content: one one one", first)}
    assert batches.results("b") == batches.results("calm")
    logs = [path.read_text("utf-8") for path in (batches.path("b") / "episodes").rglob("log.txt")]
    assert all("edited" not in log for log in logs), "not even an attempt that was killed ran another content"


def test_a_full_disk_is_waited_for_and_nothing_is_lost(batches: Batches) -> None:
    batches.run("undisturbed", "--args", "0.3", "--jobs", "1", envs="arena:1")
    process = batches.cli.start(*batches.words("full", "--args", "0.3", "--jobs", "1", envs="arena:1"))
    episodes = batches.path("full") / "episodes"
    wait_until(lambda: any(path.stat().st_size for path in episodes.glob("*/attempt-1/log.txt")))
    (worker,) = batches.processes("benchbot.plugins.batch.worker")
    _, hard = resource.prlimit(worker, resource.RLIMIT_FSIZE)

    resource.prlimit(worker, resource.RLIMIT_FSIZE, (2048, hard))
    wait_until(lambda: batches.told("full", "paused"))
    assert not list(episodes.glob("*/result.json"))
    resource.prlimit(worker, resource.RLIMIT_FSIZE, (hard, hard))
    process.communicate(timeout=300)

    assert process.returncode == 0
    assert batches.results("full") == batches.results("undisturbed")
    assert batches.told("full", "began") == 2


def test_a_broken_result_is_computed_anew_and_kept(batches: Batches) -> None:
    assert batches.run("b", "--jobs", "2").returncode == 0
    before = batches.results("b")
    first, second, *others = sorted((batches.path("b") / "episodes").glob("*/result.json"))
    first.write_bytes(first.read_bytes()[:300])
    second.write_bytes(b"\0" * 512)
    kept = {path: path.stat().st_mtime_ns for path in others}

    assert batches.run("b", "--jobs", "2").returncode == 0

    assert batches.results("b") == before
    assert {path: path.stat().st_mtime_ns for path in others} == kept
    assert [path.read_bytes() for path in second.parent.glob("attempt-*/result.json")] == [b"\0" * 512]


def test_a_frozen_worker_is_taken_for_lost_and_finds_out(batches: Batches) -> None:
    words = batches.words("frozen", "--args", "0.2", "--jobs", "2", "--stale-after", "3", seeds="0..2", envs="arena:1")
    process = batches.cli.start(*words)
    episodes = batches.path("frozen") / "episodes"
    wait_until(lambda: any(path.stat().st_size for path in episodes.glob("*/attempt-1/log.txt")))
    frozen = next(
        event["pid"] for event in batches.events("frozen") if event["what"] == "started" and holds_claim(batches, event)
    )
    os.kill(frozen, signal.SIGSTOP)
    try:
        wait_until(lambda: batches.told("frozen", "stole"))
    finally:
        os.kill(frozen, signal.SIGCONT)
    _, err = process.communicate(timeout=300)

    assert process.returncode == 0, err
    assert len(batches.results("frozen")) == 3
    assert all('"failure": null' in text for text in batches.results("frozen").values())


def holds_claim(batches: Batches, event: dict[str, object]) -> bool:
    claims = (batches.path("frozen") / "claims").iterdir()
    return any(f'"worker": "{event["who"]}"' in path.read_text("utf-8") for path in claims if "." not in path.name)


def test_the_orphan_of_a_killed_worker_is_ended(batches: Batches) -> None:
    pids = batches.cli.folder / "pids"
    hanging = batches.cli.script("hanging.py", HANGING.format(pids=str(pids)))
    solution = Batches(batches.cli, hanging)
    process = batches.cli.start(*solution.words("orphan", "--jobs", "1", "--timeout", "300", envs="arena:1", seeds="0"))
    wait_until(lambda: pids.exists() and list((batches.path("orphan") / "episodes").glob("*/attempt-1/process.json")))
    wait_until(lambda: pids.read_text().strip())
    orphan = int(pids.read_text())
    (worker,) = batches.processes("benchbot.plugins.batch.worker")
    os.kill(worker, signal.SIGKILL)

    wait_until(lambda: len(pids.read_text().split()) == 2)
    assert not alive(orphan)
    subprocess.run(["kill", "-INT", str(process.pid)], check=True)
    process.communicate(timeout=120)
