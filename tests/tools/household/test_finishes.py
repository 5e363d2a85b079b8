"""The finishes of floors, walls and ceilings."""

import json
import struct
from pathlib import Path

import benchbot_assets_household
from tools.household.finishes import FILE_NAME, write_finishes

SHIPPED = Path(benchbot_assets_household.__file__).with_name(FILE_NAME)


def test_the_shipped_file_is_what_the_generator_writes(tmp_path: Path) -> None:
    write_finishes(tmp_path / FILE_NAME)
    assert (tmp_path / FILE_NAME).read_bytes() == SHIPPED.read_bytes()


def test_every_finish_says_what_its_textures_cover() -> None:
    data = SHIPPED.read_bytes()
    document = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
    entries = {entry["name"]: entry for entry in document["materials"]}
    assert {"oak", "carpet_grey", "wall_tiles_white", "paint", "trim", "facade"} <= set(entries)
    for entry in entries.values():
        assert all(0.1 < length < 5 for length in entry["extras"]["benchbot"]["tile_m"])


def test_the_file_is_small() -> None:
    assert SHIPPED.stat().st_size < 1_000_000
