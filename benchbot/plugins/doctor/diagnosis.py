"""The checks of `benchbot doctor`: functions that return or yield findings, with the fix where something is wrong."""

from collections.abc import Iterator

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Finding


def diagnose(catalog: Catalog, *, warm: bool) -> Iterator[Finding]:
    """Yield everything that is worth knowing of this installation and this machine; `warm` fills the caches, too."""
    from benchbot.plugins.doctor import installation, isolation, machine, plugins

    yield installation.python()
    yield installation.commands()
    yield from installation.versions()
    yield from plugins.installed(catalog.plugins)
    yield from plugins.names(catalog)
    yield from plugins.declarations(catalog)
    yield from plugins.simulators(catalog.plugins, warm=warm)
    yield machine.gpu()
    yield from installation.ros()
    yield isolation.containers()
    yield from isolation.sandbox()
    yield machine.processors()
    yield from machine.folders()
    yield from machine.caches()
    yield from machine.shared_memory()
    yield machine.clock()
    yield machine.default_port()
