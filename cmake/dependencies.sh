#!/bin/sh
# Installs what the build needs (Debian 12), and the packages that are given as arguments, where they are missing. Needs root or sudo only if something is missing.
set -e
packages="g++ cmake ninja-build pkg-config libeigen3-dev libtbb-dev libyaml-cpp-dev libtinygltf-dev libdraco-dev libmeshoptimizer-dev libfmt-dev \
libhwy-dev libmuparser-dev libzip-dev zlib1g-dev libpng-dev libjpeg-dev libembree-dev libcli11-dev libcpp-httplib-dev nlohmann-json3-dev libstb-dev libgtest-dev \
pybind11-dev python3-dev python3-numpy python3-pytest python3-pip $*"
if ! command -v apt-get > /dev/null || ! command -v dpkg-query > /dev/null; then
  echo "there is no apt-get here, so nothing is installed; what the build needs is called, on Debian 12: $packages" >&2
  exit 0
fi
missing=""
for package in $packages; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q "install ok installed" || missing="$missing $package"
done
[ -z "$missing" ] && exit 0
sudo=""
if [ "$(id -u)" != 0 ]; then
  if ! command -v sudo > /dev/null; then
    echo "missing packages; run this as root: apt-get install$missing" >&2
    exit 1
  fi
  sudo="sudo"
fi
echo "installing$missing"
$sudo apt-get update -qq
# sudo forgets the environment of its caller, hence env. A machine that has just started may hold the lock for a while.
# shellcheck disable=SC2086
$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=300 \
  --no-install-recommends $missing > /dev/null
