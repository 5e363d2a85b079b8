"""What the examples share: where pixels are, a map of objects, what changed between two, where one can drive."""
