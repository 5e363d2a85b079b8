"""A planar world with a disc robot: the smallest complete BenchBot plug-in, for tests."""
