#!/bin/sh
# The module in Blender, without its window; skipped where there is none (sh cmake/dependencies.sh blender installs it).
#   blender.sh PACKAGES RIG
command -v blender > /dev/null || { echo "skipped: there is no blender here"; exit 77; }
KPSA_PYTHON_PATH=$1 blender --background --python-exit-code 1 --python "$(dirname "$0")/blender_check.py" -- "$2" > blender.log 2>&1
code=$?
cat blender.log
[ $code = 0 ] && grep -q "vertices moved by kpsa" blender.log
