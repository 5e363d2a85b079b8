"""`python -m tools.mutation MODULE TESTS… [--sample N] [--seed N]`: show the changes of a module that no test notices.

Cosmic Ray makes the mutants: a sign turned, a bound moved, an `and` for an `or`. A sample of them, one for each place
and kind of change, is tried in a copy of the checkout. A survivor is equivalent to the code, or a test is missing.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import MutationSpec, TestOutcome, WorkerOutcome, WorkResult

CONFIG = """\
[cosmic-ray]
module-path = "{module}"
timeout = 120.0
excluded-modules = []
test-command = "{python} -m pytest -n 0 -x -q -p no:randomly -p no:cacheprovider {tests}"
[cosmic-ray.distributor]
name = "local"
"""
NOT_COPIED = shutil.ignore_patterns(".git", ".venv", "__pycache__", ".*_cache", ".hypothesis", "build", "demo", "dist")


def main() -> int:
    """Print how many of the mutants the tests kill, and the others as differences."""
    parser = argparse.ArgumentParser(prog="python -m tools.mutation", description=__doc__)
    parser.add_argument("module", help="file to change, such as benchbot/core/motion.py")
    parser.add_argument("tests", nargs="+", help="files of tests that should notice, its own first")
    parser.add_argument("--sample", type=int, default=100, help="mutants to try at most (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sample (%(default)s)")
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        tree, config, session = Path(folder, "tree"), Path(folder, "config.toml"), Path(folder, "session.sqlite")
        shutil.copytree(Path.cwd(), tree, ignore=NOT_COPIED)
        config.write_text(
            CONFIG.format(module=options.module, python=sys.executable, tests=" ".join(options.tests)), encoding="utf-8"
        )
        _cosmic_ray(tree, "baseline", config)
        _cosmic_ray(tree, "init", config, session)
        with use_db(session) as mutants:
            _leave_out_all_but(mutants, _annotated(tree / options.module), options.sample, options.seed)
            _cosmic_ray(tree, "exec", config, session)
            results = [result for _, result in mutants.completed_work_items if result.test_outcome is not None]
    survivors = [result for result in results if result.test_outcome is TestOutcome.SURVIVED]
    changed = (line for survivor in survivors for line in survivor.diff.splitlines() if not line.startswith("--- mut"))
    killed = len(results) - len(survivors)
    print("\n".join([*changed, f"{options.module}: {killed} of {len(results)} mutants killed"]))
    return 0


def _cosmic_ray(tree: Path, command: str, *paths: Path) -> None:
    # The processes that tests start import the copy, too, and hypothesis looks at the same examples for each mutant.
    variables = {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1", "CI": "1"}
    program = Path(sys.executable).with_name("cosmic-ray")
    subprocess.run([program, "--verbosity", "ERROR", command, *paths], cwd=tree, env=variables, check=True)


def _leave_out_all_but(mutants: WorkDB, annotated: set[tuple[int, int]], count: int, seed: int) -> None:
    """Mark the mutants as skipped that are not in the sample; those of one place and kind are alike."""
    items = sorted(mutants.work_items, key=lambda item: _order(item.mutations[0]))
    random.Random(seed).shuffle(items)  # noqa: S311
    sample = {_place(item.mutations[0]): item.job_id for item in items if item.mutations[0].start_pos not in annotated}
    kept = set(list(sample.values())[:count])
    skipped = WorkResult(worker_outcome=WorkerOutcome.SKIPPED)
    mutants.set_multiple_results([item.job_id for item in items if item.job_id not in kept], skipped)


def _order(mutation: MutationSpec) -> tuple[str, int]:
    return mutation.operator_name, mutation.occurrence


def _place(mutation: MutationSpec) -> tuple[Sequence[int], str]:
    return mutation.start_pos, mutation.operator_name.partition("_")[0]


def _annotated(module: Path) -> set[tuple[int, int]]:
    """Return the lines and columns of operators in annotations: `int | None` is no code to be tested."""
    nodes = list(ast.walk(ast.parse(module.read_text(encoding="utf-8"))))
    annotations = [getattr(node, name, None) for node in nodes for name in ("annotation", "returns")]
    return {
        (line, column)
        for node in annotations
        if isinstance(node, ast.expr) and node.end_lineno is not None and node.end_col_offset is not None
        for line in range(node.lineno, node.end_lineno + 1)
        for column in range(node.col_offset, node.end_col_offset)
    }


if __name__ == "__main__":
    sys.exit(main())
