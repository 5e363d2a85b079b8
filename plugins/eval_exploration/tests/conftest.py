"""Runs take place in the sample plug-in's arena, which needs no renderer."""

from tests import conftest

assert conftest.SAMPLE_PLUGIN
