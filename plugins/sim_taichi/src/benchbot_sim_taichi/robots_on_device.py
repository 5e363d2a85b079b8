"""Many robots whose actions run in one launch, where their pictures are taken."""

import math
from collections.abc import Sequence
from typing import Any, Protocol, cast

import numpy as np
import numpy.typing as npt

from benchbot.plugin import Scene
from benchbot.simulation import ActionNumbers, KinematicRobots
from benchbot_scenes.obstacle_map import EdgeGrid
from benchbot_sim_taichi import _ti

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

STATES = (
    "x",
    "y",
    "yaw_rad",
    "linear_mps",
    "angular_radps",
    "linear_mps2",
    "angular_radps2",
    "clock_s",
    "known_x",
    "known_y",
    "known_clearance_m",
)
"""The first rows of the table of states, in the order of `kernels.motion`; ticks and contact follow."""


class _Obstacles(Protocol):
    """What robots bump into, as of `simulator`'s worlds."""

    revision: int

    def edge_grid(self) -> EdgeGrid: ...


class TracedRobots(KinematicRobots):
    """`KinematicRobots` whose actions are executed by a kernel, or by arrays as there where their odometry drifts."""

    def __init__(self, simulator: Any, count: int) -> None:
        super().__init__(simulator, count)
        limits, radius_m = self._robot.limits, self._robot.footprint.radius_m
        self._values = ActionNumbers.of(simulator.config, limits, radius_m, simulator.control_period_s)
        self._table = np.zeros((len(STATES) + 2, count))
        for row, name in enumerate(STATES):
            setattr(self._motion.states, name, self._table[row])
        self._maps: _Maps | None = None

    def execute(self, robots: Indices, straight: npt.NDArray[np.bool_], arguments: Floats) -> npt.NDArray[np.intp]:
        """As of `KinematicRobots`."""
        if self._noisy or not len(robots):
            return super().execute(robots, straight, arguments)
        _ti.start(self._simulator.world.device.kind, self._simulator.spec.cache_dir or _ti.default_cache_dir())
        from benchbot_sim_taichi.kernels import motion as kernels

        self._notice_changes(robots)
        revisions = tuple(world.revision for world in self._worlds)
        if self._maps is None or self._maps.revisions != revisions:
            self._maps = _Maps(cast(Sequence[_Obstacles], self._worlds), revisions, self._values)
        states, table, maps = self._motion.states, self._table, self._maps
        table[len(STATES)], table[len(STATES) + 1] = states.instant, states.collided
        angles_rad = arguments * (math.pi / 180)
        given = (robots.astype(np.int32), straight.astype(np.int32), arguments, angles_rad)
        there, outcomes = _ti.upload(table), _ti.upload(np.zeros(len(robots), np.int32))
        with _ti.exact_arithmetic():
            kernels.execute(
                *(_ti.upload(each) for each in given),
                there.reshape(-1) if isinstance(there, np.ndarray) else there,
                _ti.upload(self._world_of.astype(np.int32)),
                *maps.arrays,
                outcomes,
                len(robots),
                table.shape[1],
                int(self._simulator.config.stops_before_contact),
            )
        if there is not table:
            table[:] = _ti.download(there).reshape(table.shape)
        states.instant[:], states.collided[:] = table[len(STATES)], table[len(STATES) + 1] != 0
        return np.array([self.outcomes.index(name) for name in kernels.OUTCOMES])[_ti.download(outcomes)]


class _Maps:
    """The obstacles of some worlds, as `kernels.motion` reads them."""

    def __init__(self, worlds: Sequence[_Obstacles], revisions: tuple[int, ...], values: ActionNumbers) -> None:
        from benchbot_sim_taichi.kernels import motion as kernels

        self.revisions = revisions
        grids = [world.edge_grid() for world in worlds]
        maps, starts, near, cells, listed, edges = [], [], [], 0, 0, 0
        for grid in grids:
            maps.append([*grid.first, *grid.shape, cells, cells + len(grid.starts) - 2])
            starts.append(grid.starts + listed)
            near.append(grid.numbers + edges)
            cells, listed, edges = cells + len(grid.starts), listed + len(grid.numbers), edges + len(grid.edges)
        numbers = [grids[0].size_m if name == "cell_size_m" else getattr(values, name) for name in kernels.NUMBERS]
        self.arrays = tuple(
            _ti.upload(array.ravel())
            for array in (
                np.array(maps, np.int32),
                np.concatenate(starts).astype(np.int32),
                np.concatenate([*near, np.zeros(1, np.int64)]).astype(np.int32),
                np.concatenate([*(grid.edges for grid in grids), np.zeros((1, 5))]),
                np.array(numbers),
            )
        )
