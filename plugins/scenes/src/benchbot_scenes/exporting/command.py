"""`benchbot export`: an environment's scene as a file of another simulator."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.cli.kit.status_line import working
from benchbot.plugin import BenchbotError, did_you_mean, target, write_atomically

if TYPE_CHECKING:
    from benchbot_scenes.scene import SceneGeometry

FORMATS = {
    "gltf": target("benchbot_scenes.exporting.gltf:files"),
    "mjcf": target("benchbot_scenes.exporting.mjcf:files"),
    "sdf": target("benchbot_scenes.exporting.sdf:files"),
    "usd": target("benchbot_scenes.exporting.usd:files"),
}
"""Each gives a scene's files, by their paths in the folder, from the scene and its name."""


def export_environment(
    environment: Annotated[str, typer.Argument(metavar="ENVIRONMENT", help="As benchbot list prints it: NAME:VARIANT")],
    to: Annotated[str, typer.Option("--to", metavar="|".join(FORMATS), help="The format.")],
    output: Annotated[
        Path, typer.Option("--output-location", "--output", "-o", metavar="FOLDER", help="Where the files go.")
    ] = Path(),
    with_ground_truth: Annotated[
        bool,
        typer.Option("--with-ground-truth", help="With names and classes of objects, and the ground truth beside it."),
    ] = False,
    with_hidden: Annotated[
        bool, typer.Option("--with-hidden", help="Hidden places, too: who gets the files, knows them.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Write an environment's scene for other simulators: shapes, materials, lamps, and shapes to collide with.

    Objects are numbered, without classes, unless --with-ground-truth asks for them. No file is overwritten.
    """
    from benchbot.plugin import Catalog, cache_dir
    from benchbot.plugin import load_plugins as load
    from benchbot_scenes.exporting.labels import without_labels
    from benchbot_scenes.gltf import load_scene
    from benchbot_scenes.scene_file import scene_file

    if to not in FORMATS:
        raise BenchbotError(
            f"There is no format '{to}' to export to.",
            f"A scene can be written as {', '.join(FORMATS)}.{did_you_mean(to, list(FORMATS))}",
            f"Choose one: --to {'|'.join(FORMATS)}",
        )
    written: list[Path] = []
    for declared in Catalog(load()).environments(environment):
        _check(declared.name, declared.data, with_hidden=with_hidden)
        with working(f"Exporting {declared.name}"):
            source = declared.path.parent / declared.data["map_path"]
            geometry = load_scene(scene_file(source, cache_dir(), declared.data.get("assets")))
            name = declared.name.replace(":", "_")
            files = FORMATS[to](geometry if with_ground_truth else without_labels(geometry), name)
            if geometry.splats is not None and to != "gltf":
                console.note(
                    f"The splats of {declared.name} are left out of {to}: its mesh is written. --to gltf has both."
                )
            if with_ground_truth:
                files[f"{name}.ground_truth.json"] = _truth(geometry, declared.data)
            written += _write(output, files)
    if as_json:
        console.data_json([str(path) for path in written])
    else:
        for path in written:
            if path.parent == output:
                console.data(str(path))


def _check(name: str, data: dict[str, object], *, with_hidden: bool) -> None:
    if "map_path" not in data or data["type"] == "real":
        raise BenchbotError(
            f"'{name}' has no scene.",
            f"It is of type {data['type']}: there is no file to export.",
            "Choose an environment of a simulator: benchbot list environments",
        )
    if data.get("hidden") and not with_hidden:
        raise BenchbotError(
            f"The place '{name}' is hidden.",
            "Whoever gets its scene knows where everything in it is.",
            "Export another one, or say that it is meant: --with-hidden",
        )


def _truth(geometry: "SceneGeometry", data: dict[str, object]) -> bytes:
    from benchbot_scenes.ground_truth import ground_truth

    classes = sorted({found.class_name for found in geometry.instances if found.class_name is not None})
    truth = ground_truth(geometry, {"object_labels": classes, **data})
    return (json.dumps(truth, indent=1) + "\n").encode()


def _write(folder: Path, files: dict[str, bytes]) -> list[Path]:
    """Write new files; raises BenchbotError, before any is written, where one is there already."""
    paths = {folder / name: content for name, content in files.items()}
    for path in sorted(set(paths) | {folder / name.split("/")[0] for name in files if "/" in name}):
        if path.exists() or path.is_symlink():
            raise BenchbotError(
                f"{path} is there already.",
                "An export overwrites nothing.",
                "Name another folder, --output FOLDER, or take the old files away.",
            )
    try:
        for path, content in paths.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, content)
    except OSError as error:
        raise BenchbotError(
            f"The scene cannot be written to {folder}.",
            f"{error.filename}: {error.strerror}",
            "Name another folder: --output FOLDER",
        ) from error
    return list(paths)
