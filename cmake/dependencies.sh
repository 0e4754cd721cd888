#!/bin/sh
# Installs what the build needs (Debian 12), where it is missing. Needs root or sudo only if something is missing.
set -e
packages="g++ cmake ninja-build pkg-config libeigen3-dev libtbb-dev libyaml-cpp-dev libtinygltf-dev libfmt-dev \
libhwy-dev libzip-dev zlib1g-dev libembree-dev libcli11-dev nlohmann-json3-dev libstb-dev libgtest-dev"
missing=""
for package in $packages; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q "install ok installed" || missing="$missing $package"
done
[ -z "$missing" ] && exit 0
sudo=""
[ "$(id -u)" = 0 ] || sudo="sudo"
$sudo apt-get update -q
# shellcheck disable=SC2086
DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -q --no-install-recommends $missing
