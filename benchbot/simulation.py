"""For simulators, under its public name: all of one but its pictures, its rays and the distance to its obstacles."""

from benchbot.plugins.simulation.camera_noise import Response, SrgbResponse
from benchbot.plugins.simulation.distortion import NEWTON_STEPS, Distortion
from benchbot.plugins.simulation.dynamics import DriveLimits, State
from benchbot.plugins.simulation.kinematic import CHANNELS, KinematicSimulator
from benchbot.plugins.simulation.many_robots import PICTURES, KinematicRobots
from benchbot.plugins.simulation.many_steering import ActionNumbers
from benchbot.plugins.simulation.poses import EXACT, QUICK, Poses, Trigonometry, matrices
from benchbot.plugins.simulation.robot import Footprint, Robot
from benchbot.plugins.simulation.scanners import Laser
from benchbot.plugins.simulation.sensors import Camera, Frame
from benchbot.plugins.simulation.world import World

__all__ = [
    "CHANNELS",
    "EXACT",
    "NEWTON_STEPS",
    "PICTURES",
    "QUICK",
    "ActionNumbers",
    "Camera",
    "Distortion",
    "DriveLimits",
    "Footprint",
    "Frame",
    "KinematicRobots",
    "KinematicSimulator",
    "Laser",
    "Poses",
    "Response",
    "Robot",
    "SrgbResponse",
    "State",
    "Trigonometry",
    "World",
    "matrices",
]
