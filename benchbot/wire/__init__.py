"""What client and supervisor share: the encoding of messages, shared memory, and how a run is found on this machine."""
