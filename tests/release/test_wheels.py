import zipfile
from pathlib import Path

import pytest

from release.wheels import lacking


def wheel(folder: Path, name: str, platform: str, requires: str = "") -> None:
    """Make a wheel that holds nothing but its metadata."""
    about = f"{name}-1.0.dist-info"
    needed = f"Requires-Dist: {requires}\n" if requires else ""
    with zipfile.ZipFile(folder / f"{name}-1.0-py3-none-{platform}.whl", "w") as file:
        file.writestr(f"{about}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n{needed}")
        file.writestr(f"{about}/WHEEL", f"Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-{platform}\n")
        file.writestr(f"{about}/RECORD", "")


@pytest.mark.parametrize(
    ("there", "sought", "named"),
    [
        ("any", "aarch64-apple-darwin", ""),
        ("macosx_11_0_arm64", "aarch64-apple-darwin", ""),
        ("manylinux_2_28_x86_64", "aarch64-manylinux_2_28", "renderer"),
    ],
)
def test_what_has_no_wheel_for_another_machine_is_named(tmp_path: Path, there: str, sought: str, named: str) -> None:
    wheel(tmp_path, "renderer", there)
    wheel(tmp_path, "simulator", "any", requires="renderer>=1.0")

    why = lacking("simulator", sought, "3.11", ["--no-index", "--find-links", str(tmp_path)])

    assert bool(why) == bool(named)
    assert named in why
