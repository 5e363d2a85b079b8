"""Builds the documentation's site: `python -m docs.tools.site FOLDER`. Broken links and anchors are errors."""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from docs.tools import html_check
from docs.tools.stage import BrokenLinksError, stage

ROOT = Path(__file__).parents[2]


def build(folder: Path) -> list[str]:
    """Build the site into `folder/site`, from pages that are gathered in `folder/pages`; both are made anew.

    Returns what is wrong with it: broken links and anchors, and whatever it would load from other hosts.
    """
    for name in ("pages", "site", ".cache"):
        shutil.rmtree(folder / name, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    try:
        stage(ROOT, folder / "pages")
    except BrokenLinksError as error:
        return str(error).splitlines()
    settings = folder / "zensical.toml"
    shutil.copyfile(ROOT / "docs" / "zensical.toml", settings)
    built = subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--strict", "--config-file", str(settings)],
        capture_output=True,
        text=True,
        check=False,
    )
    if built.returncode:
        return (built.stdout + built.stderr).splitlines()
    return html_check.problems(folder / "site")


def main() -> None:
    """Build, and say what is wrong; exit with 1 if anything is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder.resolve()
    problems = build(folder)
    sys.stderr.write("".join(f"{problem}\n" for problem in problems))
    if problems:
        sys.exit(1)
    sys.stdout.write(f"{folder / 'site' / 'index.html'}\n")
    sys.stderr.write(f"With search: python -m http.server --directory {folder / 'site'}\n")


if __name__ == "__main__":
    main()
