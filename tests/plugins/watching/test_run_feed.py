"""A run that is started with `benchbot submit`, watched and held by others, who then go away in every way."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.core import results
from benchbot.core.errors import BenchbotError
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.wire import run_state
from tests.cli.solutions import PASSIVE
from tests.command_line import CommandLine
from tests.supervisor.harness import eventually

PATIENCE_S = 120.0
EAGER = f'print("\\x1b[31mHello\\x1b[0m\\x07", flush=True)\n{PASSIVE}'
FOLLOW = """\
from benchbot.plugins.watching import plain
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.wire import run_state
plain.follow(RunFeed(run_state.live()[0]), "json")
"""


def test_a_run_is_watched_held_and_driven_and_nothing_that_happens_to_its_watchers_harms_it(
    cli: CommandLine,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("BENCHBOT_STATE_DIR", "BENCHBOT_CACHE_DIR"):
        monkeypatch.setenv(name, cli.variables[name])
    # The solution does not begin before somebody has seen the run, and holds it.
    waits = "import pathlib, time\nwhile not pathlib.Path('go').exists(): time.sleep(0.02)\n"
    words = ("--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1", "--max-steps", "9")
    native = ("--native", cli.script("eager.py", waits + EAGER), "--results-location", "result.json")
    submitted = cli.start("submit", *words, *native, "--display", "json")
    assert eventually(lambda: bool(run_state.live()), PATIENCE_S)
    (state,) = run_state.live()
    feed = RunFeed(state, channels=("image_rgb", "image_segment", "laser"), width=16)
    assert eventually(lambda: bool(feed.view.session), PATIENCE_S)
    assert feed.view.snapshot is None
    feed.pause()
    (cli.folder / "go").touch()
    assert eventually(lambda: feed.view.held, PATIENCE_S)

    # One step at a time: first the reset.
    feed.single_step()
    assert eventually(lambda: feed.view.snapshot is not None and feed.view.held, PATIENCE_S)
    look = feed.view.snapshot
    assert look is not None
    assert {name: image.shape for name, image in look.images.items()} == {
        "image_rgb": (11, 16, 3),
        "image_class": (11, 16),
        "image_instance": (11, 16),
    }
    assert look.stride == 3
    assert look.laser is not None
    assert "bottle" in look.classes

    # Others look on at the same time; one of them is killed, and one stands still.
    others = [
        subprocess.Popen([sys.executable, "-c", FOLLOW], stderr=subprocess.PIPE, env=cli.variables) for _ in range(2)
    ]
    said = []
    for other in others:
        assert other.stderr is not None
        said.append(json.loads(other.stderr.readline()))
    others[0].kill()
    others[1].send_signal(signal.SIGSTOP)
    assert {said[0]["kind"], said[1]["kind"]} <= {"progress", "log", "status"}

    # The host drives, and looks at something else.
    assert feed.drive("move_next", {})["by_hand"]
    with pytest.raises(BenchbotError, match="not an action"):
        feed.drive("fly", {})
    feed.choose(("image_depth",), 48)
    assert eventually(
        lambda: (now := feed.view.snapshot) is not None and set(now.images) == {"image_depth"}, PATIENCE_S
    )
    view = feed.view
    assert view.snapshot is not None
    assert view.snapshot.images["image_depth"].shape == (32, 48)
    assert (view.paused, view.driven_by_hand, view.progress["steps"]) == (True, 1, 1)
    assert view.usage is not None
    assert view.usage.memory_bytes > 2**20
    assert eventually(lambda: len(feed.view.path) > 1, PATIENCE_S)
    heard = "Hello\\u0007"
    assert eventually(lambda: heard in [line.text for line in feed.view.log if line.source == "solution"], PATIENCE_S)
    assert {"supervisor", "solution"} <= {line.source for line in feed.view.log}

    # The solution goes on to its end, and so does what watches it.
    feed.go_on()
    output, printed = submitted.communicate(timeout=PATIENCE_S)
    assert (submitted.returncode, output) == (0, "result.json\n"), printed
    document = results.read(cli.folder / "result.json")
    assert document["provenance"]["driven_by_hand"] == 1
    lines = [json.loads(line) for line in printed.splitlines() if line.startswith("{")]
    assert any(line["kind"] == "progress" and line["paused"] for line in lines)
    assert "Hello" in "".join(line["text"] for line in lines if line["kind"] == "output")
    assert eventually(lambda: not feed.view.alive, PATIENCE_S)
    assert feed.view.problem == "The run has ended."
    assert feed.view.result == Path(state.result)
    with pytest.raises(BenchbotError):
        feed.pause()
    feed.close()
    assert run_state.live() == []
    others[1].send_signal(signal.SIGCONT)
    _, rest = others[1].communicate(timeout=PATIENCE_S)
    assert others[1].returncode == 0
    assert b"The run has ended." in rest.splitlines()[-1]
    assert str(state.result).encode() in rest.splitlines()[-1]
    others[0].communicate()
