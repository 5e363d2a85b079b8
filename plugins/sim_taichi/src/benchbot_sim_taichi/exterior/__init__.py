"""The surroundings of a scene, far away."""
