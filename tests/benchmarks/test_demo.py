"""The times of a process's spans, as the benchmark of the demo takes them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.bench_demo import REST, ROOT, START, Demo, rows_of, table

MODULE = """
def outer():
    return [inner() for _ in range(3)]

def inner():
    return sum(range(1000))

class Thing:
    @classmethod
    def make(cls):
        return cls()
"""


def test_a_process_tells_its_spans_and_they_sum_up_to_it(tmp_path: Path) -> None:
    (tmp_path / "measured.py").write_text(MODULE)
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(ROOT / "benchmarks" / "spans"), str(tmp_path)]),
        "BENCHMARK_SPANS": json.dumps({"measured": {"outer": "outside", "inner": "inside", "Thing.make": "making"}}),
        "BENCHMARK_SPANS_FOLDER": str(tmp_path),
    }
    code = "import measured; measured.outer(); assert type(measured.Thing.make()) is measured.Thing"
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)

    (path,) = tmp_path.glob("*.json")
    document = json.loads(path.read_text())
    rows = rows_of(document)
    counts = {row.span: row.count for row in rows}
    assert (counts["outside"], counts["inside"], counts["making"], counts[START]) == (1, 3, 1, 1)
    assert counts["imports"] > 0
    assert sum(row.processor_s for row in rows) == pytest.approx(document["processor_s"])
    shown = table([Demo(1.0, document["processor_s"], tuple(rows), "")])
    assert shown.splitlines()[-1].split()[:2] == ["the", "demo"]
    assert {row.process for row in rows} == {"others"}
    assert REST in counts
