"""Solutions for containers: the folders that images are built from."""

from pathlib import Path

from tests.plugins.containers import base_image

DOCKERFILE = f"""\
FROM {base_image.NAME}
COPY solution.py /solution/
CMD ["python", "/solution/solution.py"]
"""
DOES_WHAT_IT_IS_TOLD = """\
import os
exec(os.environ["args"])
"""
"""Executes its arguments: one image for many solutions."""


def write(folder: Path, code: str = DOES_WHAT_IT_IS_TOLD, dockerfile: str = DOCKERFILE) -> Path:
    """Write a Dockerfile and the solution beside it; return their folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "Dockerfile").write_text(dockerfile)
    (folder / "solution.py").write_text(code)
    return folder
