"""The baker of the environments: procedural models and rooms, written as GLB, YAML and ground truth."""
