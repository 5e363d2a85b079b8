"""The public side for plug-ins: all that a plug-in imports of BenchBot, but for `benchbot.api`, `benchbot.cli.kit`,
`benchbot.process`, `benchbot.screens`, `benchbot.simulation` and `benchbot.testing`. Nothing else is promised;
docs/plugins.md says what a promise is worth.

A name is imported when it is used: this module itself costs next to nothing.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from benchbot.core import instance_checks as instance_checks
    from benchbot.core import randomness as randomness
    from benchbot.core.atomic import write as _write_atomically
    from benchbot.core.atomic import write_text as write_text
    from benchbot.core.budget import Spent as Spent
    from benchbot.core.channels import ACTIONS as ACTIONS
    from benchbot.core.channels import MANIPULATION as MANIPULATION
    from benchbot.core.channels import OBSERVATIONS as OBSERVATIONS
    from benchbot.core.channels import Action as Action
    from benchbot.core.channels import CameraModel as CameraModel
    from benchbot.core.channels import FetchGoal as FetchGoal
    from benchbot.core.channels import FramePose as FramePose
    from benchbot.core.channels import InertialMeasurement as InertialMeasurement
    from benchbot.core.channels import JointStates as JointStates
    from benchbot.core.channels import LaserScan as LaserScan
    from benchbot.core.channels import LidarScan as LidarScan
    from benchbot.core.channels import Observation as Observation
    from benchbot.core.channels import Observations as Observations
    from benchbot.core.channels import Segmentation as Segmentation
    from benchbot.core.declarations.catalog import Catalog as Catalog
    from benchbot.core.declarations.catalog import Declaration as Declaration
    from benchbot.core.declarations.formats import check_format as check_format
    from benchbot.core.declarations.schema import check as _check_declaration
    from benchbot.core.declarations.schema import editor_line as editor_line
    from benchbot.core.declarations.schema import problems as _declaration_problems
    from benchbot.core.declarations.schema import read as _read_declaration
    from benchbot.core.declarations.schema import write_editor_schema as write_editor_schema
    from benchbot.core.documents import EnvironmentDeclaration as EnvironmentDeclaration
    from benchbot.core.documents import GroundTruth as GroundTruth
    from benchbot.core.documents import Result as Result
    from benchbot.core.documents import RobotDeclaration as RobotDeclaration
    from benchbot.core.documents import TrackedScene as TrackedScene
    from benchbot.core.episodes import digest as _episodes_digest
    from benchbot.core.episodes import is_one_attempt as is_one_attempt
    from benchbot.core.episodes import named_list as _named_episode_list
    from benchbot.core.errors import BenchbotError as BenchbotError
    from benchbot.core.errors import ExitCode as ExitCode
    from benchbot.core.errors import FailureClass as FailureClass
    from benchbot.core.errors import did_you_mean as did_you_mean
    from benchbot.core.findings import Finding as Finding
    from benchbot.core.findings import Level as Level
    from benchbot.core.findings import Problem as Problem
    from benchbot.core.geometry import Pose as Pose
    from benchbot.core.geometry import Quaternion as Quaternion
    from benchbot.core.geometry import wrap_angle_rad as wrap_angle_rad
    from benchbot.core.lidar import OFFSETS as _LIDAR_OFFSETS
    from benchbot.core.lidar import POINT as _LIDAR_POINT
    from benchbot.core.lidar import cloud as cloud
    from benchbot.core.lidar import directions as directions
    from benchbot.core.lidar import elevations_deg as elevations_deg
    from benchbot.core.lidar import points_m as points_m
    from benchbot.core.light_records import AssetPack as AssetPack
    from benchbot.core.light_records import Check as Check
    from benchbot.core.light_records import Command as Command
    from benchbot.core.light_records import DeclarationFolder as DeclarationFolder
    from benchbot.core.light_records import DeclarationSource as DeclarationSource
    from benchbot.core.light_records import EnvironmentSet as EnvironmentSet
    from benchbot.core.light_records import Executor as Executor
    from benchbot.core.light_records import Recorder as Recorder
    from benchbot.core.light_records import Routes as Routes
    from benchbot.core.light_records import SubmissionMode as SubmissionMode
    from benchbot.core.light_records import TuiScreen as TuiScreen
    from benchbot.core.light_records import target as target
    from benchbot.core.motion import REST_MPS as REST_MPS
    from benchbot.core.motion import REST_RADPS as REST_RADPS
    from benchbot.core.motion import MotionConfig as MotionConfig
    from benchbot.core.motion import Outcome as Outcome
    from benchbot.core.platform import Holonomic as Holonomic
    from benchbot.core.platform import Manipulator as Manipulator
    from benchbot.core.platform import Many as Many
    from benchbot.core.platform import ManyCameras as ManyCameras
    from benchbot.core.platform import ManyRobots as ManyRobots
    from benchbot.core.platform import Platform as Platform
    from benchbot.core.platform import PlatformSpec as PlatformSpec
    from benchbot.core.platform import Scene as Scene
    from benchbot.core.platform import Simulation as Simulation
    from benchbot.core.platform import Witness as Witness
    from benchbot.core.platform import Witnessed as Witnessed
    from benchbot.core.plugin_manager import PluginInfo as PluginInfo
    from benchbot.core.plugin_manager import Plugins as Plugins
    from benchbot.core.plugin_manager import installed as _installed_plugins
    from benchbot.core.plugin_manager import load as _load_plugins
    from benchbot.core.progress import ActionResult as ActionResult
    from benchbot.core.progress import Progress as Progress
    from benchbot.core.progress import State as State
    from benchbot.core.progress import Step as Step
    from benchbot.core.recording import KnowsRun as KnowsRun
    from benchbot.core.recording import Recording as Recording
    from benchbot.core.recording import ShowsResults as ShowsResults
    from benchbot.core.records import API_VERSION as API_VERSION
    from benchbot.core.records import Document as Document
    from benchbot.core.records import Evaluator as Evaluator
    from benchbot.core.records import Resources as Resources
    from benchbot.core.records import RobotDriver as RobotDriver
    from benchbot.core.records import Score as Score
    from benchbot.core.records import Simulator as Simulator
    from benchbot.core.records import Workers as Workers
    from benchbot.core.records import WorkOrder as WorkOrder
    from benchbot.core.resources import cache_dir as cache_dir
    from benchbot.core.resources import data_dir as data_dir
    from benchbot.core.results import public_environment as public_environment
    from benchbot.core.results import read as _read_result
    from benchbot.core.results import write_json as write_json
    from benchbot.core.selection import misfits as misfits
    from benchbot.evaluation import occupancy_map as occupancy_map
    from benchbot.evaluation.ground_truths import GroundTruths as GroundTruths
    from benchbot.submission.modes import NATIVE as NATIVE
    from benchbot.submission.modes import Holder as Holder
    from benchbot.submission.modes import Mode as Mode
    from benchbot.submission.modes import ProcessLimits as ProcessLimits
    from benchbot.submission.modes import Running as Running
    from benchbot.submission.modes import SolutionSpec as SolutionSpec
    from benchbot.supervisor.http.access import Access as Access
    from benchbot.supervisor.run import Run as Run

    write_atomically = _write_atomically
    check_declaration = _check_declaration
    declaration_problems = _declaration_problems
    read_declaration = _read_declaration
    episodes_digest = _episodes_digest
    named_episode_list = _named_episode_list
    LIDAR_POINT = _LIDAR_POINT
    LIDAR_OFFSETS = _LIDAR_OFFSETS
    installed_plugins = _installed_plugins
    load_plugins: Callable[[], Plugins] = _load_plugins
    read_result = _read_result

F = TypeVar("F", bound=Callable[..., Any])


def hookimpl(function: F) -> F:
    """Mark a function of a plug-in's module as the implementation of the hook of its name."""
    # As `pluggy.HookimplMarker` does it; importing pluggy would be a fifth of what `benchbot --help` takes.
    function.benchbot_impl = {}  # type: ignore[attr-defined]
    return function


_HOMES = {
    "core.channels": "ACTIONS MANIPULATION OBSERVATIONS Action CameraModel FetchGoal FramePose InertialMeasurement "
    "JointStates LaserScan LidarScan Observation Observations Segmentation",
    "core": "instance_checks randomness",
    "core.budget": "Spent",
    "core.atomic": "write=write_atomically write_text",
    "core.declarations.catalog": "Catalog Declaration",
    "core.documents": "EnvironmentDeclaration GroundTruth Result RobotDeclaration TrackedScene",
    "core.declarations.formats": "check_format",
    "core.declarations.schema": "check=check_declaration editor_line problems=declaration_problems "
    "read=read_declaration write_editor_schema",
    "core.episodes": "digest=episodes_digest is_one_attempt named_list=named_episode_list",
    "core.errors": "BenchbotError ExitCode FailureClass did_you_mean",
    "core.findings": "Finding Level Problem",
    "core.geometry": "Pose Quaternion wrap_angle_rad",
    "core.lidar": "POINT=LIDAR_POINT OFFSETS=LIDAR_OFFSETS cloud directions elevations_deg points_m",
    "core.motion": "REST_MPS REST_RADPS MotionConfig Outcome",
    "core.platform": "Holonomic Many ManyCameras ManyRobots Manipulator Platform PlatformSpec Scene Simulation "
    "Witness Witnessed",
    "core.plugin_manager": "installed=installed_plugins load=load_plugins PluginInfo Plugins",
    "core.progress": "ActionResult Progress State Step",
    "core.recording": "KnowsRun Recording ShowsResults",
    "core.light_records": (
        "AssetPack Check Command DeclarationFolder DeclarationSource EnvironmentSet Executor Recorder Routes "
        "SubmissionMode TuiScreen target "
    ),
    "core.records": ("API_VERSION Document Evaluator Resources RobotDriver Score Simulator WorkOrder Workers "),
    "core.resources": "cache_dir data_dir",
    "core.results": "public_environment read=read_result write_json",
    "core.selection": "misfits",
    "evaluation": "occupancy_map",
    "evaluation.ground_truths": "GroundTruths",
    "submission.modes": "NATIVE Holder Mode ProcessLimits Running SolutionSpec",
    "supervisor.http.access": "Access",
    "supervisor.run": "Run",
}
"""Modules to the names that they give; `first_line=editor_line` is `first_line`, known here as `editor_line`."""
_MODULES = {
    name.rpartition("=")[2]: (module, name.partition("=")[0])
    for module, names in _HOMES.items()
    for name in names.split()
}

__all__ = ["hookimpl", *_MODULES]  # noqa: PLE0604 - a test holds it to what type checkers see


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'benchbot.plugin' has no attribute '{name}'")
    module, attribute = _MODULES[name]
    home = import_module(f"benchbot.{module}")
    found = getattr(home, attribute) if hasattr(home, attribute) else import_module(f"benchbot.{module}.{attribute}")
    globals()[name] = found
    return found
