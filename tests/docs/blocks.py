"""The fenced blocks of a page, and what their marks say: who runs them, or why nobody does."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
_FENCE = re.compile(
    r"(?:^[ \t]*<!-- (?P<mark>[^\n]+?) -->\n+)?"
    r"^(?P<indent>[ \t]*)(?P<fence>```+)(?P<info>[^\n`]*)\n(?P<text>.*?)^(?P=indent)(?P=fence)[ \t]*$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Block:
    """A fenced block: its language and what else stands beside it, its text, and the comment before it."""

    info: str
    text: str
    mark: str
    line: int

    @property
    def language(self) -> str:
        """The first word after the fence."""
        return self.info.split()[0] if self.info.split() else ""

    @property
    def run_by(self) -> str:
        """The test that runs it, as a path in the repository, or nothing."""
        return self.mark.removeprefix("run by ") if self.mark.startswith("run by ") else ""

    @property
    def excuse(self) -> str:
        """Why it is not run, not compiled or not read, or nothing."""
        found = re.fullmatch(r"not (?:run|compiled|read): (.+)", self.mark)
        return found[1] if found else ""


def blocks(page: str) -> list[Block]:
    """Return the fenced blocks of a page, in order."""
    found = []
    for match in _FENCE.finditer(page):
        indent = match["indent"]
        text = re.sub(rf"^{indent}", "", match["text"], flags=re.MULTILINE) if indent else match["text"]
        line = page.count("\n", 0, match.start("fence")) + 1
        found.append(Block(match["info"].strip(), text, match["mark"] or "", line))
    return found


def pages() -> list[Path]:
    """Return every page that people read: those of docs, and the READMEs."""
    written = [path for path in sorted(ROOT.glob("docs/**/*.md")) if path.parent.name != "reference"]
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *written, *sorted(ROOT.glob("plugins/*/README.md"))]
