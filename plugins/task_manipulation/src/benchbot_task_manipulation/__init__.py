"""Tasks for mobile manipulators: fetching an object and putting it down somewhere else."""
