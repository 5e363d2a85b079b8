"""One picture of one result: what the robot saw, what it mapped beside what is there, and the score."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing.label_placement import Rectangle
from benchbot.plugins.drawing.map_drawing import (
    FAINT,
    INK,
    PATH_END,
    TRUTH_FILL,
    TRUTH_LINE,
    Color,
    Thing,
    class_colors,
    draw_badge,
    draw_map,
    font,
)

WIDTH_PX, HEIGHT_PX = 1840, 1000
# Everything is drawn twice as large and scaled down, which smooths all edges.
_SCALE = 2
_MARGIN, _GAP, _HEADER, _FOOTER = 44, 12, 92, 62
_STRIP_WIDTH, _SCORES_WIDTH = 560, 250
_BAR: Color = (226, 229, 233)


def draw(
    frames: Mapping[int, NDArray[np.uint8]],
    result: Mapping[str, Any],
    ground_truth: Mapping[str, Any],
    scores: Mapping[str, Any],
    trajectory: Sequence[Pose],
) -> Image.Image:
    """Return the picture of a result, 1840 x 1000 pixels, RGB.

    `frames` holds colour images (H, W, 3), sRGB, by the index of the pose in `trajectory` that each was taken
    from; three or four are best. `scores` is the scores document. Needs Pillow: pip install benchbot[picture]
    """
    image = Image.new("RGB", (WIDTH_PX * _SCALE, HEIGHT_PX * _SCALE), (255, 255, 255))
    pencil = ImageDraw.Draw(image, "RGBA")
    truth, estimate = _things(result, ground_truth)
    top, bottom = _HEADER, HEIGHT_PX - _FOOTER
    _draw_header(pencil, result)
    strip_right = _draw_frames(image, pencil, frames, top, bottom)
    frame = Rectangle(strip_right + 78, top, WIDTH_PX - _MARGIN - _SCORES_WIDTH - 40, bottom)
    draw_map(
        pencil,
        _scaled(frame),
        truth,
        estimate,
        trajectory,
        {index: str(number) for number, index in enumerate(frames, 1)},
        _SCALE,
    )
    _draw_scores(pencil, frame.right + 40, top, scores, len(truth), len(estimate))
    _draw_key(pencil, frame.right + 40, bottom, class_colors([*truth, *estimate]), result)
    return image.resize((WIDTH_PX, HEIGHT_PX), Image.Resampling.LANCZOS)


def _things(result: Mapping[str, Any], ground_truth: Mapping[str, Any]) -> tuple[list[Thing], list[Thing]]:
    truth = [Thing.of(item, item["class"]) for item in ground_truth["ground_truth"]["objects"]]
    names = result["results"]["class_list"]
    estimate = [Thing.of(item, names[int(np.argmax(item["label_probs"]))]) for item in result["results"]["objects"]]
    return truth, estimate


def _draw_header(pencil: ImageDraw.ImageDraw, result: Mapping[str, Any]) -> None:
    scenes = result["environment_details"]
    environment = ":".join([str(scenes[0]["name"]), *(str(scene["variant"]) for scene in scenes)])
    _text(pencil, _MARGIN, 40, environment, 27, INK, "ls", bold=True)
    _text(pencil, _MARGIN, 66, result["task_details"]["name"], 15, FAINT, "ls")


def _draw_frames(
    image: Image.Image,
    pencil: ImageDraw.ImageDraw,
    frames: Mapping[int, NDArray[np.uint8]],
    top: float,
    bottom: float,
) -> float:
    """Draw the pictures below one another; return where the strip ends on the right."""
    if not frames:
        return _MARGIN - 30
    tallest = (bottom - top - _GAP * (len(frames) - 1)) / len(frames)
    right = float(_MARGIN)
    for number, frame in enumerate(frames.values(), 1):
        width = min(tallest * frame.shape[1] / frame.shape[0], _STRIP_WIDTH)
        height = width * frame.shape[0] / frame.shape[1]
        place = _scaled(Rectangle(_MARGIN, top, _MARGIN + width, top + height))
        size = (round(place.right - place.left), round(place.bottom - place.top))
        image.paste(
            Image.fromarray(frame).resize(size, Image.Resampling.LANCZOS), (round(place.left), round(place.top))
        )
        draw_badge(pencil, (place.left + 22 * _SCALE, place.top + 22 * _SCALE), str(number), _SCALE)
        top += height + _GAP
        right = max(right, _MARGIN + width)
    return right


def _draw_scores(
    pencil: ImageDraw.ImageDraw, left: float, top: float, scores: Mapping[str, Any], true_count: int, count: int
) -> None:
    headline = scores["method"]["headline"]
    values = scores["scores"]
    _text(pencil, left, top + 14, headline, 17, FAINT, "ls")
    _text(pencil, left - 3, top + 84, f"{values[headline]:.2f}", 76, INK, "ls", bold=True)
    y = top + 128
    for name, value in values.items():
        if name == headline:
            continue
        _text(pencil, left, y, _words(name), 14, INK, "ls")
        _text(pencil, left + _SCORES_WIDTH, y, f"{value:.2f}", 14, INK, "rs")
        bar = Rectangle(left, y + 8, left + _SCORES_WIDTH, y + 14)
        pencil.rounded_rectangle(_corners(bar), radius=3 * _SCALE, fill=_BAR)
        filled = Rectangle(left, bar.top, left + max(_SCORES_WIDTH * value, 6), bar.bottom)
        pencil.rounded_rectangle(_corners(filled), radius=3 * _SCALE, fill=PATH_END)
        y += 46
    _text(pencil, left, y + 8, f"{true_count} objects are there, {count} are mapped", 14, FAINT, "ls")


def _draw_key(
    pencil: ImageDraw.ImageDraw, left: float, bottom: float, colors: Mapping[str, Color], result: Mapping[str, Any]
) -> None:
    provenance = result.get("provenance") or {}
    selection = provenance.get("selection", {})
    lines = [f"robot {selection['robot']}, seed {selection['seed']}"] if selection else []
    if provenance:
        lines.append(f"benchbot {provenance['benchbot']}, {provenance['steps']} steps")
        lines.append(f"observations {provenance['observation_digest'][:16]}")
    y = bottom - 4
    for line in reversed(lines):
        _text(pencil, left, y, line, 13, FAINT, "ls")
        y -= 20
    y -= 12
    swatches = [_corners(Rectangle(left, y - 13 - 26 * i, left + 26, y + 1 - 26 * i)) for i in range(3)]
    for i, text in enumerate(("path of the robot", "estimate, coloured by class", "ground truth")):
        _text(pencil, left + 38, y - 26 * i, text, 14, INK, "ls")
    x0, y0, x1, y1 = swatches[0]
    pencil.line((x0, (y0 + y1) / 2, x1, (y0 + y1) / 2), fill=PATH_END, width=3 * _SCALE)
    sample = next(iter(colors.values()), INK)
    pencil.rectangle(swatches[1], fill=(*sample, 38), outline=sample, width=round(2.5 * _SCALE))
    pencil.rectangle(swatches[2], fill=TRUTH_FILL, outline=TRUTH_LINE, width=round(1.5 * _SCALE))


def _words(name: str) -> str:
    return {"avg_fp_quality": "false-positive quality"}.get(name, name.removeprefix("avg_").replace("_", " "))


def _text(
    pencil: ImageDraw.ImageDraw,
    x: float,
    y: float,
    text: str,
    size: float,
    color: Color,
    anchor: str,
    *,
    bold: bool = False,
) -> None:
    stroke = size * _SCALE / 40 if bold else 0
    pencil.text(
        (x * _SCALE, y * _SCALE), text, fill=color, font=font(size * _SCALE), anchor=anchor, stroke_width=stroke
    )


def _scaled(box: Rectangle) -> Rectangle:
    return Rectangle(*(value * _SCALE for value in (box.left, box.top, box.right, box.bottom)))


def _corners(box: Rectangle) -> tuple[float, float, float, float]:
    scaled = _scaled(box)
    return (scaled.left, scaled.top, scaled.right, scaled.bottom)
