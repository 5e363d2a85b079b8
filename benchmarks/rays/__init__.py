"""The ray tracer beside others on the same machine: speed, exactness, pictures, and what they cost."""
