"""`benchbot picture`: a result, its ground truth and its score in one picture."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.core.geometry import Pose

SHOWN_FRAMES = 4


def picture(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="The result file.")],
    frames: Annotated[
        Path | None,
        typer.Option(
            "--frames", metavar="FOLDER", help="What submit --record frames=FOLDER wrote, to show some of it."
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option("--method", "-m", metavar="METHOD", help="How to score. [default: the one that fits the result]"),
    ] = None,
    ground_truth: Annotated[
        Path | None,
        typer.Option("--ground-truth", metavar="GT.json", help="A ground truth to use instead of the installed one."),
    ] = None,
    output: Annotated[Path, typer.Option("--output-location", "-o", metavar="PATH", help="Write it here.")] = Path(
        "picture.png"
    ),
) -> None:
    """Draw an object map beside the truth, with its score and what the robot saw; prints the picture's path."""
    from benchbot.core import results
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.evaluation.ground_truths import GroundTruths, environment_of
    from benchbot.evaluation.score import choose_method, evaluate_files
    from benchbot.plugins.drawing.picture import draw

    console.check_output(output)
    document = results.read(result)
    catalog = Catalog(load())
    evaluator = choose_method(catalog.plugins, method, document["task_details"].get("results_format"))
    truths = None if ground_truth is None else [ground_truth]
    scores = evaluate_files([result], catalog=catalog, method=evaluator.name, ground_truth_paths=truths)
    scene = document["environment_details"][0]
    truth = GroundTruths.of(catalog, truths).find(environment_of(scene), evaluator.ground_truth_formats)
    trajectory = _trajectory(scene)
    image = draw(_frames(frames, len(trajectory)), document, truth, scores, trajectory)
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        image.save(output)
    except (OSError, ValueError) as error:
        raise BenchbotError(
            f"Cannot write {output}.", str(error), "Choose a name that ends in .png, in a folder that you may write to."
        ) from error
    console.data(str(output))


def _trajectory(scene: dict[str, Any]) -> "list[Pose]":
    """Return where the robot was at each recorded frame: at the start, then at each pose of the trajectory.

    None of them is known of a result that does not say where it started.
    """
    from benchbot.core.geometry import Pose

    poses = [scene["start_pose"], *scene.get("trajectory_poses", ())] if "start_pose" in scene else []
    return [Pose.from_wxyz_xyz(values) for values in poses]


def _frames(folder: Path | None, pose_count: int) -> dict[int, Any]:
    """Return some of the recorded frames, evenly spread, by the index of the pose that each was taken from."""
    if folder is None:
        return {}
    import numpy as np
    from PIL import Image

    from benchbot.plugins.drawing.recorded_frames import numbered

    paths = numbered(folder)
    if not paths:
        raise BenchbotError(
            f"There are no frames in {folder}.",
            "It holds no JPEG files.",
            f"Record them with the result: benchbot submit … --record frames={folder}",
        )
    # In an active task, frames beyond the declared poses were taken from places that the result does not know.
    usable = [number for number in paths if number < pose_count]
    if not usable:
        return {}
    shown = [usable[len(usable) * i // SHOWN_FRAMES] for i in range(SHOWN_FRAMES)]
    return {index: np.asarray(Image.open(paths[index])) for index in dict.fromkeys(shown)}
