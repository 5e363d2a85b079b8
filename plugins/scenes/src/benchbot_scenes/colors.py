"""Colours as people write them, for renderers that count light."""


def linear_color(code: str) -> list[float]:
    """Linear sRGB in 0–1 of a web colour such as "#c8a27a" (IEC 61966-2-1)."""
    values = [int(code[start : start + 2], 16) / 255.0 for start in (1, 3, 5)]
    return [round(value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4, 6) for value in values]
