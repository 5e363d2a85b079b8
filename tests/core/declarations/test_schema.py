import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError

TASK = """\
name: tour
actions: [move_next]
observations:
  - image_rgb
  - poses
"""
BOMB = "a0: &a0 [x, x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 40))


def write(folder: Path, text: str, name: str = "tour.yaml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def messages(path: Path, kind: str = "task") -> list[str]:
    return [str(problem).removeprefix(str(path)) for problem in schema.problems(schema.read(path), kind, path)]


@pytest.mark.parametrize("kind", schema.KINDS)
def test_every_schema_is_valid_and_describes_itself(kind: str) -> None:
    document = schema.schema(kind)
    Draft202012Validator.check_schema(document)
    assert document["title"]


def test_a_good_declaration_has_no_problems(tmp_path: Path) -> None:
    path = write(tmp_path, TASK)
    schema.check(schema.read(path), "task", path)


def test_a_wrong_key_is_named_with_its_line_and_the_nearest_one(tmp_path: Path) -> None:
    path = write(tmp_path, TASK + "scene_cuont: 2\n")
    (message,) = messages(path)
    assert message == (
        ":6: unknown key 'scene_cuont'. Did you mean 'scene_count'? Allowed: actions, description, "
        "episodes, evaluation_method, limits, localisation, name, observations, readable, results_format, "
        "scene_count, type"
    )


def test_a_wrong_value_inside_a_list_is_found_at_its_line(tmp_path: Path) -> None:
    path = write(tmp_path, TASK.replace("- poses", "- image_deph"))
    (message,) = messages(path)
    assert message.startswith(":5: 'image_deph' is not allowed here. Did you mean 'image_depth'? Allowed: ")
    assert message.endswith("at /observations/1")


def test_all_problems_are_reported_at_once_in_the_order_of_lines(tmp_path: Path) -> None:
    path = write(tmp_path, "actions: []\nobservations: [poses, poses]\nwhat: 1\n")
    found = messages(path)
    assert len(found) == 4
    assert "the key 'name' is missing" in found[0] + found[1]
    assert found[-1].startswith(":3: unknown key 'what'")
    with pytest.raises(BenchbotError, match="is not a valid task") as caught:
        schema.check(schema.read(path), "task", path)
    assert caught.value.fix.endswith(f"benchbot check {path}")


@pytest.mark.parametrize(
    ("text", "name", "title"),
    [
        ("name: [", "a.yaml", r"a\.yaml:\d: not valid YAML"),
        ('{"name": }', "a.json", r"a\.json:1: not valid JSON"),
        ("- a\n- b\n", "a.yaml", "expected a mapping"),
        ("", "a.yaml", "expected a mapping"),
        ("[" * 100_000, "a.json", "nested too deeply"),
        ('{"a": ' + "9" * 5000 + "}", "a.json", "not a usable document"),
        ("name: &a [*a]", "a.yaml", "too much is repeated by anchors"),
        ("a: &a [1, 2]\nb: &b [*a, *a]\nc: [*b, *b", "a.yaml", "not valid YAML"),
        (BOMB, "a.yaml", "too much is repeated by anchors"),
        ("!!python/object/apply:os.system ['true']", "a.yaml", "not valid YAML"),
    ],
)
def test_what_is_not_a_document_is_refused_by_name(tmp_path: Path, text: str, name: str, title: str) -> None:
    with pytest.raises(BenchbotError, match=title):
        schema.read(write(tmp_path, text, name))


def test_a_missing_and_an_undecodable_file_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="Cannot read"):
        schema.read(tmp_path / "none.yaml")
    (tmp_path / "latin.yaml").write_bytes("name: caf\xe9".encode("latin-1"))
    with pytest.raises(BenchbotError, match="Cannot read"):
        schema.read(tmp_path / "latin.yaml")


def test_a_v2_result_without_a_version_is_valid(tmp_path: Path) -> None:
    result = {"task_details": {"name": "t"}, "environment_details": [{"name": "e", "variant": 1}], "results": {}}
    path = write(tmp_path, json.dumps(result), "result.json")
    schema.check(schema.read(path), "result", path)


def test_plug_ins_keep_schemas_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "colour.json").write_text('{"title": "Colour", "type": "object", "required": ["red"]}')
    path = write(tmp_path, "green: 1\n", "colour.yaml")
    with pytest.raises(BenchbotError, match="not a valid colour") as caught:
        schema.check(schema.read(path), "colour", path, tmp_path)
    assert f"{path}:1: the key 'red' is missing" in caught.value.why
    assert "benchbot check" not in caught.value.fix
