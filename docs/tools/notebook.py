"""A notebook as a page of the site: its words as they are, its cells as code."""

import json
from pathlib import Path


def as_markdown(path: Path) -> str:
    """Return a notebook (nbformat 4) as Markdown, without outputs."""
    cells = json.loads(path.read_text("utf-8"))["cells"]
    return "\n\n".join(_cell(cell["cell_type"], "".join(cell["source"])) for cell in cells) + "\n"


def _cell(kind: str, source: str) -> str:
    if kind == "markdown":
        return source
    if all(line.startswith("!") for line in source.splitlines()):
        commands = "\n".join(line[1:] for line in source.splitlines())
        return f"```bash\n{commands}\n```"
    return f"```python\n{source}\n```"
