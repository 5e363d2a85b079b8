"""For simulators, under its public name: all of one but its pictures, its rays and the distance to its obstacles."""

from benchbot.plugins.simulation.camera_noise import Response, SrgbResponse
from benchbot.plugins.simulation.distortion import NEWTON_STEPS, Distortion
from benchbot.plugins.simulation.dynamics import DriveLimits, State
from benchbot.plugins.simulation.kinematic import CHANNELS, PICTURES, KinematicSimulator, World
from benchbot.plugins.simulation.robot import Footprint, Robot
from benchbot.plugins.simulation.sensors import Camera, Frame

__all__ = [
    "CHANNELS",
    "NEWTON_STEPS",
    "PICTURES",
    "Camera",
    "Distortion",
    "DriveLimits",
    "Footprint",
    "Frame",
    "KinematicSimulator",
    "Response",
    "Robot",
    "SrgbResponse",
    "State",
    "World",
]
