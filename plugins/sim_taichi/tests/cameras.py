"""Poses of an optical frame (x right, y down, z forward) in the map frame."""

import numpy as np


def looking(position: tuple[float, float, float], yaw_deg: float, pitch_deg: float = 0.0) -> np.ndarray:
    """(4, 4) pose of a level camera turned by `yaw_deg` from +x and raised by `pitch_deg`."""
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    forward = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = position
    return pose
