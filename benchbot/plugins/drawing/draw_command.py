"""`benchbot draw`: figures of results for papers."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMN_MM, PAGE_MM = 88.0, 180.0


def draw(
    results: Annotated[
        list[str],
        typer.Argument(metavar="[NAME=]RESULT…", help="Result files, drawn side by side, by the names of solutions."),
    ],
    as_map: Annotated[bool, typer.Option("--map", help="From above: floor, truth, what was found. [default]")] = False,
    trajectory: Annotated[
        bool, typer.Option("--trajectory", help="The way that the robot went, beside the one that was estimated.")
    ] = False,
    frames: Annotated[bool, typer.Option("--frames", help="What the camera saw, as --record frames wrote it.")] = False,
    frames_location: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Where the frames are. [default: beside the result]"),
    ] = None,
    count: Annotated[int, typer.Option(metavar="N", min=1, max=400, help="How many frames.")] = 12,
    columns: Annotated[int, typer.Option(metavar="N", min=1, max=40, help="How many frames in a row.")] = 4,
    ground_truth: Annotated[
        list[Path] | None,
        typer.Option("--ground-truth", metavar="GT.json", help="Use this truth, not the installed ones; repeatable."),
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            "--width", metavar="MM", min=20, max=1000, help="How wide. [default: 88, a column; of several panels 180]"
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("--output-location", "-o", metavar="PATH", help="Write it here, as .png, .svg or .pdf.")
    ] = Path("figure.pdf"),
) -> None:
    """Draw frames, map or way of results, as figures for a paper; prints the figure's path.

    Letters stay letters in PDF and are outlines in SVG. Maps and trajectories show the truth: keep them from solutions.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.evaluation.result_files import named
    from benchbot.plugins.drawing import figures
    from benchbot.plugins.drawing.scene_maps import maps_of_result

    if sum((as_map, trajectory, frames)) > 1:
        raise BenchbotError(
            "It is not clear what to draw.",
            "More than one of --map, --trajectory and --frames was given.",
            "Draw one figure at a time.",
        )
    console.check_output(output)
    named_results = [named(text) for text in results]
    with figures.style():
        if frames:
            drawn = _sheet([path for _, path in named_results], frames_location, count, columns, width or PAGE_MM)
        else:
            catalog = Catalog(load())
            scenes = [
                replace(scene, solution=name if len(results) > 1 else "")
                for name, path in named_results
                for scene in maps_of_result(path, catalog, ground_truth)
            ]
            wide = width or (COLUMN_MM if len(scenes) == 1 else PAGE_MM)
            drawn = (figures.draw_paths if trajectory else figures.draw_maps)(scenes, wide)
        figures.save(drawn, output)
    console.data(str(output))


def _sheet(results: list[Path], location: Path | None, count: int, columns: int, width_mm: float) -> "Figure":
    from benchbot.evaluation.frames import frame_folders, numbered_frames
    from benchbot.plugins.drawing.figures import draw_frames
    from benchbot.plugins.drawing.scene_maps import chosen

    if len(results) != 1:
        raise BenchbotError("Frames are drawn of one result.", f"{len(results)} were given.", "Give one of them.")
    folders = [location] if location is not None else frame_folders(results[0])
    found = next((listed for folder in folders if (listed := numbered_frames(folder))), None)
    if found is None:
        raise BenchbotError(
            f"There are no frames of {results[0]}.",
            f"There are no JPEG files in {' or '.join(map(str, folders))}.",
            "Record them with the result: benchbot submit … --record frames; or name their folder: --frames-location",
        )
    return draw_frames(chosen(found, count), width_mm, columns)
