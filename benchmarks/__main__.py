"""Run every benchmark, one after the other: `python -m benchmarks [NAME …] [--json FOLDER]`.

Other options go to the benchmark, if one is named: `python -m benchmarks rays --quick --rounds=2`.
"""

import argparse
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parent


def main() -> int:
    """Run the named benchmarks, or all; return 1 if one of them failed."""
    names = sorted(path.stem.removeprefix("bench_") for path in FOLDER.glob("bench_*.py"))
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", choices=[[], *names], metavar="NAME", help=f"one of: {', '.join(names)}")
    parser.add_argument("--json", type=Path, metavar="FOLDER", help="also write NAME.json into this folder")
    options, others = parser.parse_known_args()
    if others and len(options.names) != 1:
        parser.error(f"name the one benchmark that is to have {' '.join(others)}")
    failed = []
    for name in options.names or names:
        print(f"\n{name}\n{'=' * len(name)}", flush=True)
        command = [sys.executable, "-m", f"benchmarks.bench_{name}", *others]
        if options.json:
            options.json.mkdir(parents=True, exist_ok=True)
            command += ["--json", str(options.json / f"{name}.json")]
        if subprocess.run(command, check=False).returncode != 0:
            failed.append(name)
    if failed:
        print(f"\nfailed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
