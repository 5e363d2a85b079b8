"""The plug-in's hook: one asset pack."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import AssetPack, hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_asset_packs() -> Iterator[AssetPack]:
    """Yield the pack."""
    yield AssetPack("household", Path(__file__).parent / "catalogue.json")
