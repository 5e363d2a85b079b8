"""Pictures of what a submission found in a visible place: made with its score, and shown beside its row.

A map beside the truth (`benchbot draw`), and some of the recorded frames where the phase records them (`record:
[frames]`). They lie in the challenge's folder by the SHA-256 of their bytes, `MOST_BYTES` at most of a submission.
"""

import hashlib
import io
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from PIL import Image

from benchbot.core import atomic
from benchbot.evaluation.frames import frame_folders, numbered_frames
from benchbot.plugins.challenge.document import Challenge, Phase, place_of
from benchbot.plugins.drawing.scene_maps import chosen

DRAW = (sys.executable, "-P", "-m", "benchbot", "draw")
DRAW_S = 30.0
"""So long may a map take: shorter than what is left of a lease."""
MOST_BYTES = 120_000
MAP_PX, FRAME_PX, FRAMES, COLORS, QUALITY = 1040, 360, 3, 64, 72
SUFFIXES = {"map": ".png", "frame": ".jpg"}
Record = dict[str, Any]


def make(challenge: Challenge, phase: Phase, batch: Path, document: Mapping[str, Any]) -> list[Record]:
    """Make the pictures of a scored batch's best episode in a place that everybody may see.

    `document` is its scores document, whose rows name their results. Returns `{file, kind, environment, width, height}`
    of each picture: none in a hidden phase, nor of a place that a hidden phase has as well. What cannot be drawn, or is
    more than `MOST_BYTES` with those before it, is left out.
    """
    row = None if phase.hidden else _best(challenge, document)
    if row is None:
        return []
    result, made, left = Path(row["source"]), [], MOST_BYTES
    for kind, image in _drawn(challenge, phase, result, batch.parent / "batch.log"):
        content = _encoded(kind, image)
        if len(content) > left:
            continue
        left -= len(content)
        name = f"{hashlib.sha256(content).hexdigest()}{SUFFIXES[kind]}"
        atomic.write(challenge.pictures / name, content)
        size = {"width": image.width, "height": image.height}
        made.append({"file": name, "kind": kind, "environment": row["environment"], **size})
    return made


def shown(challenge: Challenge, phase: Phase, document: Mapping[str, Any]) -> tuple[Record, ...]:
    """Return those pictures of a kept scores document that everybody may see, as the challenge is declared now."""
    made = () if phase.hidden else document.get("pictures", ())
    hidden = challenge.hidden_places if made else frozenset()
    return tuple(
        item
        for item in made
        if place_of(item["environment"]) not in hidden and (challenge.pictures / item["file"]).is_file()
    )


def _best(challenge: Challenge, document: Mapping[str, Any]) -> Mapping[str, Any] | None:
    headline = document["method"]["headline"]
    reading = document["method"].get("scores", {}).get(headline, {})
    sign = -1 if reading.get("lower_is_better") else 1
    hidden = challenge.hidden_places
    visible = [
        row
        for row in document["rows"]
        if place_of(row["environment"]) not in hidden and Path(row["source"] or "").is_file()
    ]
    return max(visible, key=lambda row: sign * row["scores"].get(headline, 0.0), default=None)


def _drawn(challenge: Challenge, phase: Phase, result: Path, log: Path) -> Iterator[tuple[str, Image.Image]]:
    """Yield the map, then frames; the map is drawn by a process, which a result that is hard to draw cannot keep."""
    addons = [word for name in phase.addons for word in ("--addons", str(challenge.folder / name))]
    with tempfile.TemporaryDirectory() as folder, log.open("ab") as said:
        drawn = Path(folder) / "map.png"
        words = [*DRAW, str(result), *addons, "--width", "88", "--output-location", str(drawn)]
        with suppress(subprocess.TimeoutExpired):
            subprocess.run(words, stdin=subprocess.DEVNULL, stdout=said, stderr=said, timeout=DRAW_S, check=False)
        if drawn.is_file():
            yield from _read("map", drawn, MAP_PX)
    found = next((frames for folder in frame_folders(result) if (frames := numbered_frames(folder))), {})
    for path in chosen(found, FRAMES).values():
        yield from _read("frame", path, FRAME_PX)


def _read(kind: str, path: Path, most_px: int) -> Iterator[tuple[str, Image.Image]]:
    """Yield a picture, at most so wide; nothing of a file that is none, such as one that was not written to its end."""
    try:
        image = Image.open(path).convert("RGB")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return
    if image.width > most_px:
        size = (most_px, max(round(image.height * most_px / image.width), 1))
        image = image.resize(size, Image.Resampling.LANCZOS)
    yield kind, image


def _encoded(kind: str, image: Image.Image) -> bytes:
    content = io.BytesIO()
    if kind == "map":
        image.quantize(COLORS, dither=Image.Dither.NONE).save(content, "PNG", optimize=True)
    else:
        image.save(content, "JPEG", quality=QUALITY, optimize=True)
    return content.getvalue()
