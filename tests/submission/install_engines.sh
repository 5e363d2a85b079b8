#!/bin/sh
# Installs what runs solutions apart from the machine in the tests: podman, as root and without, and bubblewrap.
# Nothing is started.
set -eu
PATH="$PATH:/usr/sbin"
have() { command -v "$1" >/dev/null; }
if have podman && have runc && have bwrap && have newuidmap && [ -x /usr/libexec/podman/catatonit ]; then
  exit 0
fi
if [ "$(id -u)" = 0 ] && have apt-get; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive RUNLEVEL=1 apt-get install -qq --no-install-recommends \
    podman runc catatonit bubblewrap uidmap >/dev/null
else
  echo "The tests of submissions need podman and bubblewrap, and to run as root:" \
    "sudo apt-get install podman runc catatonit bubblewrap uidmap" >&2
  exit 1
fi
