"""Shared by client and supervisor: the encoding of messages, shared memory, and finding a run on this machine."""
