"""`benchbot picture`: a result, its ground truth and its score in one picture."""

from pathlib import Path
from typing import Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

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
    from benchbot.plugins.drawing.map_model import driven_paths, occupancy_of
    from benchbot.plugins.drawing.picture import draw

    console.check_output(output)
    document = results.read(result)
    catalog = Catalog(load())
    evaluator = choose_method(catalog.plugins, method, document["task_details"].get("results_format"))
    truths = None if ground_truth is None else [ground_truth]
    scores = evaluate_files([result], catalog=catalog, method=evaluator.name, ground_truth_paths=truths)
    scene = document["environment_details"][0]
    environment = environment_of(scene)
    truth = GroundTruths.of(catalog, truths).find(environment, evaluator.ground_truth_formats)
    # At each recorded frame: at the start, then at each pose of the trajectory; of a result that says where it started.
    trajectory = driven_paths({"environment_details": [scene]})[0].observed
    occupancy = occupancy_of(catalog.find("environments", environment))
    image = draw(_frames(frames, len(trajectory)), document, truth, scores, trajectory, occupancy)
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        image.save(output)
    except (OSError, ValueError) as error:
        raise BenchbotError(
            f"Cannot write {output}.", str(error), "Choose a name that ends in .png, in a folder that you may write to."
        ) from error
    console.data(str(output))


def _frames(folder: Path | None, pose_count: int) -> dict[int, Any]:
    """Return some of the recorded frames, evenly spread, by the index of the pose that each was taken from."""
    if folder is None:
        return {}
    import numpy as np
    from PIL import Image

    from benchbot.plugins.drawing.scene_maps import chosen, frames_in

    # In an active task, frames beyond the declared poses were taken from places that the result does not know.
    usable = {number: path for number, path in frames_in(folder).items() if number < pose_count}
    return {number: np.asarray(Image.open(path)) for number, path in chosen(usable, SHOWN_FRAMES).items()}
