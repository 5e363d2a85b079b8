"""Scenes from anybody's files: glTF, OBJ, PLY, STL and USD brought to metres, z up, for environments to name."""
