"""Libraries of Sweet Home 3D."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.packs.sh3f import Library
from plugins.scenes.tests.asset_packs.furniture import box, entry, sh3f


def test_a_catalogue_is_read_in_metres(tmp_path: Path) -> None:
    rotation = "0 0 1 0 1 0 -1 0 0"
    lines = entry(1, "Scopia#chair", elevation="40", dropOnTopElevation="45.5", modelRotation=rotation)
    lines += entry(2, "Scopia#bill", name="Bill 10\\u20ac", dropOnTopElevation="-1")

    with Library(sh3f(tmp_path / "a.sh3f", lines, {})) as library:
        chair, bill = library.furniture()

    assert (chair.library, chair.id, chair.creator) == ("Scopia", "chair", "Ren\xe9")
    assert chair.size_m == (0.5, 0.7, 0.6)
    assert (chair.elevation_m, chair.top_m) == (0.4, 0.455)
    assert np.array_equal(chair.rotation @ [0, 0, 1], [1, 0, 0])
    assert (bill.name, bill.top_m) == ("Bill 10€", None)
    assert library.licence.startswith("Creative Commons Attribution 3.0")


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("wood.png", "map_Kd wood.png"),
        ("/Users/me/3D/ TEXTURES/wood.png", "map_Kd wood.png"),
        ("C:\\\\Desktop\\\\wood.png", "map_Kd wood.png"),
        ("/Users/me/nice wood.jpg", "map_Kd wood.png"),
    ],
)
def test_textures_are_found_beside_the_model(tmp_path: Path, written: str, meant: str) -> None:
    path = sh3f(tmp_path / "a.sh3f", entry(1, "Scopia#chair"), box("chair", written))
    (tmp_path / "out").mkdir()

    with Library(path) as library:
        model = library.extract(next(library.furniture()), tmp_path / "out")

    text = model.with_suffix(".mtl").read_text()
    assert meant in text.splitlines()
    assert "d 0" in text.splitlines()


def test_a_texture_that_is_nowhere_is_left_out(tmp_path: Path) -> None:
    files = {**box("chair", "/Users/me/gone.jpg"), "models/chair/other.jpg": b"?"}
    (tmp_path / "out").mkdir()

    with Library(sh3f(tmp_path / "a.sh3f", entry(1, "Scopia#chair"), files)) as library:
        model = library.extract(next(library.furniture()), tmp_path / "out")

    assert "map_Kd" not in model.with_suffix(".mtl").read_text()


@pytest.mark.parametrize(
    ("name", "size", "why"),
    [
        ("models/chair/../../../evil.png", 1, "leads out of the archive"),
        ("models/chair/bomb.png", 40 * 2**20, "would unpack to 40 MiB"),
    ],
)
def test_members_that_would_do_harm_are_refused(tmp_path: Path, name: str, size: int, why: str) -> None:
    path = sh3f(tmp_path / "a.sh3f", entry(1, "Scopia#chair"), {**box("chair"), name: bytes(size)})
    (tmp_path / "out").mkdir()

    with Library(path) as library, pytest.raises(BenchbotError, match="not a library of Sweet Home 3D") as caught:
        library.extract(next(library.furniture()), tmp_path / "out")

    assert why in caught.value.why
    assert not (tmp_path / "evil.png").exists()


def test_what_is_no_library_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.sh3f").write_text("no archive")
    with zipfile.ZipFile(tmp_path / "empty.sh3f", "w"):
        pass

    for name in ("text.sh3f", "empty.sh3f", "missing.sh3f"):
        with pytest.raises(BenchbotError, match=f"{name} is not a library of Sweet Home 3D"):
            Library(tmp_path / name)


@pytest.mark.parametrize("changes", [{"width": "0"}, {"height": "wide"}, {"modelRotation": "1 0 0"}, {"depth": "nan"}])
def test_a_catalogue_without_usable_sizes_is_refused(tmp_path: Path, changes: dict[str, str]) -> None:
    library = Library(sh3f(tmp_path / "a.sh3f", entry(1, "Scopia#chair", **changes), {}))

    with library, pytest.raises(BenchbotError, match="not a library of Sweet Home 3D"):
        list(library.furniture())
