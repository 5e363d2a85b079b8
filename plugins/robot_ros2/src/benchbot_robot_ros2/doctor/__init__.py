"""What `benchbot doctor --robot` looks at on a robot's graph."""
