"""The shared parts of the examples: projection of pixels, object maps, their differences, and drivable floor."""
