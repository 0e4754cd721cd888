// Parts of the page that need no browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {load} from './support/units.mjs';

test('points at one place share their normals', async () => {
  const {Normals} = await load('shape/normals.ts');
  // two triangles at a right angle, with corners of their own where they meet, and a point of none
  const rest = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, /**/ 0, 0, 0, 0, 0, -1, 1, 0, 0, /**/ 5, 5, 5]);
  const triangles = Uint32Array.from([0, 1, 2, 3, 5, 4]), out = new Float32Array(rest.length), half = Math.SQRT1_2;
  const near = (v, wanted) => wanted.forEach((x, c) => assert.ok(Math.abs(out[3 * v + c] - x) < 1e-6, `${v}: ${out.subarray(3 * v, 3 * v + 3)}`));
  const normals = new Normals(rest, [{triangles}]);
  normals.compute(rest, out);
  for (const v of [0, 1, 3, 5]) near(v, [0, half, half]);
  near(2, [0, 0, 1]);
  near(4, [0, 1, 0]);
  near(6, [0, 0, 0]);
});

test('frames without a stored difference that are misses, or whose error is 0, count as zeros', async () => {
  const {residualHistogram, errorsOfPoint, frameHistogram} = await load('ui/histogram.ts');
  const values = Int8Array.from([3, 0, 0, 9, 0, 0]);  // one row of two points
  const clip = {frames: 4, verdicts: [0, 2, 0, 0], max_error: [4.5, null, 0, 0.001], residual: {step: 0.5, rows: [0, -1, -1, -1]}};
  const {share} = residualHistogram(clip, 2, values, 0.5);
  assert.deepEqual([share[0], share[3], share[8]], [4 / 6, 1 / 6, 1 / 6]);
  assert.deepEqual(errorsOfPoint({points: 2, meta: {clips: [clip]}}, 0, 1, values), [4.5, 0, 0, null]);
  assert.equal(frameHistogram(new Array(400_000).fill(0.001)).share.at(-1), 1);
});

test('a node of very many inputs is laid out', async () => {
  const {layOut} = await load('ui/graph_layout.ts'), many = 200_000;
  const nodes = [{name: 'sum', inputs: Array.from({length: many}, (_, i) => i + 1)}, ...Array.from({length: many}, () => ({name: 'part', inputs: []}))];
  const {x, y} = layOut(nodes);
  assert.ok([...x, ...y].every(Number.isFinite) && (x[0] !== x[1] || y[0] !== y[1]));
});

test('edges of triangles are there once, whichever way round they are', async () => {
  const {edgesOf} = await load('shape/edges.ts');
  const pairs = (triangles, points) => [...edgesOf(Uint32Array.from(triangles), points)].reduce((all, v, i) => (i % 2 ? all[all.length - 1].push(v) : all.push([v]), all), []);
  assert.deepEqual(pairs([0, 1, 2, 2, 1, 3], 4), [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]);
  assert.deepEqual(pairs([], 4), []);
  assert.deepEqual(pairs([1, 1, 1, 5, 5, 2], 6), [[2, 5]], 'a triangle that has collapsed');
  const many = 40_000_000;  // beyond what 32 bits multiply
  assert.deepEqual(pairs([many - 1, many - 2, 0, many - 3, many - 1, many - 2], many), [[0, many - 2], [0, many - 1], [many - 3, many - 2], [many - 3, many - 1], [many - 2, many - 1]]);
});
