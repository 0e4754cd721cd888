#!/bin/sh
# pip makes a wheel of what is built and installs it; the package is imported from there.
#   pip.sh PYTHON SOURCE BUILD WORK
set -e
python=$1 source=$2 build=$3 work=$4
rm -rf "$work"
mkdir -p "$work"
"$python" -m pip install --quiet --no-index --no-deps --no-build-isolation --disable-pip-version-check --root-user-action=ignore \
  --config-settings "build-folder=$build" --target "$work/site" "$source"
cd "$work"
PYTHONPATH="$work/site" "$python" -c "
import kpsa
rig = kpsa.load('$source/scenes/hello/hello.yaml')
assert kpsa.__file__.startswith('$work/site'), kpsa.__file__
print(kpsa.__version__, rig.meshes[0], rig.scene().points('column').shape)"
