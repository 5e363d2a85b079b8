"""The checks of `benchbot doctor --robot` on a robot's ROS 2 graph."""
