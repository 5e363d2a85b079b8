import re
from pathlib import Path

import pytest

from benchbot.cli.kit import options
from benchbot.core.errors import BenchbotError


def test_recordings_lie_beside_the_result_or_where_they_are_told() -> None:
    folders = options.recordings(["mcap,video", "frames=pictures"], Path("runs/result.json"))

    assert folders == {
        "mcap": Path("runs/result-recordings/mcap"),
        "video": Path("runs/result-recordings/video"),
        "frames": Path("pictures"),
    }


def test_recordings_of_a_result_that_is_a_folder_lie_in_it(tmp_path: Path) -> None:
    assert options.recordings(["mcap"], tmp_path) == {"mcap": tmp_path / "result-recordings" / "mcap"}


def test_recordings_without_a_result_have_a_folder_for_the_hour(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path))

    (folder,) = options.recordings(["mcap"]).values()

    assert folder.is_relative_to(tmp_path)
    assert re.fullmatch(r"recordings/\d{8}-\d{6}/mcap", "/".join(folder.parts[-3:]))


@pytest.mark.parametrize(
    "wanted",
    [
        [""],
        ["mcap,"],
        ["=folder"],
        ["mcap="],
        ["frames=,"],
        ["mcap", "mcap"],
        ["mcap", "mcap=there"],
    ],
)
def test_recordings_that_are_not_clear_are_refused_with_an_example(wanted: list[str]) -> None:
    with pytest.raises(BenchbotError, match="cannot be understood") as caught:
        options.recordings(wanted)
    assert "--record frames=FOLDER" in caught.value.fix


@pytest.mark.parametrize(
    ("mixed", "meant"),
    [
        ("frames=DIR,video,rerun", "--record frames=DIR --record video --record rerun."),
        ("mcap,video=folder", "--record mcap --record video=folder."),
    ],
)
def test_recordings_with_and_without_a_folder_in_one_word_are_told_apart_in_the_fix(mixed: str, meant: str) -> None:
    with pytest.raises(BenchbotError, match="cannot be understood") as caught:
        options.recordings([mixed])
    assert caught.value.fix.startswith(f"Write it like this: {meant}")


def test_options_of_a_mode_are_names_and_values() -> None:
    assert options.key_values("--mode-option", ["image=a:1", "flags=a=b", "empty="]) == {
        "image": "a:1",
        "flags": "a=b",
        "empty": "",
    }


@pytest.mark.parametrize("text", ["image", "=a:1", ""])
def test_an_option_of_a_mode_without_a_value_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(BenchbotError, match=f"--mode-option {text} sets nothing") as caught:
        options.key_values("--mode-option", [text])
    assert caught.value.fix == "Write it like this: --mode-option name=value"
