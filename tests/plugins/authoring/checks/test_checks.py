"""Every way to get a file wrong that came to mind, and what is said of it."""

import json
import os
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.declarations import schema
from benchbot.core.findings import Problem
from benchbot.plugins.authoring.checks import check_all
from benchbot.plugins.authoring.checks.documents import FOLDERS
from benchbot.plugins.formats import object_map

TASK = "name: tour\nactions: [move_next]\nobservations: [image_rgb]\n"
ROBOT = "name: rover\ntype: sim_sample\nglobal_frame: map\nrobot_frame: base\nposes: [base]\n"
PLACE = "name: hall\nvariant: 1\ntype: sim_sample\nstart_pose: [1, 0, 0, 0, 0, 0, 0]\n"

WRONG: list[tuple[str, str, str]] = [
    (
        "tasks",
        "name: a\nactions: [move_next\nb: 1",
        "3: not valid YAML. did not find expected ',' or ']', while parsing",
    ),
    (
        "tasks",
        "name: a\nactions:\n\t- move_next",
        "3: not valid YAML. found character that cannot start any token. Indent",
    ),
    ("tasks", 'name: "a\nactions: []', "2: not valid YAML. found unexpected end of stream, while scanning a quoted"),
    (
        "tasks",
        TASK + "description: go: there",
        "4: not valid YAML. mapping values are not allowed in this context. Put",
    ),
    (
        "tasks",
        TASK + "description",
        "5: not valid YAML. could not find expected ':', while scanning a simple key in line 4",
    ),
    ("tasks", TASK + "name: other", "4: the key 'name' is there twice, and was in line 1"),
    ("tasks", TASK.replace("tour", "5"), "1: 5 is not of type 'string'. Put it in quotes: \"5\" at /name"),
    ("tasks", TASK + "scene_count: '2'", "4: '2' is not of type 'integer'. Leave out the quotes at /scene_count"),
    ("tasks", TASK + "localisation:", "4: nothing is written here. Allowed: ground_truth, noisy at /localisation"),
    ("tasks", TASK + "localization: noisy", "4: unknown key 'localization'. Did you mean 'localisation'? Allowed: act"),
    ("tasks", TASK + "limits: {stepz: 3}", "4: unknown key 'stepz'. Did you mean 'steps'? Allowed: restarts, "),
    ("tasks", TASK.replace("image_rgb", "goal"), "1: the key 'episodes' is missing (The observation 'goal' is that of"),
    (
        "robots",
        ROBOT + "connections:\n  lasr: {}",
        "7: 'lasr' is not allowed here. Did you mean 'laser'? Allowed: image",
    ),
    (
        "robots",
        ROBOT + "connections:\n  laser:",
        "7: None is not of type 'object'. Nothing is written there at /connec",
    ),
    ("robots", ROBOT + "connections: [laser]", "6: ['laser'] is not of type 'object'. Write indented keys below it, "),
    (
        "robots",
        ROBOT + "connections: {poses: {connection: ros_to_ap}}",
        "6: 'ros_to_ap' is not allowed here. Did you me",
    ),
    (
        "environments",
        PLACE + "map_path: no.glb",
        "5: there is no file 'no.glb'; it is looked for beside this file at /map",
    ),
    (
        "environments",
        PLACE + "lighting:\n  time: 21:30",
        "6: 1290 is not of type 'string'. Put it in quotes: \"21:30\" (",
    ),
    (
        "environments",
        PLACE + "lighting: {lamps: {on: all}}",
        "5: unknown key 'True'. YAML reads on and yes as true, off ",
    ),
    ("environments", PLACE.replace("0, 0]", "0]"), "4: [1, 0, 0, 0, 0, 0] is too short. 6 values, not 7 ([qw, qx, qy,"),
    (
        "environments",
        PLACE.replace("[1,", "[0,"),
        "4: its first four numbers are no unit quaternion (norm 0). Write [qw,",
    ),
    ("environments", PLACE.replace("hall", "a:b"), "1: 'a:b' does not match '^[^:]+$' (Without a colon: an environme"),
    ("batches", "name: b\nenvironments: [hall]", "2: 'hall' does not match '^[^:]+(:[^:]+)+$' (Written name:variant, "),
    (
        "batches",
        "name: b\nenvironments: [arena:1]\nset: {}\nseeds: a..b",
        "4: 'a..b' does not match '^\\\\d+(\\\\.\\\\.\\\\d+)?(,",
    ),
    (
        "formats",
        "name: f\nfunctions: {create: a b}",
        "2: 'a b' does not match '^[A-Za-z_][\\\\w.]*[.:][A-Za-z_]\\\\w*$' (Wri",
    ),
    (
        "formats",
        "name: f\nschema: f.json\nfunctions: {validate: 'f:validate'}",
        "2: there is no file 'f.json' beside this one at /schema",
    ),
    (
        "examples",
        "name: f\nnative_comand: x",
        "2: unknown key 'native_comand'. Did you mean 'native_command'? Allowed: c",
    ),
]
DOUBTFUL: list[tuple[str, str, str]] = [
    ("tasks", TASK + "results_format: object_mp", "4: warning: 'object_mp' is none of the formats that are inst"),
    ("tasks", TASK + "episodes: point_gaol", "4: warning: 'point_gaol' is none of the episodes that are installed."),
    ("robots", ROBOT.replace("sim_s", "sim_d") + "connections: {laser: {connection: ros_to_api}}", "2: warning: 'sim_"),
    ("environments", PLACE + "robots: [sample_robto]", "5: warning: 'sample_robto' is none of the robots that are in"),
    ("environments", PLACE + "map_path: /Game/Maps/hall", "5: warning: there is no file '/Game/Maps/hall'; it is lo"),
    ("batches", "name: b\nenvironments: ['arena:1:7']", "2: warning: 'arena:7' is none of the environments that are"),
    ("batches", "name: b\nenvironments: ['arena:1']\ntask: sample", "3: warning: 'sample' is none of the tasks that"),
]  # fmt: skip


def check(folder: Path, kind: str, text: str, suffix: str = ".yaml") -> list[Problem]:
    path = folder / kind / f"a{suffix}"
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return check_all([str(path)]).problems


@pytest.mark.parametrize(("kind", "text", "said"), [*WRONG, *DOUBTFUL])
def test_a_mistake_is_told_with_its_line_and_what_to_write(kind: str, text: str, said: str, tmp_path: Path) -> None:
    found = [str(problem).removeprefix(f"{tmp_path}/{kind}/a.yaml:") for problem in check(tmp_path, kind, text)]

    assert any(message.startswith(said) for message in found), found


@pytest.mark.parametrize(
    ("content", "said"),
    [('{"type": "objet"}', "'s.json' is no JSON Schema"), ("{", "s.json"), ('{"type": "object"}', None)],
)
def test_the_schema_of_a_format_is_looked_at(content: str, said: str | None, tmp_path: Path) -> None:
    (tmp_path / "formats").mkdir()
    (tmp_path / "formats" / "s.json").write_text(content)
    found = check(tmp_path, "formats", "name: f\nschema: s.json\nfunctions: {validate: 'f:validate'}")

    assert [said in str(problem) for problem in found if said] == ([True] if said else [])
    assert bool(found) == bool(said)


def test_a_schema_beside_the_format_that_names_it_is_no_declaration() -> None:
    folder = Path(object_map.__file__).parent
    named = check_all([str(folder / "object_map.json")]).problems

    assert check_all([str(folder)]).problems == []
    assert [problem.message for problem in named] == ["a JSON Schema declares nothing: name the format that brings it"]


@pytest.mark.parametrize(
    ("mode", "found"),
    [
        (
            "trinary",
            [
                ("its place is occupied in the map hall.yaml at /start_pose", False),
                ("its place is outside in the map hall.yaml at /trajectory_poses/1", True),
            ],
        ),
        ("raw", [("cannot be used. Its mode is 'raw'", False)]),
    ],
)
def test_the_poses_of_a_real_room_are_looked_up_in_its_map(
    tmp_path: Path, mode: str, found: list[tuple[str, bool]]
) -> None:
    (tmp_path / "hall.pgm").write_text("P2\n2 1\n255\n254 0\n")
    (tmp_path / "hall.yaml").write_text(
        f"image: hall.pgm\nmode: {mode}\nresolution: 1.0\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    text = "name: hall\nvariant: 1\ntype: real\nmap_path: ../hall.yaml\nstart_pose: [1, 0, 0, 0, 1.5, 0.5, 0]\n"
    text += "trajectory_poses: [[1, 0, 0, 0, 0.5, 0.5, 0], [1, 0, 0, 0, 0.5, 1.5, 0]]\n"

    problems = check(tmp_path, "environments", text)

    assert len(problems) == len(found)
    for problem, (said, warning) in zip(problems, found, strict=True):
        assert said in str(problem)
        assert problem.warning is warning


@pytest.mark.parametrize(("kind", "text", "said"), DOUBTFUL)
def test_names_that_another_machine_may_have_are_warnings(kind: str, text: str, said: str, tmp_path: Path) -> None:
    assert all(problem.warning for problem in check(tmp_path, kind, text))


def test_json_has_lines_and_pointers_too(tmp_path: Path) -> None:
    text = '{"version": 1, "task": "tour",\n "environment": "arena:1",\n "episodes": [\n  {"start~/": 3}]}'

    unknown = next(problem for problem in check(tmp_path, "episodes", text, ".json") if "start" in problem.message)

    assert (unknown.line, unknown.pointer) == (4, "/episodes/0")


def test_what_cannot_be_opened_and_what_is_there_twice_is_told(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "wide.yaml").write_bytes("name: t".encode("utf-16"))
    (tmp_path / "task.yml").touch()
    (tmp_path / "agent.py").write_text("import benchbot")

    def said(name: str) -> str:
        (problem,) = check_all([str(tmp_path / name)]).problems
        return str(problem).removeprefix(f"{tmp_path}/{name}: ")

    assert said("pipe.yaml") == "it is not a file"
    assert "It is not text in UTF-8" in said("wide.yaml")
    assert said("taks.yml") == "there is no such file. Did you mean 'task.yml'?"
    assert said("agent.py") == "a .py file declares nothing: name one of .yaml, .yml, .json"
    (twice,) = check(tmp_path, "formats", '{"name": "f", "functions": {"a": "b.c", "a": "b.d"}}', ".json")
    assert twice.message == "the key 'a' is there twice in one object"


def test_a_list_that_is_wrong_throughout_is_told_shortly(tmp_path: Path) -> None:
    found = check(tmp_path, "environments", PLACE + "trajectory_poses: [1, 2, 3, 4, 5, 6, 7]")

    assert [problem.pointer for problem in found] == [f"/trajectory_poses/{index}" for index in range(4)]
    assert found[-1].message.startswith("and 4 more like those before")


def test_files_of_one_folder_know_each_other_but_not_by_one_name(tmp_path: Path) -> None:
    for name, text in {
        "tasks/a.yaml": TASK.replace("tour", "mine") + "results_format: my_format\n",
        "tasks/b.yaml": TASK.replace("tour", "mine"),
        "formats/f.yaml": "name: my_format\nfunctions: {}\n",
        "robots/r.yaml": ROBOT.replace("rover", "sample_robot") + "connections: {laser: {connection: ros_to_api}}\n",
        "batches/b.yaml": "name: night\nenvironments: ['hall:1']\n",
        "environments/hall.yaml": PLACE,
        "layouts/hall.yaml": "version: 1\nbuilding: {}\nlighting: {}\nobjects: []\n",
        "package.json": json.dumps(["a list"]),
        "build/copy/tasks/a.yaml": "a copy, which nobody wrote",
        "node_modules/tasks/a.json": "{",
    }.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    report = check_all([str(tmp_path)])

    assert sorted(path.name for path in report.left_out) == ["hall.yaml", "package.json"]
    twice, taken = (str(problem) for problem in sorted(report.problems, key=lambda problem: problem.warning))
    assert twice == f"{tmp_path}/tasks/b.yaml:1: the task 'mine' is declared in {tmp_path}/tasks/a.yaml, too"
    assert "robots/r.yaml:1: warning: the name 'sample_robot' is taken by benchbot-sample, which is installed" in taken


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(width=16) | st.sampled_from(["", "arena:1", "laser", "a:b"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["connection", "on", "x"]), inner),
    max_leaves=6,
)


@pytest.mark.parametrize(("folder", "kind"), FOLDERS.items())
@given(data=st.data())
@settings(max_examples=25)
def test_whatever_is_written_is_checked_to_the_end(folder: str, kind: str, data: st.DataObject) -> None:
    keys = st.sampled_from([*schema.schema(kind)["properties"], "unheard_of"])
    document = data.draw(st.dictionaries(keys, VALUES, max_size=5))
    with TemporaryDirectory() as place:
        path = Path(place, folder, "a.yaml")
        path.parent.mkdir()
        path.write_text(yaml.safe_dump(document))

        problems = check_all([place]).problems

        lines = len(path.read_text().splitlines())
    assert all(problem.line is None or 1 <= problem.line <= lines for problem in problems)
