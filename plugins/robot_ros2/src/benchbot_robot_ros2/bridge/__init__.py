"""A simulated robot as a ROS 2 robot: `benchbot bridge ros2`."""
