"""Code that runs in parallel for every pixel, ray or cell (Taichi)."""
