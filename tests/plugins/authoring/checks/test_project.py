from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.authoring.checks import check_all
from benchbot.plugins.authoring.scaffold.render import create

ENTRY = "[project.entry-points.benchbot]"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return create("task", "acme-rounds", tmp_path_factory.mktemp("made"))


def changed(made: Path, folder: Path, file: str, old: str, new: str) -> Path:
    for path in made.rglob("*"):
        if path.is_file():
            copy = folder / path.relative_to(made)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(path.read_bytes())
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    return folder


def test_a_new_project_is_sound_and_so_is_its_file_alone(made: Path) -> None:
    for words in ([str(made)], [str(made / "pyproject.toml")], [str(made), str(made / "src")]):
        report = check_all(words)
        assert (report.problems, report.files) == ([], 2)


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("pyproject.toml", ENTRY, "[project.entry-points.benchbots]", "Did you mean that by 'benchbots'? Add"),
        ("pyproject.toml", ENTRY, "[tool.other]", "BenchBot will not find what is declared. Add [project.entry-points"),
        ("pyproject.toml", "acme_rounds.plugin", "acme_rounds.plug_in", "there is no module 'acme_rounds.plug_in' in"),
        ("pyproject.toml", ENTRY, "[project", "not valid TOML: "),
        ("src/acme_rounds/plugin.py", "benchbot_tasks", "benchbot_task", "no hook benchbot_tasks is implemented"),
        ("src/acme_rounds/tasks/acme_rounds.yaml", "observations:", "observation:", "Did you mean 'observations'?"),
    ],
)
def test_what_keeps_benchbot_from_finding_a_plug_in_is_told(
    file: str, old: str, new: str, said: str, made: Path, tmp_path: Path
) -> None:
    folder = changed(made, tmp_path, file, old, new)

    found = [str(problem) for problem in check_all([str(folder)]).problems if not problem.warning]

    assert any(message.startswith(str(folder / file)) and said in message for message in found), found


def test_a_simulator_that_a_project_brings_is_known_before_it_is_installed(tmp_path: Path) -> None:
    assert check_all([str(create("simulator", "acme-world", tmp_path))]).problems == []


def test_an_installed_plug_in_is_checked_by_name() -> None:
    report = check_all(["benchbot-sample"])

    assert [str(problem) for problem in report.problems] == []
    assert report.files > 10
    with pytest.raises(BenchbotError) as caught:
        check_all(["benchbot-sampel"])
    assert "Did you mean 'benchbot-sample'?" in caught.value.why
