"""Writes the reference anew: `make reference`."""

from pathlib import Path

from docs.tools.reference import api, channels, commands, exit_codes, hooks, mapping, schemas

FOLDER = Path(__file__).parents[2] / "reference"
PAGES = {
    "api.md": api.page,
    "mapping.md": mapping.page,
    "commands.md": commands.page,
    "hooks.md": hooks.page,
    "channels.md": channels.page,
    "declarations.md": schemas.page,
    "exit-codes.md": exit_codes.page,
}
"""File below docs/reference to what makes it."""


def main() -> None:
    """Write each page that the code determines."""
    FOLDER.mkdir(exist_ok=True)
    for name, page in PAGES.items():
        (FOLDER / name).write_text(page(), "utf-8")


if __name__ == "__main__":
    main()
