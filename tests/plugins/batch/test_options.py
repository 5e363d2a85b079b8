"""The options of `benchbot batch run` and the keys of a batch file are the same."""

import json
from importlib import resources

import pytest

from benchbot.plugins.batch.options import LIMITS, OPTIONS
from tests.command_line import CommandLine, Here

NO_OPTION = {"name", "description"}
NO_KEY = {"envs_batch", "stale_s", "minimum_free_bytes"}


def test_each_key_of_a_batch_file_is_an_option() -> None:
    schema = json.loads((resources.files("benchbot") / "schemas" / "batch.json").read_text("utf-8"))
    within = {f"limits_{key}" for key in schema["properties"].pop("limits")["properties"]}
    assert within == {f"limits_{key}" for key in LIMITS}
    options = {key for group in OPTIONS.values() for key in group}
    assert options - NO_KEY == (set(schema["properties"]) - NO_OPTION) | within


def test_the_help_shows_them_in_groups(cli: CommandLine) -> None:
    text = cli("batch", "run", "--help").stdout
    titles = [line[:-1] for line in text.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert titles == ["Arguments", *OPTIONS, "Options"]
    assert text.index("--seeds") < text.index("The solution:") < text.index("--native") < text.index("--jobs")


@pytest.mark.parametrize("words", [(), ("--help",), ("-h",)])
def test_without_a_command_it_shows_the_options_of_run_and_the_commands(words: tuple[str, ...], here: Here) -> None:
    done = here("batch", *words)
    text = done.stdout + done.stderr
    assert text.index("--robots") < text.index("--dry-run") < text.index("\nCommands:") < text.index("\n  retry ")


def test_a_command_that_is_mistyped_is_no_file(here: Here) -> None:
    wrong, missing = here("batch", "stauts"), here("batch", "night.yaml")

    assert (wrong.returncode, missing.returncode) == (2, 2)
    assert "No such command 'stauts'. Did you mean 'status'?" in wrong.stderr
    assert "Cannot read night.yaml." in missing.stderr


def test_a_file_is_a_file_though_its_name_is_nearly_a_command(cli: CommandLine) -> None:
    (cli.folder / "stats").write_text("task: nowhere\n")

    assert "No such command" not in cli("batch", "stats").stderr
