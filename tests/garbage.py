"""Python's search for garbage, in processes that hold thousands of tests, and run commands that mean to end them."""

import gc
from collections.abc import Generator, Iterator
from contextlib import contextmanager

import pytest


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Search neither while tests are found, nor ever again among what was: that took a third of many tests' time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.collect()
        gc.freeze()


@contextmanager
def searched_as_before() -> Iterator[None]:
    """Run commands in this process: they arrange the search as suits one that ends with them, which is undone."""
    thresholds = gc.get_threshold()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gc, "freeze", lambda: None)
        try:
            yield
        finally:
            gc.set_threshold(*thresholds)
