#!/bin/sh
# Installs PostgreSQL, the database of large challenges, where there is none yet.
set -eu
if ls /usr/lib/postgresql/*/bin/postgres >/dev/null 2>&1 || command -v postgres >/dev/null; then
  exit 0
fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends postgresql >/dev/null
else
  echo "The tests of challenges need PostgreSQL: sudo apt-get install postgresql" >&2
  exit 1
fi
