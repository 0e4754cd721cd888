#!/bin/sh
# docs/howto/training.md does what it says: train.sh SOURCE PROGRAM WORK
set -e
source=$1 work=$3
PATH=$(dirname "$2"):$PATH
rm -rf "$work"
mkdir -p "$work"
# The column of hello five times: what one takes is too little to be worth training on a fast machine
python3 - "$source/scenes/hello/hello.glb" "$work/CHAR.glb" << 'END'
import json, struct, sys
glb = open(sys.argv[1], 'rb').read()
length = struct.unpack('<I', glb[12:16])[0]
gltf = json.loads(glb[20:20 + length])
column = next(node for node in gltf['nodes'] if 'skin' in node)
for i in range(1, 5):
    gltf['scenes'][0]['nodes'].append(len(gltf['nodes']))
    gltf['nodes'].append({**column, 'name': f"{column['name']}{i}"})
text = json.dumps(gltf).encode()
text += b' ' * (-len(text) % 4)
rest = glb[20 + length:]
open(sys.argv[2], 'wb').write(struct.pack('<4sIIII', b'glTF', 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)
END
cd "$work"
sh "$source/examples/train/train.sh" CHAR.glb > said.txt || { cat said.txt; exit 1; }
cat said.txt
grep -q "char.kpsa: 3,970 points, [1-9][0-9]* cues" said.txt
grep -q "promise  *kept" said.txt
grep -q "frame 12 of wave" said.txt
test -s char.npz
