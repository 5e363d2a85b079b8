"""Solutions in containers, on podman or docker: found, built, limited, watched, and always removed."""

__all__ = ["context", "engine", "layout", "transfer"]
