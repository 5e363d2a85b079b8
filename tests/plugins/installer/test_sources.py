import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.authoring.scaffold.render import create
from benchbot.plugins.installer import sources


@pytest.mark.parametrize(
    ("url", "split"),
    [
        ("https://example.org/me/x.git", ("https://example.org/me/x.git", "")),
        ("https://example.org/me/x@v1.0", ("https://example.org/me/x", "v1.0")),
        ("https://me:secret@example.org/me/x", ("https://me:secret@example.org/me/x", "")),
        ("https://me@example.org/me/x.git@feature/y", ("https://me@example.org/me/x.git", "feature/y")),
        ("git@example.org:me/x.git", ("git@example.org:me/x.git", "")),
        ("git@example.org:me/x.git@v1", ("git@example.org:me/x.git", "v1")),
        ("https://example.org/me/x@--upload-pack=touch", ("https://example.org/me/x@--upload-pack=touch", "")),
    ],
)
def test_what_is_wanted_of_a_repository(url: str, split: tuple[str, str]) -> None:
    assert sources.split_reference(url) == split


@pytest.mark.parametrize(
    ("url", "name"),
    [
        ("https://example.org/me/x.git", "me/x"),
        ("git@example.org:me/x", "me/x"),
        ("file:///tmp/../..", "file/tmp"),
        ("https://example.org/a b/$(touch)", "a_b/__touch_"),
    ],
)
def test_the_name_of_an_addon_leads_nowhere_else(url: str, name: str) -> None:
    assert sources.addon_name(url) == name


def test_a_generated_project_builds_without_running_its_code_and_others_may_not(tmp_path: Path) -> None:
    project = create("task", "inert", tmp_path)
    settings = project / "pyproject.toml"
    text = settings.read_text()
    assert sources.builds_without_own_code(project)
    for changed in (
        text.replace("hatchling.build", "setuptools.build_meta"),
        text.replace('"hatchling>=1.26"', '"hatchling @ https://example.org/x.whl"'),
        text.replace("hatchling.build", "hatchling.build\nbackend-path = ['.']").replace('"\nbackend', '"\nbackend'),
        f"{text}\n[tool.hatch.build.hooks.custom]\n",
        f"{text}\n[tool.hatch.build.targets.wheel.hooks.custom]\npath = 'x.py'\n",
        f"{text}\n[tool.hatch.metadata.hooks.custom]\n",
        f"{text}\n[tool.hatch.version]\nsource = 'code'\npath = 'x.py'\n",
    ):
        settings.write_text(changed)
        assert not sources.builds_without_own_code(project)
    settings.write_text(text)
    (project / "hatch.toml").write_text("")
    assert not sources.builds_without_own_code(project)
    assert not sources.builds_without_own_code(tmp_path)


def test_files_of_requirements(tmp_path: Path) -> None:
    path = tmp_path / "r.txt"
    path.write_text("# all of it\nacme==1.0 \\\n    --hash=sha256:1 \\\n    --hash=sha256:2  # sure\n\n./folder\n")
    assert sources.read_requirements(path) == ["acme==1.0 --hash=sha256:1 --hash=sha256:2", "./folder"]
    path.write_text("--index-url https://example.org\n")
    with pytest.raises(BenchbotError, match="holds an option"):
        sources.read_requirements(path)
    with pytest.raises(BenchbotError, match="cannot be read"):
        sources.read_requirements(tmp_path)


def test_a_folder_of_nothing_is_told_with_what_it_might_be(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchbot", "plugins", "show", "benchbot-smple"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, "Did you mean 'benchbot-sample'?" in done.stderr) == (2, True)
