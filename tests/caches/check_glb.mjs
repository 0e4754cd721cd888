// node check_glb.mjs GLB NPZ [--skinned]: the validator has nothing to say, and three.js shows what the .npz holds.
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';
import { AnimationMixer, LoopOnce, PropertyBinding, Vector3 } from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { readNpz } from './npz.mjs';

const [glbPath, npzPath, ...flags] = process.argv.slice(2), skinned = flags.includes('--skinned');
const glb = readFileSync(glbPath), { times, ...meshArrays } = readNpz(readFileSync(npzPath)), names = Object.keys(meshArrays);
const arrays = Object.values(meshArrays);
const fail = (text) => { console.error(`${glbPath}: ${text}`); process.exit(1); };

// Texture coordinates without a texture are no fault
const stated = ['UNUSED_OBJECT'];
const { issues } = await validator.validateBytes(new Uint8Array(glb), { maxIssues: 100 });
const told = issues.messages.filter((issue) => issue.severity < 2 || !stated.includes(issue.code));
if (told.length > 0 || issues.numErrors > 0 || issues.truncated) fail(`the validator says, of ${issues.numErrors} errors, ${JSON.stringify(told.slice(0, 5), null, 1)}`);

globalThis.self ??= globalThis;
const file = await new GLTFLoader().parseAsync(glb.buffer.slice(glb.byteOffset, glb.byteOffset + glb.byteLength), '');
if (file.animations.length !== 1) fail(`${file.animations.length} animations, expected 1`);
const mixer = new AnimationMixer(file.scene), action = mixer.clipAction(file.animations[0]);
action.setLoop(LoopOnce);
action.clampWhenFinished = true;
action.play();
let meshes = [];
file.scene.traverse((object) => { if (object.isMesh) meshes.push(object); });
// With joints, meshes come in the order of the nodes; here each has one primitive
if (skinned) meshes = names.map((key) => meshes.find((mesh) => mesh.name === PropertyBinding.sanitizeNodeName(key.replace(/\/0$/, ''))));
if (meshes.includes(undefined)) fail(`a mesh of ${names} is missing`);
if (skinned && !meshes.some((mesh) => mesh.isSkinnedMesh)) fail('no mesh has joints');
if (meshes.length !== arrays.length) fail(`${meshes.length} meshes, the .npz has ${arrays.length}`);

const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
for (const { data } of arrays) {
  data.forEach((value, i) => {
    low[i % 3] = Math.min(low[i % 3], value);
    high[i % 3] = Math.max(high[i % 3], value);
  });
}
const diagonal = Math.hypot(...high.map((value, i) => value - low[i]));
let worst = 0, largest = 0;
const frames = times.shape[0], point = new Vector3();
for (const frame of [0, Math.floor(frames / 3), Math.floor(frames / 2), frames - 1]) {
  mixer.setTime(times.data[frame]);
  file.scene.updateMatrixWorld(true);
  meshes.forEach((mesh, m) => {
    const { shape, data } = arrays[m], { attributes, morphAttributes } = mesh.geometry;
    if (attributes.position.count !== shape[1]) fail(`mesh ${m} has ${attributes.position.count} vertices`);
    const weights = mesh.morphTargetInfluences ?? [];  // a still mesh has none
    if (!attributes.normal || (weights.length > 0 && !morphAttributes.normal)) fail(`mesh ${m} has no normals`);
    if (!skinned && weights.length > 0 && mesh.morphTargetDictionary.shape1 !== 0) fail(`mesh ${m} has no target "shape1"`);
    if (skinned && weights.length > 0 && mesh.morphTargetDictionary.shape1 !== undefined) fail(`mesh ${m} has not its own targets`);
    if (!skinned && weights.some((weight) => weight < 0 || weight > 1)) fail('a weight is outside of 0 to 1');
    for (let v = 0; v < shape[1]; ++v) {
      mesh.getVertexPosition(v, point).applyMatrix4(mesh.matrixWorld);
      const at = 3 * (frame * shape[1] + v);
      worst = Math.max(worst, Math.hypot(point.x - data[at], point.y - data[at + 1], point.z - data[at + 2]));
      largest = Math.max(largest, Math.abs(data[at] - data[3 * v]));
    }
  });
}
if (largest === 0) fail('nothing moves');
const allowed = skinned ? 1.1e-5 : 1.01e-4;
if (!(worst <= allowed * diagonal)) fail(`three.js shows points ${worst} m off, at most ${allowed * diagonal} m are stated`);
console.log(`${glbPath}: ${meshes.length} meshes, ${meshes.map((mesh) => (mesh.morphTargetInfluences ?? []).length)} targets, ` +
            `three.js within ${(worst / diagonal).toExponential(1)} of the diagonal; the validator: ` +
            `${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos} infos, ${issues.numHints} hints`);
