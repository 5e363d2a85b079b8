#!/bin/sh
# Installs the Slurm whose daemons the tests run on machines of their own, where there is none yet. Nothing is started.
set -eu
PATH="$PATH:/usr/sbin"
if command -v slurmctld >/dev/null && command -v slurmd >/dev/null && command -v sbatch >/dev/null && command -v ip >/dev/null; then
  exit 0
fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  apt-get update -qq
  # In a container there is nothing that would start them; elsewhere this says that they are not wanted.
  DEBIAN_FRONTEND=noninteractive RUNLEVEL=1 apt-get install -qq --no-install-recommends slurm-wlm iproute2 >/dev/null
else
  echo "The tests of batches on clusters need Slurm, and to run as root: sudo apt-get install slurm-wlm iproute2" >&2
  exit 1
fi
