"""Programs that make the models and environments that the distributions ship; in no wheel."""
