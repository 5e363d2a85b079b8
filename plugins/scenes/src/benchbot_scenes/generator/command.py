"""`benchbot generate-environment`: a new furnished place from a seed."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.cli.kit.status_line import working
from benchbot.plugin import BenchbotError

if TYPE_CHECKING:
    from benchbot_scenes.generator.files import Written
    from benchbot_scenes.generator.generate import Generated


def generate_environment(
    kind: Annotated[
        str, typer.Option("--kind", metavar="KIND", help="apartment, house, office or company.")
    ] = "apartment",
    rooms: Annotated[int, typer.Option("--rooms", metavar="NUMBER", help="How many rooms, 1 to 12.")] = 4,
    seed: Annotated[int, typer.Option("--seed", metavar="NUMBER", help="What the place is drawn from.")] = 0,
    output: Annotated[
        Path | None,
        typer.Option("--output-location", "-o", metavar="FOLDER", help="The add-on folder. [default: its name]"),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            "--name",
            metavar="NAME",
            help="The environment's name. [default: KIND_SEED; with a secret one that tells neither]",
        ),
    ] = None,
    secret: Annotated[
        Path | None,
        typer.Option(
            "--secret",
            metavar="FILE",
            help="128 bits or more, in hexadecimal digits, without which nobody makes the place again.",
        ),
    ] = None,
    assets: Annotated[
        str, typer.Option("--assets", metavar="PACK", help="The asset pack to furnish with.")
    ] = "household",
    robot: Annotated[
        str, typer.Option("--robot", metavar="ROBOT", help="The robot that has to fit and see.")
    ] = "carter",
    as_json: Json = False,
) -> None:
    """Make a new environment from a seed: layout, declaration, trajectory, ground truth, occupancy map.

    The same options always give the same place. They are kept in FOLDER.origin.json, for your eyes only: what others
    see of the place tells neither kind nor seed. Use it with: benchbot run --addons FOLDER --env NAME:1 …
    """
    from benchbot.plugin import Catalog, randomness
    from benchbot.plugin import load_plugins as load
    from benchbot_scenes.catalogue import pack, packs
    from benchbot_scenes.generator.files import (
        least_room_m,
        origin_file,
        pinned,
        write_origin,
        write_picture,
        write_place,
    )
    from benchbot_scenes.generator.generate import generate
    from benchbot_scenes.visibility import observer

    known = "" if secret is None else randomness.read_secret(secret)
    name = _checked_name(name if name is not None else _default_name(kind, rooms, seed, known))
    folder = output if output is not None else Path(name)
    origin = origin_file(folder)
    _require_new(folder, origin)
    sees = observer(Catalog(load()).get("robots", robot).data)
    with working("Furnishing the place, and planning in it"):
        place = generate(seed, kind, rooms, pack(assets), sees, known)
        written = write_place(folder, name, 1, place, sees, hidden=bool(known))
        write_picture(folder / "maps" / f"{name}_1", written.geometry)
        room_m = least_room_m(written, place, sees)
    made = {"environment": f"{name}:1", "kind": kind, "rooms": rooms, "seed": seed, "robot": robot, "assets": assets}
    write_origin(origin, {**made, **pinned(packs()[assets], secret)})
    if as_json:
        console.data_json({**_summary(name, place, written, room_m), "origin": str(origin)})
    else:
        _tell(name, folder, place, written, room_m)
        console.note(f"How it was made, for your eyes only: {origin}")


def _checked_name(name: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_-]*", name):
        raise BenchbotError(
            f"'{name}' cannot name an environment.",
            "A name has letters, digits, '_' and '-'.",
            "Name it, for example: --name apartment_7",
        )
    return name


def _default_name(kind: str, rooms: int, seed: int, secret: str) -> str:
    """The name of a place that has been given none: with a secret one that tells only those who know it."""
    from benchbot.plugin import randomness

    if not secret:
        return f"{kind}_{seed}"
    return f"place_{randomness.key(secret, seed, 'name of a place', kind, rooms) >> 224:08x}"


def _require_new(folder: Path, origin: Path) -> None:
    taken = folder if folder.exists() and (not folder.is_dir() or any(folder.iterdir())) else origin
    if taken.exists():
        raise BenchbotError(
            f"{taken} is there already.",
            "Generating makes a new folder, so that nothing is lost.",
            "Name another one: --output-location FOLDER",
        )


def _summary(name: str, place: "Generated", written: "Written", room_m: float) -> dict[str, Any]:
    from benchbot_scenes.generator.proxy import class_counts

    building = place.layout.building
    return {
        "environment": f"{name}:1",
        "declaration": str(written.declaration),
        "rooms": [room.name for room in building.rooms] if building else [],
        "objects": written.objects,
        "classes": dict(class_counts(place.items)),
        "triangles": len(written.geometry.triangles),
        "trajectory_poses": len(place.trajectory_poses),
        "least_clearance_m": round(room_m, 3),
    }


def _tell(name: str, folder: Path, place: "Generated", written: "Written", room_m: float) -> None:
    summary = _summary(name, place, written, room_m)
    counts = ", ".join(f"{count} {kind}" for kind, count in summary["classes"].items())
    console.note(f"{summary['environment']}: {', '.join(summary['rooms'])}")
    console.note(f"{summary['objects']} objects: {counts}")
    console.note(
        f"{summary['triangles']} triangles, a trajectory of {summary['trajectory_poses']} poses, "
        f"never closer than {summary['least_clearance_m']} m to anything"
    )
    console.note(f"Use it: benchbot run --addons {folder} --env {summary['environment']} --robot carter --task TASK")
    console.data(str(written.declaration))
