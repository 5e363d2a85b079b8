"""`python -m tools.household [ID …] [--folder DIR]`: write the models and their catalogue."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import benchbot_assets_household


def main() -> int:
    """Make the named models again, or all of them, and write the catalogue; by default into the package itself."""
    try:
        from tools.household.catalogue import items
        from tools.household.pack import own_entries, write_catalogue, write_models
    except ModuleNotFoundError as error:
        sys.stderr.write(
            f"Models cannot be generated here: the library {error.name} is not installed.\n"
            'Install what generating needs: pip install "benchbot-assets-household[generate]"\n'
        )
        return 2
    everything = {item.id: item for item in items()}
    parser = argparse.ArgumentParser(prog="python -m tools.household", description=main.__doc__)
    parser.add_argument("id", nargs="*", choices=[*everything, []], metavar="ID")
    parser.add_argument("--folder", type=Path, default=Path(benchbot_assets_household.__file__).parent)
    arguments = parser.parse_args()
    chosen = [everything[name] for name in arguments.id] or list(everything.values())
    written = write_models(chosen, arguments.folder)
    made = {entry["id"] for entry in written}
    kept = own_entries(arguments.folder, set(everything) - made)
    write_catalogue([*kept, *written], arguments.folder)
    for entry in written:
        size = (arguments.folder / entry["file"]).stat().st_size / 1000
        sys.stderr.write(f"{entry['id']}: {entry['size_m']} m, {entry['triangles']} triangles, {size:.0f} kB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
