"""The parts of the screens that watch a run or a batch."""
