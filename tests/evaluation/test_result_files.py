import json
import zipfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.recording import RecordingNote
from benchbot.evaluation import result_files
from benchbot.evaluation.result_document import OtherDocumentError, ResultDocument
from benchbot.evaluation.result_files import OtherFile, Unreadable
from tests.made_results import Make, Save


def only(path: Path) -> result_files.Item:
    items = list(result_files.read([path]))
    assert len(items) == 1
    return items[0]


def only_submission(path: Path) -> ResultDocument:
    item = only(path)
    assert isinstance(item, ResultDocument)
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

    assert isinstance(item, ResultDocument)
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
        ('{"version": 99, "results": 1, "task_details": {}}', "version 99"),
        ("{}", "no task_details and results"),
        ('{"task_details": {"name": "t"}, "results": 1}', "'environment_details' is missing"),
        ('{"task_details": {"name": "t"}, "environment_details": []}', "environment_details"),
    ],
)
def test_what_is_no_result_is_told(save: Save, text: str, why: str) -> None:
    item = only(save("a.json", text))

    assert isinstance(item, Unreadable)
    assert why in item.error.why


def test_a_folder_counts_as_the_results_below_it_in_the_order_of_their_paths(
    tmp_path: Path, make_result: Make, save: Save
) -> None:
    (tmp_path / "b").mkdir()
    (tmp_path / ".hidden").mkdir()
    for name in ("c.json", "b/two.JSON", ".hidden/three.json"):
        save(name, make_result())
    save("notes.txt", "not looked at")
    archive_of(tmp_path / "a.zip", json.dumps(make_result()))

    sources = [item.source for item in result_files.read([tmp_path])]

    assert sources == [f"{tmp_path}/a.zip:result.json", f"{tmp_path}/b/two.JSON", f"{tmp_path}/c.json"]


SCORES = {"task_details": {}, "environment_details": [], "scores": {"OMQ": 0.5}}
OWN = {
    "scores of v2": SCORES,
    "scores": {**SCORES, "version": 1, "method": {}, "rows": [], "coverage": {}},
    "explanation": {"version": 1, "method": {"name": "omq", "version": "1.0"}, "results": []},
    "recording": {**asdict(RecordingNote("frames"))},
    "plan": dict.fromkeys(schema.schema("plan")["required"]),
    "bundle": dict.fromkeys(schema.schema("bundle")["required"]),
    "comparison": dict.fromkeys(schema.schema("comparison")["required"]),
    "ground truth": {"environment": {}, "format": {}, "ground_truth": {}},
}


@pytest.mark.parametrize("document", OWN.values(), ids=OWN)
@pytest.mark.parametrize("name", ["result.json", "scores.json"])
def test_what_benchbot_writes_beside_results_is_known_by_its_keys_and_refused_by_name(
    tmp_path: Path, save: Save, document: dict[str, Any], name: str
) -> None:
    path = save(name, document)

    (item,) = result_files.read([tmp_path])

    assert isinstance(item, OtherFile)
    assert item.is_own
    assert only_unreadable(path).error.why == item.why


@pytest.mark.parametrize("text", ["{}", "[1]", '{"results": [1, 2]}', '{"learning_rate": 0.1, "task_details": 1}'])
def test_what_is_not_shaped_like_a_result_is_no_broken_one_beside_others(
    tmp_path: Path, make_result: Make, save: Save, text: str
) -> None:
    save("a.json", make_result())
    save("config.json", text)
    with zipfile.ZipFile(tmp_path / "dataset.zip", "w") as archive:
        archive.writestr("picture.jpg", "")

    first, *others = result_files.read([tmp_path])

    assert isinstance(first, ResultDocument)
    assert [(Path(item.source).name, item.is_own) for item in others if isinstance(item, OtherFile)] == [
        ("config.json", False),
        ("dataset.zip", False),
    ]


@pytest.mark.parametrize("lost", ["task_details", "environment_details", "results", "half"])
def test_a_broken_result_is_one_wherever_it_lies_and_whatever_it_is_called(
    tmp_path: Path, make_result: Make, save: Save, lost: str
) -> None:
    document = make_result(version=99)
    text = json.dumps({key: document[key] for key in document if key != lost})
    save("scores.json", text[: len(text) // 2] if lost == "half" else text)

    (item,) = result_files.read([tmp_path])

    assert isinstance(item, Unreadable)
    assert not isinstance(item.error, OtherDocumentError)


def test_a_folder_without_results_is_told(tmp_path: Path) -> None:
    assert "holds no JSON file" in only_unreadable(tmp_path).error.why


@pytest.mark.parametrize("key", ["seed", "repeat"])
def test_a_seed_that_is_no_number_is_told_with_its_place(failed_episode: dict[str, Any], save: Save, key: str) -> None:
    failed_episode["provenance"]["selection"][key] = "3"

    assert f"at /provenance/selection/{key}" in only_unreadable(save("a.json", failed_episode)).error.why


def test_an_overgrown_file_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "huge.json"
    with path.open("wb") as file:
        file.truncate(result_files.SIZE_LIMIT_BYTES + 1)

    assert "larger than 64 MiB" in only_unreadable(path).error.why


def test_a_decompression_bomb_is_refused(tmp_path: Path) -> None:
    path = archive_of(tmp_path / "bomb.zip", b" " * (32 * 2**20))

    assert "500-fold" in only_unreadable(path).error.why


def test_a_damaged_archive_is_told(tmp_path: Path) -> None:
    path = archive_of(tmp_path / "a.zip", "x" * 1000, zipfile.ZIP_STORED)
    path.write_bytes(path.read_bytes().replace(b"x" * 1000, b"x" * 500 + b"y" * 500))

    assert "damaged" in only_unreadable(path).error.why


def archive_with(path: Path, **contents: str) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
    return path


def sources(path: Path) -> list[str]:
    return [item.source.removeprefix(f"{path}:") for item in result_files.read([path])]


def test_of_a_bundle_the_results_are_read_and_not_the_files_of_the_solution(tmp_path: Path, make_result: Make) -> None:
    files = {name: json.dumps(make_result()) for name in ("results/b.json", "results/a.json", "solution/map.json")}
    other = {"manifest.json": "{}", "zzz.json": "{}"}

    bundle = archive_with(tmp_path / "bundle.zip", **other, **files)
    # Without all that a bundle has, it is an archive like others.
    no_bundle = archive_with(tmp_path / "other.zip", **files)

    assert sources(bundle) == ["results/a.json", "results/b.json"]
    assert sources(no_bundle) == ["results/a.json", "results/b.json", "solution/map.json"]


def test_what_lies_in_an_archive_beside_results_is_passed_over(tmp_path: Path, make_result: Make) -> None:
    beside = ("README.txt", "__MACOSX/._a.json", "frames.png")
    results = {name: json.dumps(make_result()) for name in ("a.json", "Z.JSON", "b/z.json", "d.json")}

    path = archive_with(tmp_path / "a.zip", **dict.fromkeys(beside, "beside"), **results)

    assert sources(path) == ["Z.JSON", "a.json", "b/z.json", "d.json"]


@pytest.mark.parametrize(
    ("field", "value"), [("flags", 1), ("method", 99)], ids=["encrypted", "in an unknown compression"]
)
def test_a_member_that_cannot_be_unpacked_is_told_and_the_others_read(
    tmp_path: Path, make_result: Make, field: str, value: int
) -> None:
    path = archive_of(tmp_path / "a.zip", json.dumps(make_result()))
    content = bytearray(path.read_bytes())
    # Both headers of a member say it: the local one and that of the directory (APPNOTE.TXT, 4.3).
    for start, flags, method in ((b"PK\3\4", 6, 8), (b"PK\1\2", 8, 10)):
        content[content.index(start) + (flags if field == "flags" else method)] = value
    path.write_bytes(content)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("second.json", json.dumps(make_result()))

    refused, read = result_files.read([path])

    assert isinstance(refused, Unreadable)
    assert "It is encrypted or in an unknown compression" in refused.error.why
    assert isinstance(read, ResultDocument)


@pytest.mark.parametrize("archived", [False, True])
def test_more_files_than_anybody_hands_in_are_refused_unread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, archived: bool
) -> None:
    monkeypatch.setattr(result_files, "FILE_LIMIT", 3)
    path = tmp_path / "many"
    path.mkdir()
    for number in range(4):
        (path / f"{number}.json").write_text("{}")
    if archived:
        with zipfile.ZipFile(path / "many.zip", "w") as archive:
            for number in range(4):
                archive.write(path / f"{number}.json", f"{number}.json")
        path = path / "many.zip"

    assert "4" in only_unreadable(path).error.why
    assert "at most 3 are read" in only_unreadable(path).error.why


def test_an_archive_without_results_is_told(tmp_path: Path) -> None:
    path = tmp_path / "empty.zip"
    zipfile.ZipFile(path, "w").close()

    assert "no JSON file" in only_unreadable(path).error.why


@pytest.mark.parametrize("name", ["../../outside.json", "/outside.json", "a/../../outside.json"])
def test_members_that_climb_out_of_the_archive_are_refused_and_the_others_read(
    tmp_path: Path, make_result: Make, name: str
) -> None:
    path = archive_of(tmp_path / "a.zip", json.dumps(make_result()))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, json.dumps(make_result()))

    refused, read = sorted(result_files.read([path]), key=lambda item: isinstance(item, ResultDocument))

    assert isinstance(refused, Unreadable)
    assert "leads out of the archive" in refused.error.why
    assert isinstance(read, ResultDocument)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zip"]


def test_an_archive_whose_members_are_large_together_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "overlapping.zip"
    # As many entries in the directory as one likes may point to the same bytes.
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("0.json", b"[" + b" " * (2**20))
        member = archive.infolist()[0]
        for number in range(1, 600):
            copy = zipfile.ZipInfo(f"{number}.json")
            for key in ("compress_type", "CRC", "compress_size", "file_size", "header_offset"):
                setattr(copy, key, getattr(member, key))
            archive.filelist.append(copy)

    assert "larger than 512 MiB together" in only_unreadable(path).error.why


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.binary(max_size=300), st.booleans())
def test_no_bytes_whatever_raise_anything_else(tmp_path: Path, content: bytes, as_archive: bool) -> None:
    path = tmp_path / "any.json"
    path.write_bytes((b"PK\x05\x06" if as_archive else b"") + content)

    for item in result_files.read([path]):
        assert isinstance(item, Unreadable)
        assert isinstance(item.error, BenchbotError)
