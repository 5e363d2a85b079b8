"""The sessions that are recorded run on the sample plug-in, which needs no renderer."""

import os

from tests import conftest

assert conftest.SAMPLE_PLUGIN

# As the plug-in sets it before it imports Rerun, which tests that read with Rerun do before: see there.
os.environ.setdefault("RUST_LOG", "off")
