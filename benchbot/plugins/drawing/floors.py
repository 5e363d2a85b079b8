"""What stands on the floor of a scene as a picture for a map."""

import base64
import io
from dataclasses import dataclass

import numpy as np
from PIL import Image

from benchbot.core.declarations.catalog import Declaration
from benchbot.plugins.drawing.occupancy import occupancy_of

_INK = (128, 128, 122, 190)


@dataclass(frozen=True)
class Floor:
    """Where something stands: `picture` (a PNG) covers `low` to `high` in the map frame, metres, x right and y up."""

    low: tuple[float, float]
    high: tuple[float, float]
    picture: bytes

    @property
    def data_uri(self) -> str:
        """The picture as a page holds it."""
        return "data:image/png;base64," + base64.b64encode(self.picture).decode()


def floor_of(environment: Declaration | None) -> Floor | None:
    """Return the floor of an environment, None when no map of it can be read."""
    found = occupancy_of(environment)
    if found is None:
        return None
    picture = Image.fromarray(found.occupied.astype(np.uint8))
    picture.putpalette([0, 0, 0, 0, *_INK], "RGBA")
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    return Floor(found.low, found.high, buffer.getvalue())
