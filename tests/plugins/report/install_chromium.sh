#!/bin/sh
# Installs the browser that the tests look at pages with, where there is none yet.
set -eu
for name in chromium chromium-browser chromium-headless-shell google-chrome google-chrome-stable chrome; do
  if command -v "$name" >/dev/null; then
    exit 0
  fi
done
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends chromium >/dev/null
else
  echo "The tests of pages need a browser. Install Chromium, for example: sudo apt-get install chromium" >&2
  exit 1
fi
