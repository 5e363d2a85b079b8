#!/bin/sh
# Installs what draws without a display, where there is neither EGL nor OSMesa yet.
set -eu
PATH="$PATH:/usr/sbin:/sbin"
for name in libEGL.so.1 libOSMesa.so.8; do
  if ldconfig -p | grep -q "$name" && { [ "$name" != libEGL.so.1 ] || ldconfig -p | grep -q libEGL_mesa; }; then
    exit 0
  fi
done
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends libegl1 libegl-mesa0 libgl1 >/dev/null
else
  echo "The tests of benchbot-sim-mujoco need OpenGL: sudo apt-get install libegl1 libegl-mesa0 libgl1" >&2
  exit 1
fi
