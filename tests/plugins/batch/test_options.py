"""The options of `benchbot batch run` and the keys of a batch file are the same."""

import json
from importlib import resources

from benchbot.plugins.batch.options import LIMITS, OPTIONS
from tests.command_line import CommandLine

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
