"""The challenge as a web site for people, and as an HTTP API for programs (docs/challenge.md)."""
