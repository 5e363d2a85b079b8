"""An animated GIF that can be shown after every frame, whatever happens to the process that writes it.

Format: https://www.w3.org/Graphics/GIF/spec-gif89a.txt. Pillow writes a file with all frames at once; here each is
encoded by itself, and its image appended, over the byte that ends the file.
"""

import io
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchbot_record_video.film import FRAMES_PER_S

WIDTH_PX = 480
COLOURS = 256
_TRAILER = b";"
_FOREVER = b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"


class GifFilm:
    """A GIF written to a path frame by frame. Raises OSError if it cannot be written; the file is then as before."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb", buffering=0)
        self._size = 0

    def add(self, image: NDArray[np.uint8]) -> None:
        """Append a frame, made smaller where it is wider than 480 pixels."""
        picture = Image.fromarray(image)
        if picture.width > WIDTH_PX:
            size = (WIDTH_PX, round(picture.height * WIDTH_PX / picture.width))
            picture = picture.resize(size, Image.Resampling.BOX)
        encoded = io.BytesIO()
        picture.quantize(COLOURS, Image.Quantize.FASTOCTREE).save(encoded, "GIF", optimize=False)
        start, frame = _taken_apart(encoded.getvalue())
        self._write(frame if self._size else start + frame)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, data: bytes) -> None:
        left = memoryview(data + _TRAILER)
        try:
            self._file.seek(self._size)
            while left:
                left = left[self._file.write(left) :]
        except OSError:
            self._file.truncate(self._size)
            raise
        self._size += len(data)


def _taken_apart(gif: bytes) -> tuple[bytes, bytes]:
    """Return how a film begins, and the frame that is in a GIF, with the colours of its own."""
    screen, flags = gif[6:13], gif[10]
    colours = 3 * 2 ** (flags % 8 + 1)
    table = gif[13 : 13 + colours]
    place = 13 + colours
    while gif[place] != ord(","):  # what comes before the image says nothing that is not said anew
        place += 2
        while gif[place]:
            place += 1 + gif[place]
        place += 1
    descriptor = gif[place : place + 9] + bytes([0x80 | flags % 8])
    pixels = gif[place + 10 : gif.rindex(_TRAILER)]
    start = b"GIF89a" + screen[:4] + b"\x70\x00\x00" + _FOREVER
    shown = b"\x21\xf9\x04\x04" + struct.pack("<H", round(100 / FRAMES_PER_S)) + b"\x00\x00"
    return start, shown + descriptor + table + pixels
