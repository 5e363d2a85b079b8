"""The guard: what stands between a driver and its robot, and stops the robot when something is wrong."""
