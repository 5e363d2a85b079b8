"""`benchbot map`: an environment's occupancy map and a picture from above."""

from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.plugin import BenchbotError


def map_environment(
    environment: Annotated[str, typer.Argument(metavar="ENVIRONMENT", help="As benchbot list prints it: NAME:VARIANT")],
    output: Annotated[
        Path, typer.Option("--output-location", "-o", metavar="FOLDER", help="Where the files go.")
    ] = Path(),
    robot: Annotated[
        str, typer.Option("--robot", metavar="ROBOT", help="Obstacles are what this robot would bump into.")
    ] = "carter",
) -> None:
    """Write an environment's occupancy map for ROS's map_server (PNG and YAML) and a picture from above (PNG)."""
    from benchbot.plugin import Catalog, Pose, cache_dir
    from benchbot.plugin import load_plugins as load
    from benchbot_scenes.free_space import free_space
    from benchbot_scenes.generator.files import write_maps
    from benchbot_scenes.gltf import load_scene
    from benchbot_scenes.scene_file import scene_file
    from benchbot_scenes.visibility import observer

    catalog = Catalog(load())
    sees = observer(catalog.get("robots", robot).data)
    for declared in catalog.environments(environment):
        if "map_path" not in declared.data or declared.data["type"] == "real":
            raise BenchbotError(
                f"'{declared.name}' has no scene.",
                f"It is of type {declared.data['type']}: there is no file to look at from above.",
                "Choose an environment of type sim_taichi.",
            )
        scene = scene_file(declared.path.parent / declared.data["map_path"], cache_dir())
        geometry = load_scene(scene)
        x, y, z = Pose.from_wxyz_xyz(declared.data["start_pose"]).translation_xyz
        space = free_space(geometry, sees.z_min_m, sees.z_max_m, z)
        try:
            for path in write_maps(output / declared.name.replace(":", "_"), geometry, space, (x, y)):
                console.data(str(path))
        except OSError as error:
            raise BenchbotError(
                f"The map cannot be written to {output}.",
                f"{error.filename}: {error.strerror}",
                "Name another folder: --output-location FOLDER",
            ) from error
