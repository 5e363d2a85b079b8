"""Another environment to make results again in: fresh, with copies of BenchBot and the sample plug-in of its own."""

import shutil
import sys
import sysconfig
import venv
from importlib.metadata import distribution
from pathlib import Path

import benchbot

SAMPLE_PLUGIN = Path(__file__).parents[2] / "sample_plugin"


def fresh_environment(folder: Path, package: Path = Path(benchbot.__file__).parent) -> Path:
    """Make a virtual environment with a copy of BenchBot's package, and return its Python.

    What BenchBot stands on (numpy and so on) is that of this environment, to save a download.
    """
    venv.EnvBuilder(symlinks=True).create(folder)
    site = packages_of(folder)
    without_caches = shutil.ignore_patterns("__pycache__")
    shutil.copytree(package, site / "benchbot", ignore=without_caches)
    metadata = Path(str(distribution("benchbot")._path))  # type: ignore[attr-defined]
    shutil.copytree(metadata, site / metadata.name)
    for part in SAMPLE_PLUGIN.iterdir():
        if part.is_dir():
            shutil.copytree(part, site / part.name, ignore=without_caches)
    (site / "what_it_stands_on.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    return folder / "bin" / "python"


def packages_of(folder: Path) -> Path:
    """Return where the packages of an environment are."""
    return folder / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
