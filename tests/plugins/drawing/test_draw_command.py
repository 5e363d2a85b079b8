"""`benchbot draw`: every figure in every form, the same each time, and what cannot be drawn is told."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.command_line import CommandLine, Here

TRUTH = ("--ground-truth", "truth.json")


def frames(folder: Path, count: int) -> None:
    folder.mkdir(parents=True)
    for number in range(count):
        Image.new("RGB", (48, 27), (number * 5, 100, 200)).save(folder / f"{number:05d}.jpg")


def test_each_figure_in_each_form(result_folder: CommandLine, here: Here) -> None:
    frames(result_folder.folder / "perfect-recordings" / "frames", 30)
    for option in ("--map", "--trajectory", "--frames"):
        for form in ("png", "svg", "pdf"):
            done = here("draw", "perfect.json", option, *TRUTH, "-o", f"out/{option[2:]}.{form}")
            assert (done.returncode, done.stdout) == (0, f"out/{option[2:]}.{form}\n"), done.stderr
    out = result_folder.folder / "out"
    widths_mm = {path.stem: Image.open(path).width / 300 * 25.4 for path in out.glob("*.png")}
    assert widths_mm == pytest.approx({"map": 88, "trajectory": 88, "frames": 180}, abs=0.2)
    # Letters of a PDF are whole fonts that are embedded in it; nothing of an SVG depends on the fonts of its reader.
    assert b"/FontFile2" in (out / "map.pdf").read_bytes()
    assert b"/Type3" not in (out / "map.pdf").read_bytes()
    assert "<text" not in (out / "map.svg").read_text()
    for form in ("svg", "pdf"):
        here("draw", "perfect.json", *TRUTH, "-o", f"again.{form}")
        assert (result_folder.folder / f"again.{form}").read_bytes() == (out / f"map.{form}").read_bytes()


def test_several_results_stand_side_by_side(result_folder: CommandLine, here: Here) -> None:
    one = here("draw", "perfect.json", *TRUTH, "-o", "one.png", "--width", "120")
    two = here("draw", "perfect.json", "empty.json", *TRUTH, "-o", "two.png", "--width", "120")
    assert (one.returncode, two.returncode) == (0, 0), one.stderr + two.stderr
    pictures = [np.asarray(Image.open(result_folder.folder / name).convert("RGB")) for name in ("one.png", "two.png")]
    assert pictures[0].shape[1] == pictures[1].shape[1]
    # What was found is drawn in colours, and the empty result has found nothing.
    half = pictures[1].shape[1] // 2
    colourful = np.ptp(pictures[1].astype(int), axis=2) > 60
    body = slice(0, int(pictures[1].shape[0] * 0.75))
    assert colourful[body, :half].sum() > 2 * colourful[body, half:].sum()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["missing.json"], "Cannot read missing.json"),
        (["perfect.json", "-o", "figure.odd"], "cannot be written as 'figure.odd'"),
        (["perfect.json", "--map", "--frames"], "not clear what to draw"),
        (["perfect.json", "--frames"], "perfect-recordings/frames"),
        (["perfect.json", "empty.json", "--frames"], "Frames are drawn of one result"),
        (["perfect.json", "-o", "truth.json/figure.png"], "Cannot write truth.json/figure.png"),
    ],
)
def test_what_cannot_be_drawn_is_told(result_folder: CommandLine, here: Here, words: list[str], why: str) -> None:
    done = here("draw", *words)
    assert (done.returncode, re.sub(r"\s+", " ", done.stderr).count(why)) == (2, 1), done.stderr


def test_without_matplotlib_it_is_said_how_to_get_it(
    result_folder: CommandLine, here: Here, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = here("draw", "perfect.json", *TRUTH, "-o", "map.png")
    assert (done.returncode, "pip install 'benchbot[viz]'" in done.stderr) == (2, True)
