"""A thousand generated places, split into those to train, to validate and to test in."""
