"""What `benchbot doctor` looks at: one function per question, each yielding what it found and how to mend it."""

from collections.abc import Iterator

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Finding


def diagnose(catalog: Catalog, *, warm: bool) -> Iterator[Finding]:
    """Yield everything that is worth knowing of this installation and this machine; `warm` fills the caches, too."""
    from benchbot.plugins.doctor import containers, gpu, installation, isolation, machine, plugged, ros

    yield from installation.python()
    yield from installation.commands()
    yield from installation.versions()
    yield from plugged.installed(catalog.plugins)
    yield from plugged.names(catalog)
    yield from plugged.declarations(catalog)
    yield from plugged.simulators(catalog.plugins, warm=warm)
    yield from gpu.gpu()
    yield from ros.ros()
    yield from containers.containers()
    yield from isolation.sandbox()
    yield from machine.processors()
    yield from machine.folders()
    yield from machine.caches()
    yield from machine.shared_memory()
    yield from machine.clock()
    yield from machine.default_port()
