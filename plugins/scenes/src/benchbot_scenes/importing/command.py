"""`benchbot import-environment`: an environment from anybody's scene file."""

import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.cli.kit.status_line import working
from benchbot.plugin import BenchbotError

if TYPE_CHECKING:
    from benchbot_scenes.importing.environment import Imported
    from benchbot_scenes.importing.guesses import Guesses
    from benchbot_scenes.visibility import Observer

MOST_LABELS = 20


def import_environment(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A scene: .glb .gltf .obj .ply .stl .usd .usda .usdc .usdz")
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output-location", "-o", metavar="FOLDER", help="Where the add-on folder is made. [default: its name]"
        ),
    ] = None,
    name: Annotated[
        str | None, typer.Option("--name", metavar="NAME", help="The environment's name. [default: the file's]")
    ] = None,
    units: Annotated[
        Literal["auto", "m", "cm", "mm", "in", "ft"],
        typer.Option("--units", metavar="auto|m|cm|mm|in|ft", help="The unit of the file."),
    ] = "auto",
    up: Annotated[
        Literal["auto", "y", "z"], typer.Option("--up", metavar="auto|y|z", help="The axis that points up in the file.")
    ] = "auto",
    floor_z_m: Annotated[
        float | None,
        typer.Option("--floor-z", metavar="METRES", help="Height of the floor in the file. [default: found]"),
    ] = None,
    labels: Annotated[
        str | None,
        typer.Option(
            "--labels",
            metavar="FILE|none",
            help="The labels of a scan: as its data set ships them, or labels.json or .csv. [default: found beside it]",
        ),
    ] = None,
    guesses: Annotated[
        Path | None,
        typer.Option("--guesses", metavar="FILE", help="A corrected guesses.yaml of an earlier import."),
    ] = None,
    splats: Annotated[
        Path | None,
        typer.Option(
            "--splats",
            metavar="FILE",
            help="Gaussian splats of the same place, in the frame of FILE: a .ply of 3DGS. Colours are theirs then.",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option("--robot", metavar="ROBOT", help="The robot that has to fit and to see. [default: carter]"),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            "--start",
            metavar="X,Y[,DEG]",
            help="Where the robot starts: metres in the map, and its heading. [default: found]",
        ),
    ] = None,
    no_pictures: Annotated[
        bool, typer.Option("--no-pictures", help="Leave ray-traced views out of the report, which saves time.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Make an environment of a scene file: scene, ground truth, occupancy map, trajectory, and a report.

    Unit, up axis, floor, classes and start pose are guessed; the report says how, options and --guesses correct it.
    """
    from benchbot_scenes.importing import environment, report

    name = _checked_name(name if name is not None else _name_of(file))
    folder = output if output is not None else Path(name)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BenchbotError(
            f"{folder} is there already.",
            "An import makes a new folder, so that nothing is lost.",
            "Name another one: --output-location FOLDER",
        )
    known = _known(guesses, units, up, floor_z_m, file)
    known = replace(known, robot=robot or known.robot or "carter", start_pose=_start(start) or known.start_pose)
    imported = environment.build(file, name, _observer(str(known.robot)), known, _labels(labels), working, splats)
    with working("Writing the environment and its report"):
        environment.write(imported, folder)
        page = folder / "report.html"
        page.write_text(report.page(imported, file.name, []), encoding="utf-8")
    if as_json:
        console.data_json(_summary(imported, folder))
    else:
        _tell(imported, folder)
    if not no_pictures:
        with working("Taking pictures for the report, which may compile the ray tracer first"):
            views = report.views(imported)
        page.write_text(report.page(imported, file.name, views), encoding="utf-8")
    alignment = imported.alignment
    if alignment is not None and alignment.is_other_place:
        raise BenchbotError(
            f"The splats of {name}:1 are not where its mesh is.",
            f"{alignment}. {alignment.cause}",
            f"Export both in one frame: the same up axis, unit and origin. {page} shows what the robot would see.",
        )
    if imported.shows_nothing:
        raise BenchbotError(
            f"The robot sees nothing in {name}:1.",
            f"Its trajectory has {len(imported.declaration['trajectory_poses'])} poses; {page} shows where it starts.",
            "Let it start elsewhere (--start X,Y), check unit, up axis and floor, or choose a smaller robot (--robot).",
        )


def _known(path: Path | None, units: str, up: str, floor_z_m: float | None, file: Path) -> "Guesses":
    from benchbot_scenes.importing.guesses import beside, read_guesses

    known = beside(file) if path is None else read_guesses(path)
    if units != "auto":
        known = replace(known, units=units)
    if up != "auto":
        known = replace(known, up=cast(Literal["y", "z"], up))
    return known if floor_z_m is None else replace(known, floor_z_m=floor_z_m)


def _start(start: str | None) -> tuple[float, float, float] | None:
    if start is None:
        return None
    try:
        x, y, heading_deg = map(float, [*start.split(","), "0"][:3])
    except ValueError as error:
        raise BenchbotError(
            f"'{start}' is no start.",
            "It is x and y in metres in the map, and perhaps a heading in degrees.",
            "Write it like --start 1.5,2,90",
        ) from error
    return x, y, heading_deg


def _labels(labels: str | None) -> Path | Literal["none"] | None:
    return "none" if labels == "none" else None if labels is None else Path(labels)


def _observer(robot: str) -> "Observer":
    from benchbot.plugin import Catalog, load_plugins
    from benchbot_scenes.visibility import CARTER, observer

    catalog = Catalog(load_plugins())
    if robot == "carter" and robot not in catalog.names("robots"):
        return CARTER
    declared = catalog.get("robots", robot).data
    if "footprint" not in declared:
        raise BenchbotError(
            f"The robot '{robot}' has no footprint.",
            "Only simulated robots say how much room they need.",
            "Choose one of type sim_taichi, such as carter.",
        )
    return observer(declared)


def _name_of(file: Path) -> str:
    return re.sub(r"[^a-z0-9]+", "_", file.stem.lower()).strip("_") or "scene"


def _checked_name(name: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name):
        raise BenchbotError(
            f"'{name}' cannot be an environment's name.",
            "It becomes part of file names and of NAME:1.",
            "Use letters, digits, _ and -: --name my_room",
        )
    return name


def _summary(imported: "Imported", folder: Path) -> dict[str, Any]:
    objects = imported.ground_truth["ground_truth"]["objects"]
    found = [entry["class"] for entry in objects]
    return {
        "environment": f"{imported.declaration['name']}:1",
        "folder": str(folder),
        "triangles": len(imported.geometry.triangles),
        "size_m": [round(side, 3) for side in imported.understood.size_m],
        "units": imported.guesses.units,
        "up": imported.guesses.up,
        "floor_z_m": imported.guesses.floor_z_m,
        "free_area_m2": round(imported.room.area_m2, 2),
        "start_pose": imported.declaration["start_pose"],
        "trajectory_poses": len(imported.declaration["trajectory_poses"]),
        "classes": {class_name: found.count(class_name) for class_name in sorted(set(found))},
        "labels": _labels_summary(imported),
        "splats": _splats_summary(imported),
        "robot": imported.guesses.robot,
        "unseen": list(imported.unseen),
        "hidden": list(imported.guesses.hidden or ()),
        "notes": list(imported.notes),
    }


def _splats_summary(imported: "Imported") -> dict[str, Any] | None:
    splats = imported.geometry.splats
    if splats is None:
        return None
    return {"number": splats.count, "alignment": imported.alignment and asdict(imported.alignment)}


def _labels_summary(imported: "Imported") -> dict[str, Any] | None:
    labelled = imported.understood.labelled
    if labelled is None:
        return None
    mapped = {label: found for label, found in labelled.classes.items() if found is not None}
    return {
        "format": labelled.format,
        "objects": sum(labelled.counts.values()),
        "mapped": mapped,
        "not_mapped": {label: count for label, count in labelled.counts.items() if label not in mapped},
        "not_known": sorted(label for label in labelled.classes if label not in mapped and label not in labelled.known),
    }


def _tell(imported: "Imported", folder: Path) -> None:
    told = _summary(imported, folder)
    size = " x ".join(f"{side:.1f}" for side in told["size_m"])
    labels = told["labels"]
    classes = ", ".join(f"{count} {class_name}" for class_name, count in told["classes"].items())
    console.table(
        ("what", "value"),
        [
            ("environment", told["environment"]),
            ("size", f"{size} m, {told['triangles']:,} triangles"),
            ("unit", f"{told['units']}: {imported.reasons.get('units', 'as told')}"),
            ("up axis", f"{told['up']}: {imported.reasons.get('up', 'as told')}"),
            ("floor", f"{told['floor_z_m']:g} m: {imported.reasons.get('floor_z_m', 'as told')}"),
            ("room to move", f"{told['free_area_m2']:.1f} m²"),
            ("trajectory", f"{told['trajectory_poses']} poses"),
            ("objects", classes or "none: no name in the file is that of a class"),
            *([] if labels is None else [("labels", _about(labels))]),
            *([] if told["splats"] is None else [("splats", f"{told['splats']['number']:,}: colours are theirs")]),
            ("report", str(folder / "report.html")),
        ],
    )
    for line in () if labels is None else _unmapped(labels):
        console.note(line)
    for note in told["notes"]:
        console.note(note)
    console.note(
        f"Run it: benchbot run --addons {folder} --env {told['environment']} --robot {imported.guesses.robot} --task …"
    )


def _about(labels: dict[str, Any]) -> str:
    of_class = labels["objects"] - sum(labels["not_mapped"].values())
    return f"{labels['format']}: {labels['objects']} objects, {of_class} of a class"


def _unmapped(labels: dict[str, Any]) -> list[str]:
    """Lines on labels that became no class: those that are of none, and those that the vocabulary does not know."""
    unknown = {label: labels["not_mapped"][label] for label in labels["not_known"]}
    other = {label: count for label, count in labels["not_mapped"].items() if label not in unknown}
    lines = []
    if other:
        lines.append(f"Labels that are none of the classes: {_counted(other)}.")
    if unknown:
        lines.append(
            f"Labels that are not known: {_counted(unknown)}. Say in guesses.yaml, under classes, what they are."
        )
    return lines


def _counted(labels: dict[str, int]) -> str:
    most = sorted(labels.items(), key=lambda item: (-item[1], item[0]))
    left = f", and {len(most) - MOST_LABELS} more" if len(most) > MOST_LABELS else ""
    return ", ".join(f"{count} {label}" for label, count in most[:MOST_LABELS]) + left
