"""Looking on: what is known of runs and batches that are alive, kept up to date for whoever displays it."""
