"""The back end and the documents of the tests of submissions."""

import json
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema

SELECTION = ["--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1"]


def read(path: Path) -> dict[str, Any]:
    document = json.loads(path.read_text())
    schema.check(document, "result", path)
    assert isinstance(document, dict)
    return document
