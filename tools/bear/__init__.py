"""How the environments are made: procedural models and rooms, written as GLB, YAML and ground truth."""
