"""Which files of a solution go into a bundle."""

import subprocess
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles import solution_source


def names(where: Path, *leave_out: str) -> list[str]:
    return [member.path for member in solution_source.collect(where, leave_out).members]


def git(folder: Path, *words: str) -> None:
    identity = ["-c", "user.name=me", "-c", "user.email=me@example.org"]
    subprocess.run(["git", "-C", str(folder), *identity, *words], check=True, capture_output=True)


def test_one_file_is_enough(solution: Path) -> None:
    (solution / "other.py").touch()
    source = solution_source.collect(solution / "solution.py")
    assert ([member.path for member in source.members], source.folder) == (["solution.py"], solution)


def test_a_folder_is_taken_without_what_is_made_again(solution: Path) -> None:
    (solution / "lib").mkdir()
    (solution / "lib" / "map.py").touch()
    for made in ("__pycache__/a.pyc", ".git/config", ".venv/bin/python", "env/pyvenv.cfg", "env/lib/x.py"):
        path = solution / made
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    assert names(solution) == ["lib/map.py", "solution.py"]
    assert names(solution, "lib") == ["solution.py"]


def test_of_a_repository_goes_in_what_git_does_not_ignore(solution: Path) -> None:
    git(solution, "init")
    (solution / ".gitignore").write_text("weights/\n")
    (solution / "weights").mkdir()
    (solution / "weights" / "large.bin").touch()
    (solution / "gone.py").touch()
    git(solution, "add", "-A")
    git(solution, "commit", "-m", "one")
    (solution / "gone.py").unlink()
    (solution / "new.py").touch()
    assert names(solution) == [".gitignore", "new.py", "solution.py"]


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        (".env", "A=1", "by its name"),
        ("keys/id_ed25519", "", "by its name"),
        ("config.txt", "-----BEGIN OPENSSH PRIVATE KEY-----\n", "a private key"),
        ("server.pem", "x\n-----BEGIN PRIVATE KEY-----\n", "a private key"),
        ("train.py", f'TOKEN = "ghp_{"a1B2" * 9}"', "a token of GitHub"),
        ("train.py", "key = 'AKIA" + "ABCDEFGHIJKLMNOP'", "a key of Amazon"),
    ],
)
def test_secrets_are_refused_by_name_and_by_content(solution: Path, name: str, content: str, what: str) -> None:
    (solution / name).parent.mkdir(exist_ok=True)
    (solution / name).write_text(content)
    with pytest.raises(BenchbotError, match="must not be given away") as caught:
        names(solution)
    assert what in caught.value.why
    assert caught.value.fix == f"Leave it out: --leave-out {name}"
    assert names(solution, name) == ["solution.py"]


def test_what_only_looks_like_a_secret_goes_in(solution: Path) -> None:
    (solution / ".env.example").write_text("A=\n")
    (solution / "notes.md").write_text("See the PRIVATE KEY of the room: it is a public key.")
    assert names(solution) == [".env.example", "notes.md", "solution.py"]


def test_ground_truth_is_refused(solution: Path) -> None:
    (solution / "truth.json").write_text('{"environment": {}, "ground_truth": {"objects": []}}')
    (solution / "broken.json").write_text("{")
    with pytest.raises(BenchbotError, match=r"truth\.json must not be given away"):
        names(solution)
    assert names(solution, "truth.json") == ["broken.json", "solution.py"]


@pytest.mark.parametrize("points_to", ["/etc/passwd", "solution.py", "nowhere", "."])
def test_links_are_refused(solution: Path, points_to: str) -> None:
    (solution / "link").symlink_to(points_to)
    with pytest.raises(BenchbotError, match="link cannot be bundled"):
        names(solution)
    assert names(solution, "link") == ["solution.py"]


def test_too_much_is_refused_with_the_way_out(solution: Path) -> None:
    with (solution / "weights.bin").open("wb") as file:
        file.truncate(solution_source.MAX_BYTES + 1)
    with pytest.raises(BenchbotError, match="too large for a bundle") as caught:
        names(solution)
    assert "--leave-out" in caught.value.fix


def test_nothing_is_not_a_solution(tmp_path: Path, solution: Path) -> None:
    with pytest.raises(BenchbotError, match="There is no "):
        names(tmp_path / "nowhere")
    with pytest.raises(BenchbotError, match="There is no source in"):
        names(solution, "solution.py")
