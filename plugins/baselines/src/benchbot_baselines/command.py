"""`benchbot collect`: labelled pictures of generated places."""

import re
from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.status_line import counted, working
from benchbot.plugin import BenchbotError, did_you_mean

FORMATS = ("arrays", "coco", "parquet")
MOST_SEEDS = 100_000


def collect(
    seeds: Annotated[str, typer.Option("--seeds", metavar="FIRST-LAST", help="Seeds of the generator.")],
    output: Annotated[Path, typer.Option("--output-location", "-o", metavar="FOLDER", help="Where to.")],
    views: Annotated[int, typer.Option("--views", min=1, max=10_000, help="Pictures of each place.")] = 40,
    lights: Annotated[str, typer.Option("--lights", metavar="NAMES", help="Any of day, evening, night.")] = (
        "day,evening,night"
    ),
    size: Annotated[str, typer.Option("--size", metavar="WxH", help="Of a picture, in pixels.")] = "640x480",
    quality: Annotated[str, typer.Option("--quality", help="Of colours: fast or realtime.")] = "realtime",
    formats: Annotated[
        str, typer.Option("--formats", metavar="NAMES", help="arrays (always kept), coco, parquet.")
    ] = "coco",
    device: Annotated[str, typer.Option("--device", help="auto, cpu or cuda.")] = "auto",
    workers: Annotated[
        int, typer.Option("--workers", min=1, max=256, help="Places that are made at a time, 1.5 GB of memory each.")
    ] = 2,
) -> None:
    """Collect labelled pictures of generated places: colours, depth, objects, poses.

    \b
    benchbot collect --seeds 1000-1099 --output-location data

    Each seed is a place in one light; what is there already is not made again: an interrupted run goes on when it is
    started again. `places/SEED.npz` has all arrays of a place; `coco/instances.json` boxes and masks;
    `parquet` what Hugging Face's datasets reads.
    """
    from functools import partial
    from importlib.util import find_spec

    from benchbot_baselines import coco
    from benchbot_baselines.collecting import Settings, begin, collect_places
    from benchbot_baselines.places import LIGHTS
    from benchbot_sim_taichi import devices

    wanted = _named(formats, FORMATS, "--formats")
    if "parquet" in wanted and find_spec("pyarrow") is None:
        raise BenchbotError(
            "Parquet cannot be written here.",
            "pyarrow is not installed.",
            'Install it: pip install "benchbot-baselines[parquet]"',
        )
    chosen = range(*_seeds(seeds))
    width, height = _size(size)
    settings = Settings(
        views,
        width,
        height,
        _named(lights, tuple(LIGHTS), "--lights"),
        _named(quality, ("fast", "realtime"), "--quality")[0],
    )
    kind = devices.resolve({"device": device}).kind
    begin(output, settings)
    progress = counted("places", chosen)

    writers = [partial(coco.write_place, output / "coco")] if "coco" in wanted else []
    if "parquet" in wanted:
        from benchbot_baselines import parquet

        writers.append(partial(parquet.write_place, output / "parquet"))
    with working("Collecting pictures"):
        next(progress)
        for _ in collect_places(output, chosen, settings, kind, workers, writers):
            next(progress, None)
    next(progress, None)
    if "coco" in wanted:
        console.note(f"Boxes and masks: {coco.finish(output / 'coco')}")
    console.note(f"{len(chosen)} places, {len(chosen) * views} pictures")
    console.data(str(output))


def _seeds(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,6})(?:-(\d{1,6}))?", text)
    first, last = (int(found[1]), int(found[2] or found[1])) if found else (1, 0)
    if not first <= last < first + MOST_SEEDS:
        raise BenchbotError(
            f"'{text}' names no seeds.",
            "Seeds are a first and a last whole number, below 1,000,000.",
            "Write, for example: --seeds 1000-1099",
        )
    return first, last + 1


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{2,4})x(\d{2,4})", text)
    if not found:
        raise BenchbotError(f"'{text}' is no size.", "It is width x height in pixels.", "Write: --size 640x480")
    return int(found[1]), int(found[2])


def _named(text: str, known: tuple[str, ...], option: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    for name in names:
        if name not in known:
            raise BenchbotError(
                f"{option} does not know '{name}'.",
                f"There are: {', '.join(known)}.{did_you_mean(name, list(known))}",
                f"Write: {option} {','.join(known)}",
            )
    return names
