"""The executor `local`: the workers of a batch as processes of this machine."""
