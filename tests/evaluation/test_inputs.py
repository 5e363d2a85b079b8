import zipfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.evaluation import inputs
from benchbot.evaluation.inputs import Submission, Unreadable
from tests.evaluation.conftest import Make, Save


def only(path: Path) -> Submission | Unreadable:
    items = list(inputs.read([path]))
    assert len(items) == 1
    return items[0]


def only_submission(path: Path) -> Submission:
    item = only(path)
    assert isinstance(item, Submission)
    return item


def only_unreadable(path: Path) -> Unreadable:
    item = only(path)
    assert isinstance(item, Unreadable)
    return item


def archive_of(path: Path, content: str | bytes, compression: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", compression) as archive:
        archive.writestr("result.json", content)
    return path


def test_a_submission_knows_its_task_environment_and_failure(failed_episode: dict[str, Any], save: Save) -> None:
    item = only(save("a.json", failed_episode))

    assert isinstance(item, Submission)
    assert item.task == "semantic_slam:passive:ground_truth"
    assert item.environment == "flat:2"
    assert item.failure == "agent"


def test_scenes_make_one_environment_string(make_result: Make, save: Save) -> None:
    assert only_submission(save("a.json", make_result(variant=[2, 1]))).environment == "flat:2:1"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{", "not valid JSON"),
        ("[1]", "a list"),
        ("[" * 100_000, "nested too deeply"),
        ('{"a": ' + "9" * 5000 + "}", "not valid JSON"),
        ('{"version": 99}', "version 99"),
        ("{}", "task_details"),
        ('{"task_details": {"name": "t"}, "environment_details": []}', "environment_details"),
    ],
)
def test_what_is_no_result_is_told(save: Save, text: str, why: str) -> None:
    item = only(save("a.json", text))

    assert isinstance(item, Unreadable)
    assert why in item.error.why


def test_a_folder_is_no_result(tmp_path: Path) -> None:
    assert "no such file" in only_unreadable(tmp_path).error.why


def test_an_overgrown_file_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "huge.json"
    with path.open("wb") as file:
        file.truncate(inputs.SIZE_LIMIT_BYTES + 1)

    assert "larger than 64 MiB" in only_unreadable(path).error.why


def test_a_decompression_bomb_is_refused(tmp_path: Path) -> None:
    path = archive_of(tmp_path / "bomb.zip", b" " * (32 * 2**20))

    assert "500-fold" in only_unreadable(path).error.why


def test_a_damaged_archive_is_told(tmp_path: Path) -> None:
    path = archive_of(tmp_path / "a.zip", "x" * 1000, zipfile.ZIP_STORED)
    path.write_bytes(path.read_bytes().replace(b"x" * 1000, b"x" * 500 + b"y" * 500))

    assert "damaged" in only_unreadable(path).error.why


def test_an_archive_without_results_is_told(tmp_path: Path) -> None:
    path = tmp_path / "empty.zip"
    zipfile.ZipFile(path, "w").close()

    assert "no JSON file" in only_unreadable(path).error.why


def test_members_that_climb_out_of_the_archive_are_only_read(tmp_path: Path, make_result: Make) -> None:
    import json

    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("../../outside.json", json.dumps(make_result()))

    assert isinstance(only(path), Submission)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zip"]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.binary(max_size=300), st.booleans())
def test_no_bytes_whatever_raise_anything_else(tmp_path: Path, content: bytes, as_archive: bool) -> None:
    path = tmp_path / "any.json"
    path.write_bytes((b"PK\x05\x06" if as_archive else b"") + content)

    for item in inputs.read([path]):
        assert isinstance(item, Unreadable)
        assert isinstance(item.error, BenchbotError)
