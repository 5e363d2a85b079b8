"""Generated projects, built to real wheels and unpacked as an installer would."""

import os
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

from benchbot.plugins.authoring.scaffold.render import KINDS, ORIGINS, create

ALL = (*KINDS, *(f"{kind}-{origin}" for kind, origins in ORIGINS.items() for origin in origins))
SAMPLE = Path(__file__).parents[3] / "sample_plugin"


@dataclass(frozen=True)
class Projects:
    """One project of each kind, and the folder into which their wheels are installed."""

    folder: Path
    site: Path

    def path(self, kind: str) -> Path:
        """Return the folder of a project."""
        return self.folder / name_of(kind)

    def run(self, *command: str, cwd: Path | None = None, plugins: str = "") -> "subprocess.CompletedProcess[str]":
        """Run Python with the projects installed, beside the sample plug-in and those named, in a home of its own."""
        home = self.folder.parent / "home"
        named = [name_of(kind) for kind in ALL] + ["benchbot-sample", *plugins.split()]
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("BENCHBOT_", "PYTEST_"))}
        variables = {
            "PYTHONPATH": os.pathsep.join([str(self.site), str(SAMPLE)]),
            "BENCHBOT_PLUGINS": ",".join(named),
            "BENCHBOT_STATE_DIR": str(home / "state"),
            "BENCHBOT_CACHE_DIR": str(home / "cache"),
            "MYPY_CACHE_DIR": str(home / "mypy"),
            "COLUMNS": "200",
        }
        return subprocess.run(
            [sys.executable, *command],
            cwd=cwd or self.folder,
            env={**kept, **variables},
            capture_output=True,
            text=True,
            check=False,
        )


def name_of(kind: str) -> str:
    return f"acme-{kind}"


def make(folder: Path) -> Projects:
    """Make and build one project of each kind, and of each that starts from something."""
    projects = Projects(folder / "projects", folder / "site")
    for kind in ALL:
        project = create(kind, name_of(kind), projects.folder)
        built = projects.run("-m", "hatchling", "build", "-t", "wheel", cwd=project)
        assert built.returncode == 0, built.stderr
        (wheel,) = (project / "dist").glob("*.whl")
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(projects.site)
    return projects
