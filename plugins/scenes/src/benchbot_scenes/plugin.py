"""The hook implementations of benchbot-scenes."""

from collections.abc import Iterator

from benchbot.plugin import AssetPack, Command, TuiScreen, hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_asset_packs() -> Iterator[AssetPack]:
    """Yield the packs that the user has installed."""
    from benchbot_scenes.packs import folder

    for name, catalogue in folder.installed().items():
        yield AssetPack(name, catalogue)


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield this distribution's commands."""
    yield Command("assets", "benchbot_scenes.packs.command:app", "List packs of 3D models, and install more.")
    yield Command(
        "import-environment",
        "benchbot_scenes.importing.command:import_environment",
        "Make an environment of a glTF, OBJ, PLY, STL or USD file.",
    )
    yield Command(
        "generate-environment",
        "benchbot_scenes.generator.command:generate_environment",
        "Make a new furnished environment from a seed.",
    )
    yield Command(
        "export",
        "benchbot_scenes.exporting.command:export_environment",
        "Write an environment's scene for other simulators.",
        takes_sources=True,
    )
    yield Command("map", "benchbot_scenes.map_command:map_environment", "Occupancy map and picture of an environment.")


@hookimpl
def benchbot_screens() -> Iterator[TuiScreen]:
    """Yield the screen."""
    yield TuiScreen(
        "environments",
        "benchbot_scenes.screen:EnvironmentsScreen",
        "Generate an environment from a seed, or import one from a file.",
        key="V",
    )
