"""Comparability: do a robot's senses agree with each other and with what is there? Pure functions, no platform."""
