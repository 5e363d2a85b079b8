#!/bin/sh
# Installs SDFormat's schema and what checks files by it, where they are missing.
set -eu
if command -v xmllint >/dev/null && ls -d /usr/share/sdformat*/1.9 >/dev/null 2>&1; then
  exit 0
fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends sdformat-sdf libxml2-utils >/dev/null
else
  echo "The tests of benchbot-scenes need SDFormat's schema: sudo apt-get install sdformat-sdf libxml2-utils" >&2
  exit 1
fi
