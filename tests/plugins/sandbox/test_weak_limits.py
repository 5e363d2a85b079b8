"""Commands where no control group can be made: a limit that was asked for is refused, a default is weak, and told."""

import subprocess
from pathlib import Path

import pytest

from tests.cli.solutions import PASSIVE
from tests.cli.submitted import SELECTION, read
from tests.command_line import COMMAND, CommandLine, Finished

WITHOUT_GROUPS = ["unshare", "--mount", "sh", "-c", 'mount -t tmpfs none /sys/fs/cgroup && exec "$@"', "sh"]
REFUSED = "The solution's limits would not hold: memory."


class Elsewhere:
    """Runs `benchbot` on a machine that has no control groups, with the home of a command line."""

    def __init__(self, cli: CommandLine) -> None:
        self.cli = cli

    def __call__(self, *words: str) -> Finished:
        command = [*WITHOUT_GROUPS, *COMMAND, *words]
        run = subprocess.run
        return run(
            command,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
            cwd=self.cli.folder,
            env=self.cli.variables,
        )


@pytest.fixture
def elsewhere(cli: CommandLine) -> Elsewhere:
    return Elsewhere(cli)


def weak_limits_of(path: Path) -> list[str] | None:
    found: list[str] | None = read(path)["provenance"]["solution"].get("weak_limits")
    return found


def test_submit_refuses_what_was_asked_for_and_tells_that_a_default_is_weak(
    cli: CommandLine, elsewhere: Elsewhere
) -> None:
    words = ["submit", "--sandbox", cli.script("solution.py", PASSIVE), *SELECTION, "-r", "result.json"]

    refused = elsewhere(*words, "--memory", "1GiB")
    timed = elsewhere(*words, "--cpu-time", "60", "--dry-run")
    dry = elsewhere(*words, "--dry-run")
    nothing_ran = not (cli.folder / "result.json").exists()
    unasked = elsewhere(*words)
    default = weak_limits_of(cli.folder / "result.json")
    trusted = elsewhere(*words, "--memory", "1GiB", "--cpu-time", "60", "--weak-limits")

    assert (refused.returncode, timed.returncode, nothing_ran) == (2, 2, True)
    assert "held: in a sandbox (bubblewrap); weak limits: memory" in dry.stderr
    assert REFUSED in refused.stderr
    assert "--weak-limits" in refused.stderr
    assert "would not hold: CPU time." in timed.stderr
    assert (unasked.returncode, trusted.returncode) == (0, 0), unasked.stderr + trusted.stderr
    assert "Its limits are weak, each process for itself at most: memory." in unasked.stderr
    assert default == ["memory"]
    assert weak_limits_of(cli.folder / "result.json") == ["memory", "CPU time"]


def test_a_batch_refuses_too_also_on_a_machine_that_goes_on_with_one(cli: CommandLine, elsewhere: Elsewhere) -> None:
    solution = ["--sandbox", cli.script("solution.py", PASSIVE), "--memory", "1GiB"]
    words = ["batch", "--task", "sample:passive", "--robots", "sample_robot", "--envs", "arena:1", "--jobs", "1"]

    refused = elsewhere(*words, *solution, "--seeds", "0", "-o", "refused")
    weak = elsewhere(*words, *solution, "--seeds", "0", "--weak-limits", "-o", "weak")
    strong = cli(*words, *solution, "--seeds", "0", "-o", "strong")
    (result,) = (cli.folder / "strong" / "episodes").glob("*/result.json")
    kept = weak_limits_of(result)
    result.unlink()
    gone_on = elsewhere("batch", "attach", "strong")

    assert refused.returncode != 0
    assert REFUSED in refused.stderr
    assert not list(cli.folder.glob("refused/episodes/*/result.json"))
    assert (weak.returncode, strong.returncode) == (0, 0), weak.stderr + strong.stderr
    assert [weak_limits_of(path) for path in cli.folder.glob("weak/episodes/*/result.json")] == [["memory"]]
    assert kept is None
    assert gone_on.returncode != 0
    assert REFUSED in gone_on.stderr
    assert not result.exists()


def test_reproduce_refuses_too(cli: CommandLine, elsewhere: Elsewhere) -> None:
    (cli.folder / "mine").mkdir()
    words = cli.script("mine/solution.py", PASSIVE)
    ran = cli("submit", "--sandbox", words, *SELECTION, "-r", "result.json")
    made = cli("bundle", "result.json", "--solution", "mine")
    assert (ran.returncode, made.returncode) == (0, 0), ran.stderr + made.stderr

    refused = elsewhere("reproduce", "bundle.zip", "--memory", "1GiB")
    weak = elsewhere("reproduce", "bundle.zip", "--memory", "1GiB", "--weak-limits")

    assert refused.returncode == 2
    assert REFUSED in refused.stderr
    assert (weak.returncode, weak.stdout) == (0, "identical  arena:1, seed 0\n"), weak.stderr
