"""An image for solutions that is made of this machine's own files: Python, what benchbot.api needs, and BenchBot."""

import json
import re
import shutil
import subprocess
import sys
import tarfile
from contextlib import closing
from pathlib import Path

import docker

import benchbot

NAME = "localhost/benchbot/base:latest"
DOCKERFILE = """\
FROM scratch
ADD root.tar /
ENV PATH=/usr/bin
"""
_UNUSED = shutil.ignore_patterns(
    "__pycache__", "test", "tests", "site-packages", "config-*", "idlelib", "ensurepip", "tkinter", "turtledemo",
    "lib2to3", "_tkinter*", "*.a", "f2py", "*.pyi", "include", "distutils",
)  # fmt: skip
_NEEDED = """\
import json, sys
import benchbot.api, benchbot.core.results, jsonschema, numpy
files = {name.split(".")[0]: getattr(module, "__file__", None) for name, module in sys.modules.items()}
print(json.dumps(sorted(name for name, file in files.items() if file and "site-packages" in file)))
"""


def build(url: str, folder: Path) -> None:
    """Build the base image on the engine at `url`, by way of a folder that is made and removed."""
    folder.mkdir()
    with closing(docker.APIClient(base_url=url, timeout=600)) as client:
        # Without rm=True podman keeps what it builds in, mounted.
        events = list(client.build(path=str(write_context(folder)), tag=NAME, rm=True, forcerm=True, decode=True))
    assert not [event for event in events if "error" in event], events
    shutil.rmtree(folder)


def write_context(folder: Path) -> Path:
    """Write the Dockerfile of the base image, and the archive that it adds; return the folder."""
    root = folder / "root"
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    library = Path(sys.base_prefix) / "lib" / version
    packages = _inside(root, library / "site-packages")
    shutil.copytree(library, _inside(root, library), ignore=_UNUSED)
    program = Path(sys.executable).resolve()
    _copy(root, program)
    _link(root / "usr/bin/python", program)
    for name in _needed():
        _install(name, packages)
    shutil.copytree(Path(benchbot.__file__).parent, packages / "benchbot", ignore=_UNUSED)
    for path in _libraries([program, *root.rglob("*.so*")]):
        if not path.is_relative_to(root) and not _inside(root, path).exists():
            _copy(root, path)
    (root / "tmp").mkdir()
    (root / "tmp").chmod(0o1777)
    with tarfile.open(folder / "root.tar", "w") as archive:
        archive.add(root, ".")
    shutil.rmtree(root)
    (folder / "Dockerfile").write_text(DOCKERFILE)
    return folder


def _needed() -> list[str]:
    said = subprocess.run([sys.executable, "-c", _NEEDED], capture_output=True, text=True, check=True).stdout
    names: list[str] = json.loads(said)
    return [name for name in names if name != "benchbot"]


def _install(name: str, packages: Path) -> None:
    for site in (Path(path) for path in sys.path if path.endswith("site-packages")):
        for source in (site / name, site / f"{name}.py", site / f"{name}.libs"):
            if source.is_dir():
                shutil.copytree(source, packages / source.name, ignore=_UNUSED)
            elif source.is_file():
                packages.mkdir(exist_ok=True)
                shutil.copy2(source, packages)


def _libraries(programs: list[Path]) -> list[Path]:
    """Return the shared libraries that programs are linked with, by their absolute names."""
    said = subprocess.run(["ldd", *map(str, programs)], capture_output=True, text=True, check=False).stdout
    return sorted({Path(found) for found in re.findall(r"(/\S+) \(0x", said)})


def _inside(root: Path, path: Path) -> Path:
    return root / path.relative_to("/")


def _copy(root: Path, path: Path) -> None:
    _inside(root, path).parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(path, _inside(root, path))


def _link(link: Path, target: Path) -> None:
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(target)
