"""The import name of BenchBot v2: an alias of `benchbot.api.api_callbacks`."""

from benchbot.api.api_callbacks import convert_to_rgb, decode_color_image

__all__ = ["convert_to_rgb", "decode_color_image"]
