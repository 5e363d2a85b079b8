"""A recording together with the other things that take a robot: batches, sandboxes, verification, Gymnasium, v2."""

import json
import re
import shutil
import sys
from contextlib import closing
from pathlib import Path

import pytest

from plugins.replay.tests.conftest import Kept, Lab
from tests.command_line import wait_for
from tests.plugins.v2.v2_client import FINISHED, SUCCESS, V2Client

GYM = """\
import gymnasium, benchbot.gymnasium
environment = gymnasium.make("benchbot/Task-v0", task="sample:passive", robot="replay", env="arena:1")
environment.reset(seed=0)
steps, ended = 0, False
while not ended:
    _, _, terminated, truncated, _ = environment.step(environment.action_space.sample())
    steps, ended = steps + 1, terminated or truncated
print(steps)
"""


def test_a_batch_runs_over_recordings(lab: Lab, driven: Kept) -> None:
    second = lab.drive("second", env="arena:2")
    recordings = ["--recording", str(driven.recording), "--recording", str(second.recording)]
    chosen = ["--task", "sample:passive", "--robots", "replay", "--envs", "arena:1,arena:2"]
    done = lab("batch", *recordings, *chosen, "--native", lab.solution, "-o", "batch", "--display", "none")
    assert done.returncode == 0, done.stderr

    results = [json.loads(path.read_text()) for path in sorted((lab.cli.folder / "batch" / "results").rglob("*.json"))]
    found = {one["provenance"]["selection"]["environment"]: one for one in results if "provenance" in one}
    assert found["arena:1"]["seen"] == driven.result["seen"]
    assert found["arena:2"]["seen"] == second.result["seen"]
    digests = {name: one["provenance"]["replay"][name]["sha256"] for name, one in found.items()}
    assert digests["arena:1"] != digests["arena:2"]


def test_a_held_solution_sees_the_same_bytes(lab: Lab, driven: Kept) -> None:
    folder = lab.cli.folder / "held"
    folder.mkdir()
    shutil.copy(lab.cli.folder / "looking.py", folder)
    words = ["--sandbox", f"{sys.executable} looking.py", "-r", str(lab.cli.folder / "held.json"), "--display", "none"]
    lab.cli.folder = folder
    done = lab("replay", str(driven.recording), *words)
    assert done.returncode == 0, done.stderr
    assert json.loads((folder.parent / "held.json").read_text())["seen"] == driven.result["seen"]


def test_a_replayed_result_is_verified_with_its_recording_and_only_with_it(lab: Lab, driven: Kept) -> None:
    replayed = lab.replay("replayed", driven.recording)
    done = lab("verify", str(replayed.path), "--recording", str(driven.recording))
    assert "verified" in done.stdout, done.stderr
    assert done.returncode == 0

    other = lab.drive("other", "--seed", "1", argument="1")
    done = lab("verify", str(replayed.path), "--recording", str(other.recording))
    assert done.returncode != 0
    assert "verified" not in done.stdout.replace("not verified", "").replace("unverifiable", "")


def test_eval_leaves_the_recordings_beside_results_aside(lab: Lab, driven: Kept) -> None:
    lab.replay("replayed", driven.recording, "--record", "mcap")
    done = lab("eval", str(lab.cli.folder), "--method", "omq", "--validate-only")
    assert "replayed.json" not in "".join(line for line in done.stderr.splitlines() if "not a result" in line)
    assert "mcap" not in done.stdout


def test_it_is_listed_only_while_it_is_named(lab: Lab, driven: Kept) -> None:
    assert "replay" not in lab("list", "robots").stdout
    named = lab("list", "robots", "--recording", str(driven.recording))
    assert re.search(r"^replay +replay ", named.stdout, re.MULTILINE)
    assert lab("doctor", "--recording", str(driven.recording)).returncode == 0


def test_a_gymnasium_environment_steps_through_a_recording(lab: Lab, driven: Kept) -> None:
    (file,) = driven.recording.glob("*.mcap")
    script = lab.script("gym.py", GYM)
    lab.cli.variables["BENCHBOT_RECORDINGS"] = str(file)
    assert lab.run(script) == str(driven.provenance["steps"])


@pytest.mark.filterwarnings("ignore:keys will default:DeprecationWarning")
def test_the_client_of_v2_is_shown_a_recording(lab: Lab, driven: Kept) -> None:
    chosen = ["--task", "sample:passive", "--robot", "replay", "--env", "arena:1", "--port", "0", "--no-token"]
    process = lab.cli.start("run", "--recording", str(driven.recording), *chosen, "--display", "none")
    address = re.search(r"http://\S+", wait_for(process, "http://"))
    assert address is not None

    with closing(V2Client(address.group())) as client:
        client.start()
        _, result = client.reset()
        steps = 0
        while result == SUCCESS:
            _, result = client.step("move_next")
            steps += 1
    assert result == FINISHED
    assert steps == driven.provenance["steps"]


def test_a_hidden_place_needs_no_secret_since_nothing_is_drawn(lab: Lab) -> None:
    place = lab.make("vault:1", hidden=True)
    driven = lab.drive("driven", "--secret", "random", env=place)
    replayed = lab.replay("replayed", driven.recording)
    assert replayed.result["seen"] == driven.result["seen"]


def test_channels_of_driven_and_replayed_do_not_differ(lab: Lab, driven: Kept) -> None:
    replayed = lab.replay("replayed", driven.recording, "--record", "mcap")
    words = ["compare", f"driven={driven.path}", f"replayed={replayed.path}", "--paired-by", "scene", "--json"]
    truth = lab.truth("arena:1")
    done = lab(*words, "--ground-truth", str(truth))
    assert done.returncode == 0, done.stderr
    (found,) = json.loads(done.stdout)["channels"]
    assert found["steps"] == [driven.provenance["frames"]] * 2
    assert {one["channel"]: one["mean_absolute"] for one in found["channels"]} == dict.fromkeys(
        ("brightness", "image_depth", "laser", "position", "heading"), 0.0
    )


def test_what_a_recording_takes_is_its_own_file(lab: Lab, driven: Kept) -> None:
    """A recording is a file to hand on: without its folder it is the same."""
    (file,) = driven.recording.glob("*.mcap")
    alone = Path(shutil.copy(file, lab.cli.folder / "handed-on.mcap"))
    assert lab.replay("replayed", alone).result["seen"] == driven.result["seen"]
