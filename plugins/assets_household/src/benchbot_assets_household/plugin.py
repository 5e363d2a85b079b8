"""What this distribution offers to BenchBot."""

from collections.abc import Iterator
from pathlib import Path

from benchbot import hookimpl
from benchbot.core.hookspecs import AssetPack


@hookimpl
def benchbot_asset_packs() -> Iterator[AssetPack]:
    """Yield the pack."""
    yield AssetPack("household", Path(__file__).parent / "catalogue.json")
