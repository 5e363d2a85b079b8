"""A sandbox for solutions, of the kernel's own means: little to see, one way out, and limits on everything."""

__all__ = ["bubblewrap", "control_group", "syscalls", "weak_limits"]
