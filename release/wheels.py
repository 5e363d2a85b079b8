"""`python -m release.wheels`: whether all that is needed has wheels for machines that are not here.

Run it after `python -m release`, whose wheels it looks for in dist. Nothing is downloaded but metadata.
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from release.environments import PYTHONS
from release.projects import ROOT

PLATFORMS = {"macOS on Apple silicon": "aarch64-apple-darwin", "Linux on Arm": "aarch64-manylinux_2_28"}
EXTRAS = ("full", "gym", "mcap", "ray", "replay", "rerun", "ros2", "slurm", "video", "viz", "web")
KNOWN = {
    ("macOS on Apple silicon", "ros2"): "ROS 2 has wheels for Linux on x86-64 only",
    ("Linux on Arm", "ros2"): "ROS 2 has wheels for Linux on x86-64 only",
}
"""What is known to be lacking, as docs/releasing.md says."""


def lacking(requirement: str, platform: str, python: str, words: Sequence[str] = ()) -> str:
    """Return why a requirement cannot be met with wheels, in uv's words; empty when it can."""
    uv = shutil.which("uv", path=Path(sys.executable).parent)
    if uv is None:
        sys.exit("uv is not in this environment: make install-test")
    where = ["--python-platform", platform, "--python-version", python]
    command = [uv, "pip", "compile", "--quiet", "--only-binary", ":all:", *where, *words, "-"]
    done = subprocess.run(command, input=requirement, capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else re.sub(r"\s+", " ", done.stderr).strip()


def main() -> int:
    """Print each platform, Python and extra; return 1 when something lacks that is not known to."""
    surprises = 0
    for name, platform in PLATFORMS.items():
        for extra in EXTRAS:
            for python in PYTHONS:
                why = lacking(f"benchbot[{extra}]", platform, python, ["--find-links", str(ROOT / "dist")])
                known = KNOWN.get((name, extra), "")
                surprises += bool(why) and not known
                print(f"{name}, Python {python}, {extra}: {f'lacking: {known or why}' if why else 'ok'}", flush=True)
    return 1 if surprises else 0


if __name__ == "__main__":
    sys.exit(main())
