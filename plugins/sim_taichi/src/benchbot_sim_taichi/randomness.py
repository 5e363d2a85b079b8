"""Random numbers of a sensor at an instant: they depend on nothing else, such as what was sensed before or beside."""

import numpy as np

_SEED_BITS = (1 << 64) - 1


def at_instant(seed: int, sensor: str, instant: int) -> np.random.Generator:
    """Return the generator of a sensor's noise `instant` motions after the scene was loaded with `seed`.

    Philox counts (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", 2011), so that any instant is at hand
    without those before it.
    """
    key = np.random.SeedSequence([seed & _SEED_BITS, instant, *sensor.encode()])
    return np.random.Generator(np.random.Philox(key))
