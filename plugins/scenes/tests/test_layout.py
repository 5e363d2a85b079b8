"""Layouts, written and read."""

from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot_scenes.layout import Building, Layout, Move, Opening, Placement, Room, read_layout, write_layout

METRES = st.integers(-500_000, 500_000).map(lambda value: value / 10_000)
LENGTHS = st.integers(100, 500_000).map(lambda value: value / 10_000)
NAMES = st.text(st.characters(categories=["L", "N", "P", "Zs"]), min_size=1)
POSITIONS = st.tuples(METRES, METRES, METRES)
PLACEMENTS = st.builds(
    Placement,
    id=NAMES,
    model=NAMES,
    position=POSITIONS,
    yaw_deg=METRES,
    size_m=st.none() | st.tuples(LENGTHS, LENGTHS, LENGTHS),
    class_name=st.none() | st.text(max_size=5),
    is_group=st.none() | st.booleans(),
)
ROOMS = st.builds(
    Room,
    name=NAMES,
    outline=st.lists(st.tuples(METRES, METRES), min_size=4, max_size=6).map(tuple),
    floor=NAMES,
    walls=NAMES,
    ceiling=NAMES,
)
OPENINGS = st.builds(
    Opening,
    name=NAMES,
    kind=st.sampled_from(["door", "window", "passage"]),
    at=st.tuples(METRES, METRES),
    width_m=LENGTHS,
    bottom_m=LENGTHS,
    top_m=LENGTHS,
    model=st.none() | NAMES,
    open_deg=st.integers(-180, 180).map(float),
)
BUILDINGS = st.builds(
    Building,
    height_m=LENGTHS,
    wall_m=LENGTHS.map(lambda value: min(value, 5.0)),
    rooms=st.lists(ROOMS, min_size=1, max_size=2).map(tuple),
    openings=st.lists(OPENINGS, max_size=2).map(tuple),
)
BUILT = st.builds(Layout, assets=NAMES, building=BUILDINGS, objects=st.lists(PLACEMENTS, max_size=2).map(tuple))
SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
SAME = """\
assets: household
building:
  height_m: 2.5
  wall_m: 0.2
  rooms:
  - {name: room, outline: [[0, 0], [4, 0], [4, 3], [0, 3]], floor: oak, walls: '#ffffff', ceiling: '#ffffff'}
"""


@given(BUILT)
@example(Layout("household", Building(2.5, 0.1, (Room("\u2028", SQUARE, "a", "b", "\x85"),), ())))
def test_a_layout_comes_back_as_it_was_written(tmp_path_factory: pytest.TempPathFactory, layout: Layout) -> None:
    path = tmp_path_factory.mktemp("layout") / "layout.yaml"
    write_layout(path, layout)
    assert read_layout(path) == layout


def test_differences_name_their_base_relative_to_their_own_file(tmp_path: Path) -> None:
    (tmp_path / "layouts").mkdir()
    path = tmp_path / "layouts" / "room_2.yaml"
    layout = Layout(
        assets="household",
        base=tmp_path / "scenes" / "room_1.glb",
        removed=("chair_1",),
        moved=(Move("table", (1.0, 2.0, 0.0), 90.0),),
    )
    write_layout(path, layout)
    assert "base: ../scenes/room_1.glb\n" in path.read_text()
    base = read_layout(path).base
    assert base is not None
    assert base.resolve() == layout.base


def test_numbers_are_kept_to_a_tenth_of_a_millimetre(tmp_path: Path) -> None:
    write_layout(
        tmp_path / "layout.yaml",
        Layout("household", base=tmp_path / "a.glb", objects=(Placement("cup", "cup_1", (1 / 3, -0.00001, 2.0)),)),
    )
    assert read_layout(tmp_path / "layout.yaml").objects[0].position == (0.3333, 0.0, 2.0)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (SAME + "objects:\n- {id: a, model: b}\n", 8, "the key 'position' is missing at /objects/0"),
        (SAME + "objects:\n- {id: a, model: b, position: [0, 0]}\n", 8, "[0, 0] is too short"),
        (SAME + "furniture: []\n", 7, "unknown key 'furniture'"),
        (SAME.replace("2.5", "-1"), 3, "-1 is less than or equal to the minimum of 0"),
        (SAME + "  openings:\n  - {name: d, kind: dor, at: [0, 0], width_m: 1, bottom_m: 0, top_m: 2}\n", 8, "'door'"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, text: str, line: int, message: str) -> None:
    path = tmp_path / "layout.yaml"
    path.write_text(text)
    with pytest.raises(BenchbotError) as caught:
        read_layout(path)
    assert f"{path}:{line}: " in caught.value.why
    assert message in caught.value.why


@pytest.mark.parametrize("number", [".nan", ".inf", "1e9"])
def test_numbers_are_numbers(tmp_path: Path, number: str) -> None:
    path = tmp_path / "layout.yaml"
    path.write_text(SAME + f"objects:\n- {{id: a, model: b, position: [0, 0, {number}]}}\n")
    with pytest.raises(BenchbotError, match="not a valid layout"):
        read_layout(path)


@pytest.mark.parametrize("text", ["assets: household\n", SAME + "base: other.yaml\n"])
def test_a_layout_builds_or_differs(tmp_path: Path, text: str) -> None:
    path = tmp_path / "layout.yaml"
    path.write_text(text)
    with pytest.raises(BenchbotError, match="not a valid layout") as caught:
        read_layout(path)
    assert "'building'" in caught.value.why
