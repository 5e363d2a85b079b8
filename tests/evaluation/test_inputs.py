import zipfile

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.evaluation import inputs
from benchbot.evaluation.inputs import Submission, Unreadable


def only(path):
    items = list(inputs.read([path]))
    assert len(items) == 1
    return items[0]


def archive_of(path, content, compression=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", compression) as archive:
        archive.writestr("result.json", content)
    return path


def test_a_submission_knows_its_task_environment_and_failure(failed_episode, save):
    item = only(save("a.json", failed_episode))

    assert isinstance(item, Submission)
    assert item.task == "semantic_slam:passive:ground_truth"
    assert item.environment == "flat:2"
    assert item.failure == "agent"


def test_scenes_make_one_environment_string(make_result, save):
    assert only(save("a.json", make_result(variant=[2, 1]))).environment == "flat:2:1"


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
def test_what_is_no_result_is_told(save, text, why):
    item = only(save("a.json", text))

    assert isinstance(item, Unreadable)
    assert why in item.error.why


def test_a_folder_is_no_result(tmp_path):
    assert "no such file" in only(tmp_path).error.why


def test_an_overgrown_file_is_refused_unread(tmp_path):
    path = tmp_path / "huge.json"
    with path.open("wb") as file:
        file.truncate(inputs.SIZE_LIMIT_BYTES + 1)

    assert "larger than 64 MiB" in only(path).error.why


def test_a_decompression_bomb_is_refused(tmp_path):
    path = archive_of(tmp_path / "bomb.zip", b" " * (32 * 2**20))

    assert "500-fold" in only(path).error.why


def test_a_damaged_archive_is_told(tmp_path):
    path = archive_of(tmp_path / "a.zip", "x" * 1000, zipfile.ZIP_STORED)
    path.write_bytes(path.read_bytes().replace(b"x" * 1000, b"x" * 500 + b"y" * 500))

    assert "damaged" in only(path).error.why


def test_an_archive_without_results_is_told(tmp_path):
    path = tmp_path / "empty.zip"
    zipfile.ZipFile(path, "w").close()

    assert "no JSON file" in only(path).error.why


def test_members_that_climb_out_of_the_archive_are_only_read(tmp_path, make_result):
    import json

    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("../../outside.json", json.dumps(make_result()))

    assert isinstance(only(path), Submission)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zip"]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.binary(max_size=300), st.booleans())
def test_no_bytes_whatever_raise_anything_else(tmp_path, content, as_archive):
    path = tmp_path / "any.json"
    path.write_bytes((b"PK\x05\x06" if as_archive else b"") + content)

    for item in inputs.read([path]):
        assert isinstance(item, Unreadable)
        assert isinstance(item.error, BenchbotError)
