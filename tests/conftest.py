"""The sample plug-in is installed for every test and for every process that a test starts."""

import os
import sys
from pathlib import Path

SAMPLE_PLUGIN = str(Path(__file__).parent / "sample_plugin")

sys.path.insert(0, SAMPLE_PLUGIN)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [SAMPLE_PLUGIN, os.environ.get("PYTHONPATH")]))
