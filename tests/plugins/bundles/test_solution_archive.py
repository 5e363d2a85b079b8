"""`benchbot submit --submission`: v2's way to hand a solution on."""

import tarfile

import pytest

from tests.command_line import CommandLine, Here


@pytest.fixture
def solution(cli: CommandLine) -> CommandLine:
    folder = cli.folder / "solution"
    folder.mkdir()
    (folder / "Dockerfile").write_text("FROM scratch\n")
    (folder / "solution.py").touch()
    return cli


def test_a_folder_is_packed_beside_itself_or_where_args_says(solution: CommandLine, here: Here) -> None:
    beside = here("submit", "--submission", "solution")
    there = here("submit", "-s", "solution", "--args", "there/mine.tgz")

    assert (beside.returncode, beside.stdout) == (0, f"{solution.folder / 'submission.tgz'}\n"), beside.stderr
    assert (there.returncode, there.stdout) == (0, "there/mine.tgz\n"), there.stderr
    with tarfile.open(solution.folder / "there" / "mine.tgz") as tar:
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
def test_what_cannot_be_packed_says_why(solution: CommandLine, here: Here, words: list[str], message: str) -> None:
    (solution.folder / "id_rsa").touch()

    done = here("submit", *words)

    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
