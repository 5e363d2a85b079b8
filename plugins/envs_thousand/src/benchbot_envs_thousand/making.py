"""Which places the thousand are, and making one of them when it is first used."""

import csv
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from benchbot.plugin import BenchbotError, cache_dir
from benchbot_scenes.catalogue import pack
from benchbot_scenes.generator.files import Written, write_place
from benchbot_scenes.generator.generate import Generated, generate, touches
from benchbot_scenes.visibility import CARTER

NAME = "thousand"
SPLITS: Mapping[str, range] = {"train": range(1, 801), "validation": range(801, 901), "test": range(901, 1001)}
MODELS = "household"
EVENINGS = 0.3
"""The share of places in the evening, with their lamps on."""
LIT_BY_DAY = 0.1
"""Rooms with less window than this, as a share of their floor, have their ceiling's lamps on by day, too: building
codes ask for an eighth to a tenth where people stay."""


class Place(NamedTuple):
    """What a place is drawn from, and the SHA-256 (hex) over its layout, declaration and ground truth."""

    number: int
    kind: str
    rooms: int
    seed: int
    sha256: str


@cache
def places() -> dict[int, Place]:
    """Return the places by number, as they are frozen."""
    rows = csv.reader((files("benchbot_envs_thousand") / "places.csv").read_text("utf-8").splitlines()[1:])
    found = [Place(int(number), kind, int(rooms), int(seed), digest) for number, kind, rooms, seed, digest in rows]
    return {place.number: place for place in found}


def make(number: int) -> Path:
    """Return the folder of a place in the user's cache; it is made when it is not there, or not as it was frozen.

    Raises BenchbotError when it comes out other than it was frozen, or cannot be written.
    """
    place = places()[number]
    folder = _folder(number)
    try:
        if digest(folder, number) != place.sha256:
            folder.parent.mkdir(parents=True, exist_ok=True)
            _make(place, folder)
    except OSError as error:
        raise BenchbotError(
            f"{NAME}_{number}:1 cannot be kept in {folder.parent}.",
            str(error),
            "Make the folder writable, or name another in the environment variable BENCHBOT_CACHE_DIR.",
        ) from error
    return folder


def is_made(number: int) -> bool:
    """Return whether a place is in the user's cache; `make` finds out whether it is as it was frozen."""
    try:
        return _folder(number).exists()
    except OSError:
        return False  # `make` says why it cannot be kept


def _folder(number: int) -> Path:
    return cache_dir() / "places" / NAME / str(number)


def _make(place: Place, folder: Path) -> None:
    with TemporaryDirectory(dir=folder.parent, prefix=".making-") as temporary:
        # What is there is moved away now, and never later: another process may be making the place, too, and uses it.
        with suppress(FileNotFoundError):
            folder.rename(Path(temporary, "other"))
        made = Path(temporary, "place")
        write(place, made)
        if digest(made, place.number) != place.sha256:
            raise BenchbotError(
                f"{NAME}_{place.number}:1 is not the place that it is elsewhere.",
                "What its seed gives here differs from what was frozen: the generator, its models or NumPy are of "
                "other versions. Scores of it could not be compared with those of others.",
                "Install the versions that belong together: pip install --upgrade benchbot-envs-thousand "
                "benchbot-scenes benchbot-assets-household numpy",
            )
        try:
            made.rename(folder)
        except OSError:
            # Another process may have made it meanwhile.
            if digest(folder, place.number) != place.sha256:
                raise


def write(place: Place, folder: Path) -> tuple[Generated, Written]:
    """Write a place as a folder of add-ons."""
    made = generate(place.seed, place.kind, place.rooms, pack(MODELS))
    light = lighting(place.seed, lamps_by_day(made))
    return made, write_place(folder, f"{NAME}_{place.number}", 1, made, CARTER, lighting=light)


def lamps_by_day(made: Generated) -> list[str]:
    """Return the names of the lamps under the ceilings of rooms that are dim by day, such as halls."""
    lamps = [item for item in made.items if item.model.placement == "ceiling"]
    found = []
    for room in made.plan.spaces:
        windows = [one for one in made.plan.openings if one.kind == "window" and touches(room, one)]
        window_m2 = math.fsum(one.width_m * (one.top_m - one.bottom_m) for one in windows)
        (low_x, low_y), (high_x, high_y) = room.low, room.high
        if window_m2 < LIT_BY_DAY * (high_x - low_x) * (high_y - low_y):
            at = [(lamp.placement.id, *lamp.placement.position[:2]) for lamp in lamps]
            found += [name for name, x, y in at if low_x < x < high_x and low_y < y < high_y]
    return found


def lighting(seed: int, by_day: Sequence[str]) -> dict[str, Any]:
    """Draw the light of a place: a day at 9 to 16 o'clock with some lamps on, or an evening with all of them."""
    chance = Random(f"light of {NAME}:{seed}")  # noqa: S311 - nothing secret is drawn
    evening = chance.random() < EVENINGS
    minutes = chance.randrange(19 * 60, 22 * 60, 10) if evening else chance.randrange(9 * 60, 16 * 60, 10)
    return {
        "time": f"{minutes // 60:02}:{minutes % 60:02}",
        "date": f"2023-{chance.randrange(1, 13):02}-{chance.randrange(1, 29):02}",
        "latitude_deg": chance.randrange(-40, 61, 5),
        "north_deg": chance.randrange(0, 360, 15),
        "turbidity": chance.choice((2, 3, 4, 6)),
        "lamps": {"on": "all" if evening else list(by_day) or "none"},
        "exterior": {"kind": chance.choice(("town", "trees", "field")), "seed": chance.randrange(1000)},
    }


def digest(folder: Path, number: int) -> str | None:
    """Return the SHA-256 of a place's files in a folder, but for comments; None when one is missing."""
    hashed = sha256()
    for kind, suffix in (("layouts", "yaml"), ("environments", "yaml"), ("ground_truths", "json")):
        try:
            lines = (folder / kind / f"{NAME}_{number}_1.{suffix}").read_bytes().splitlines(keepends=True)
        except FileNotFoundError:
            return None
        hashed.update(b"".join(line for line in lines if not line.startswith(b"#")))
    return hashed.hexdigest()
