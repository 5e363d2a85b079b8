"""New environments from a seed: floor plans, furniture by function, and where a robot can go in them."""
