"""What this distribution offers to BenchBot."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import AssetPack, hookimpl


@hookimpl
def benchbot_asset_packs() -> Iterator[AssetPack]:
    """Yield the pack."""
    yield AssetPack("household", Path(__file__).parent / "catalogue.json")
