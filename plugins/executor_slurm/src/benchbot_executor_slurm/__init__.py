"""Batches on a Slurm cluster."""
