"""`benchbot submit --submission`: v2's way to hand a solution on."""

import subprocess
import tarfile
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles import solution_archive, solution_source
from tests.command_line import CommandLine, Here


@pytest.fixture
def packing(cli: CommandLine) -> CommandLine:
    folder = cli.folder / "solution"
    folder.mkdir()
    (folder / "Dockerfile").write_text("FROM scratch\n")
    (folder / "solution.py").touch()
    return cli


def test_a_folder_is_packed_beside_itself_or_where_args_says(packing: CommandLine, here: Here) -> None:
    beside = here("submit", "--submission", "solution")
    there = here("submit", "-s", "solution", "--args", "there/mine.tgz")

    assert (beside.returncode, beside.stdout) == (0, f"{packing.folder / 'submission.tgz'}\n"), beside.stderr
    assert (there.returncode, there.stdout) == (0, "there/mine.tgz\n"), there.stderr
    with tarfile.open(packing.folder / "there" / "mine.tgz") as tar:
        assert tar.getnames() == ["./Dockerfile", "./solution.py"]
    assert "Packed 2 files." in there.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-s", "solution", "--native", "true"], "--submission and --native exclude each other."),
        (["-s", "solution", "-e", "omq"], "--submission and --evaluate-with exclude each other."),
        (["-s", "nowhere"], "There is no folder nowhere."),
        (["-s", "solution/solution.py"], "There is no folder solution/solution.py."),
        (["-s", "."], "id_rsa must not be given away."),
        (["-s", "solution", "--args", "/dev/null"], "/dev/null is not a file."),
    ],
)
def test_what_cannot_be_packed_says_why(packing: CommandLine, here: Here, words: list[str], message: str) -> None:
    (packing.folder / "id_rsa").touch()

    done = here("submit", *words)

    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr


def test_it_is_what_tar_made_of_the_folder_in_v2(tmp_path: Path, solution: Path) -> None:
    (solution / "Dockerfile").write_text("FROM scratch\n")
    script = solution / "bin" / "run.sh"
    script.parent.mkdir()
    script.write_text("#!/bin/sh\n")
    script.chmod(0o755)
    target = tmp_path / "submission.tgz"

    solution_archive.write(solution_source.collect(solution), target)

    with tarfile.open(target) as tar:
        assert tar.getnames() == ["./Dockerfile", "./bin/run.sh", "./solution.py"]
    unpacked = tmp_path / "unpacked"
    unpacked.mkdir()
    subprocess.run(["tar", "-xzf", target, "-C", unpacked], check=True)
    assert (unpacked / "bin" / "run.sh").stat().st_mode & 0o111
    assert (unpacked / "Dockerfile").read_text() == "FROM scratch\n"
    before = target.read_bytes()
    solution_archive.write(solution_source.collect(solution), target)
    assert target.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["solution", "submission.tgz", "unpacked"]


def test_where_nothing_can_be_written_is_said(solution: Path) -> None:
    with pytest.raises(BenchbotError, match="Cannot write"):
        solution_archive.write(solution_source.collect(solution), Path("/dev/null/submission.tgz"))
