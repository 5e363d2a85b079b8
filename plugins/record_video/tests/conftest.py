"""The sessions that are recorded run on the sample plug-in, which needs no renderer."""

from tests import conftest

assert conftest.SAMPLE_PLUGIN
