"""Which places are trained on, and which are held out."""

from pathlib import Path

from benchbot.plugin import BenchbotError
from benchbot_baselines.collecting import INFO

HELD_OUT_OF = 20
"""Of so many seeds, those that it divides are never trained on."""
FIRST_SEED = 1000
"""Lower seeds may be of places that are shipped, or that tests and documents use."""


def split_of(seed: int) -> str:
    """Return `train`, `validation` (held out), or `test`, of a place that solutions may be scored in."""
    if seed < FIRST_SEED:
        return "test"
    return "train" if seed % HELD_OUT_OF else "validation"


def seeds_of(folder: Path) -> tuple[list[int], list[int]]:
    """Return the seeds to train on and those held out; raises BenchbotError for places that are not of the generator.

    Every environment that is shipped stays a place never seen before: `FIRST_SEED` keeps off.
    """
    fix = f"Collect them: benchbot collect --seeds {FIRST_SEED}-1999 --size 320x240 -o FOLDER"
    if not (folder / INFO).is_file():
        raise BenchbotError(f"{folder} was not made by benchbot collect.", f"It has no {INFO}.", fix)
    names = sorted(path.stem for path in (folder / "places").glob("*.npz"))
    for name in names:
        if not name.isdecimal() or int(name) < FIRST_SEED:
            raise BenchbotError(
                f"The place '{name}' is not to be trained on.",
                f"Seeds are trained on from {FIRST_SEED}: lower ones, and names, may be of places that solutions are "
                "scored in.",
                fix,
            )
    seeds = [int(name) for name in names]
    held_out = [seed for seed in seeds if split_of(seed) == "validation"]
    trained = [seed for seed in seeds if split_of(seed) == "train"]
    if not held_out or not trained:
        raise BenchbotError(
            f"{folder} has too few places.",
            f"It has {len(trained)} to train on, and {len(held_out)} held out: seeds that {HELD_OUT_OF} divides.",
            fix,
        )
    return trained, held_out
