"""Student's t distribution: its quantiles at whole degrees of freedom, without SciPy, which BenchBot does not need."""

import math


def probability(t: float, degrees: int) -> float:
    """Return the probability of a value up to `t` (Abramowitz and Stegun 1964, 26.7.3 and 26.7.4)."""
    angle = math.atan2(t, math.sqrt(degrees))
    sine, cosine = math.sin(angle), math.cos(angle)
    odd = degrees % 2
    term = cosine if odd else 1.0
    total = 0.0
    for power in range(1 + odd, degrees, 2):
        total += term
        term *= cosine**2 * power / (power + 1)
    within = 2 / math.pi * (angle + sine * total) if odd else sine * total
    return 0.5 + within / 2


def quantile(p: float, degrees: int) -> float:
    """Return the value below which a share `p` of the distribution lies, 0 < p < 1, for one degree of freedom or more.

    Correct to about ten digits; by bisection, which is quick enough for a few calls.
    """
    if p < 0.5:
        return -quantile(1 - p, degrees)
    low, high = 0.0, 1.0
    while probability(high, degrees) < p:
        low, high = high, 2 * high
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if probability(middle, degrees) < p else (low, middle)
    return (low + high) / 2
