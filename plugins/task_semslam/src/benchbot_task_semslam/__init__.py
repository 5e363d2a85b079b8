"""BenchBot tasks: semantic SLAM and scene change detection."""
