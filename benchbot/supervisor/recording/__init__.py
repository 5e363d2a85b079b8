"""The recordings of a run: a child process that writes them."""
