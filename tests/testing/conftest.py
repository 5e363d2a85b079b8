from tests.core.conftest import plugin_factory

__all__ = ["plugin_factory"]
