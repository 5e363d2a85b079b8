import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.command_line import CommandLine

MANY = 100


@pytest.mark.parametrize("words", [["--help"], ["plugins", "list", "--json"]])
def test_a_hundred_plugins_are_not_imported_where_their_metadata_says_enough(
    words: list[str], cli: CommandLine, make_plugin: Callable[..., Path]
) -> None:
    for number in range(MANY):
        make_plugin(f"explosive-{number}", "import os\nos._exit(9)")

    done = cli(*words)

    assert (done.returncode, done.stderr) == (0, "")
    if "list" in words:
        assert len([row for row in json.loads(done.stdout) if row["distribution"].startswith("explosive-")]) == MANY


@pytest.mark.parametrize("name", ["benchbot-sample", "Benchbot_Sample"])
def test_a_plugin_is_shown_from_its_metadata(name: str, cli: CommandLine) -> None:
    shown = cli("plugins", "show", name)
    assert shown.returncode == 0, shown.stderr
    assert "entry_points  sample = benchbot_sample.plugin" in shown.stdout
    assert "brings        code" in shown.stdout


def test_nothing_is_installed_where_nothing_was_named(cli: CommandLine) -> None:
    done = cli("install")
    assert (done.returncode, "Nothing was named." in done.stderr) == (2, True)
