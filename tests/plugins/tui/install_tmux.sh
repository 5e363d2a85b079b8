#!/bin/sh
# Installs tmux, the terminal in which the tests of `benchbot tui` press keys, where there is none yet.
set -eu
if command -v tmux >/dev/null; then
  exit 0
fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends tmux >/dev/null
else
  echo "The tests of benchbot tui need tmux: sudo apt-get install tmux" >&2
  exit 1
fi
