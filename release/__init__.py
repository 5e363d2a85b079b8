"""From this checkout to distributions that can be uploaded: built, looked at, installed elsewhere, tried."""
