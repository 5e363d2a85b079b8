"""Closed doors between rooms, and what only sounds like one."""

from pathlib import Path

import pytest

from benchbot_scenes.importing.doors import is_door
from benchbot_scenes.importing.environment import Imported, build
from benchbot_scenes.importing.guesses import Guesses, read_guesses, write_guesses
from benchbot_scenes.visibility import CARTER
from plugins.scenes.tests.importing import places
from plugins.scenes.tests.importing.places import Box


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        (("Door",), True),
        (("IfcDoor", "Mesh.003"), True),
        (("Tür",), True),
        (("Innentür-1:Innentür-1:337",), True),
        (("Haustuer_02",), True),
        (("SM_FrontDoor_01",), True),
        (("Door_Frame",), False),
        (("Door", "DoorHandle"), False),
        (("Türgriff",), False),
        (("Wardrobe", "LeftDoor"), False),
        (("fridge door",), False),
        (("Kühlschranktür",), False),
        (("Floor",), False),
        ((), False),
    ],
)
def test_names_of_doors(path: tuple[str, ...], expected: bool) -> None:
    assert is_door(path) is expected


def _two_rooms(name: str) -> list[Box]:
    """A room of 3 x 4 m and one of 6 x 4 m with a chair, and between them a door that is closed."""
    return [
        Box("Floor", (0, 0, -0.1), (9.1, 4, 0)),
        Box("Ceiling", (0, 0, 2.5), (9.1, 4, 2.6)),
        Box("Wall_low", (3, 0, 0), (3.1, 1.5, 2.5)),
        Box("Wall_high", (3, 2.5, 0), (3.1, 4, 2.5)),
        Box("Wall_top", (3, 1.5, 2.1), (3.1, 2.5, 2.5)),
        Box(name, (3.02, 1.5, 0), (3.08, 2.5, 2.1)),
        Box("Chair", (0.3, 1.8, 0), (0.75, 2.25, 0.9)),
        # As high as a door, but with nothing behind it.
        Box("Door_to_nowhere", (9.0, 1.5, 0), (9.05, 2.5, 2.1)),
    ]


def _built(folder: Path, name: str, known: Guesses) -> Imported:
    return build(places.write(folder / "flat.glb", _two_rooms(name)), "flat", CARTER, known)


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Imported:
    return _built(tmp_path_factory.mktemp("doors"), "Tür", Guesses())


def test_a_closed_door_is_left_out_and_named(opened: Imported) -> None:
    assert opened.unseen == ()
    assert opened.room.area_m2 > 20
    assert opened.guesses.hidden == ("Tür",)
    (note,) = [note for note in opened.notes if note.startswith("Doors")]
    assert "Tür" in note
    assert "nowhere" not in note


def test_a_person_may_keep_a_door(opened: Imported, tmp_path: Path) -> None:
    write_guesses(tmp_path / "guesses.yaml", opened.guesses, {}, "flat.glb")
    known = read_guesses(tmp_path / "guesses.yaml")
    assert known.hidden == ("Tür",)
    closed = _built(tmp_path, "Tür", Guesses(hidden=()))
    assert closed.unseen == ("Chair",)
    assert closed.room.area_m2 < opened.room.area_m2
