// Triangles and lines as the processor draws them, without a browser.
import assert from 'node:assert/strict';
import {before, test} from 'node:test';
import {load} from './support/units.mjs';

const width = 61, height = 45, background = 7, everywhere = {left: 0, top: 0, right: width, bottom: height};  // no whole tiles
let drawTriangles, drawLines, farthest, stride, makeTarget;
before(async () => { ({drawTriangles, drawLines, farthest, stride, target: makeTarget} = await load('draw/raster.ts')); });

const blank = () => makeTarget(width, height, new Int32Array(width * height).fill(background));
/** As a picture is drawn: fronts first, and of the rest what they do not hide. */
const draw = (target, v, triangles, table, row) => {
  drawTriangles(target, v, triangles, table, row, 'front');
  farthest(target, everywhere);
  drawTriangles(target, v, triangles, table, row, 'back');
};
/** Each [x, y, 1 / distance, light of the front, of the back, row]. */
const vertices = (...all) => Float32Array.from(all.flatMap(([x, y, near = 1, front = 10, back = 20, row = 3]) => [x, y, near, front, back, row]));
const shades = Int32Array.from({length: 65536}, (_, i) => i);  // the colour is where it was looked up
const order = (...corners) => Uint32Array.from(corners);
const drawn = (target) => target.colours.filter((colour) => colour !== background).length;

test('what a vertex has is as long as the tests believe', () => assert.equal(stride, 6));

test('triangles that share edges leave no pixel out and take none twice', () => {
  const across = 9, down = 8, all = [], triangles = [];
  let seed = 1;
  const random = () => (seed = seed * 16807 % 2147483647) / 2147483647 - 0.5;
  for (let j = 0; j <= down; ++j) {
    for (let i = 0; i <= across; ++i) {
      const inner = i && j && i < across && j < down;
      all.push([4 + i * 6 + (inner ? 4 * random() : 0), 4 + j * 5 + (inner ? 3 * random() : 0)]);
      const v = j * (across + 1) + i;
      if (i < across && j < down) triangles.push(v, v + 1, v + across + 1, v + 1, v + across + 2, v + across + 1);
    }
  }
  const v = vertices(...all), whole = blank(), count = new Int32Array(width * height);
  draw(whole, v, Uint32Array.from(triangles), shades, -1);
  for (let t = 0; t < triangles.length; t += 3) {
    const target = blank();
    draw(target, v, Uint32Array.from(triangles.slice(t, t + 3)), shades, -1);
    target.colours.forEach((colour, p) => { count[p] += colour !== background; });
  }
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) assert.equal(count[y * width + x], x >= 4 && x < 58 && y >= 4 && y < 44 ? 1 : 0, `${x} ${y}`);
  }
  assert.equal(drawn(whole), 54 * 40);
});

test('what is nearer hides what is behind, in either order, and each side has its own light', () => {
  const v = vertices([4, 4, 1], [40, 4, 1], [4, 40, 1], [4, 4, 2], [4, 40, 2], [40, 4, 2]), at = 10 * width + 10;
  for (const corners of [[0, 1, 2, 3, 4, 5], [3, 4, 5, 0, 1, 2]]) {
    const target = blank();
    draw(target, v, order(...corners), shades, 5);
    assert.equal(target.depth[at], 2);
    assert.equal(target.colours[at], 5 << 8 | 10, 'counter-clockwise as one sees it, y upwards: the front');
  }
  const target = blank();
  draw(target, v, order(0, 1, 2), shades, 5);
  assert.equal(target.colours[at], 5 << 8 | 20, 'the back');
});

test('backs are left out where fronts hide them, and only there', () => {
  let seed = 5;
  const random = (size) => (seed = seed * 16807 % 2147483647) / 2147483647 * size;
  for (let round = 0; round < 40; ++round) {
    // a front that covers a part of the picture, and small triangles about it, some of them in front of it
    const all = [[random(20), 0, 1.5], [random(20), 48, 1.5], [37 + random(24), 24, 1.5]], corners = [0, 1, 2];
    for (let i = 0; i < 60; ++i) {
      const x = random(60), y = random(44), near = 1 + random(1);
      corners.push(all.length, all.length + 1, all.length + 2);
      all.push([x, y, near], [x + random(9), y + random(9), near], [x + random(9), y + random(9), near]);
    }
    const v = vertices(...all), target = blank(), plain = blank();
    draw(target, v, order(...corners), shades, 1);
    plain.tiles.fill(0);  // nothing is known of what is drawn
    drawTriangles(plain, v, order(...corners), shades, 1, 'front');
    const fronts = plain.colours.slice();
    drawTriangles(plain, v, order(...corners), shades, 1, 'back');
    assert.deepEqual(target.colours, plain.colours);
    assert.notDeepEqual(fronts, plain.colours, 'backs are seen');
  }
  // and where all is covered, a back is not drawn even if its depth would let it
  const covered = blank();
  drawTriangles(covered, vertices([0, 0, 1], [0, 200, 1], [200, 0, 1]), order(0, 1, 2), shades, 1, 'front');
  farthest(covered, everywhere);
  covered.depth.fill(0);
  const before = covered.colours.slice();
  drawTriangles(covered, vertices([9, 9, 0.9], [30, 9, 0.9], [9, 30, 0.9]), order(0, 1, 2), shades, 2, 'back');
  assert.deepEqual(covered.colours, before);
});

test('light, colour and depth change evenly', () => {
  const target = blank();
  draw(target, vertices([0, 0, 1, 0, 0, 0], [64, 0, 3, 128, 128, 64], [0, 48, 1, 0, 0, 0]), order(0, 1, 2), shades, -1);
  const p = 8 * width + 20;
  assert.equal(target.colours[p], 20 << 8 | 41);
  assert.ok(Math.abs(target.depth[p] - (1 + 20.5 / 32)) < 1e-6);
});

test('a ghost lets half of what is behind through, and is over the surface that it is as near as', () => {
  const v = vertices([0, 0], [64, 0], [0, 48]), target = blank(), half = Int32Array.from({length: 65536}, () => 0xff204060 | 0);
  draw(target, v, order(0, 1, 2), Int32Array.from({length: 65536}, () => 0xff402000 | 0), 0);
  const depth = target.depth.slice();
  drawTriangles(target, v, order(0, 1, 2), half, 0, 'ghost');
  assert.equal(target.colours[0] >>> 0, 0xff303030);
  assert.deepEqual(target.depth, depth);
});

test('what is behind the eye, beside the picture or no number is not drawn, and nothing is written elsewhere', () => {
  for (const bad of [[10, 10, 0], [NaN, 10], [10, 10, NaN]]) {
    const target = blank();
    draw(target, vertices([1, 1], [40, 1], bad), order(0, 1, 2), shades, -1);
    drawLines(target, vertices([1, 1], bad), order(0, 1), shades, -1);
    assert.equal(drawn(target), 0, String(bad));
  }
  const target = blank(), huge = vertices([-1e7, -1e7], [1e7, -1e7], [0, 1e7], [-9, 5], [-3, 40], [-5, 9], [70, 5], [99, 5], [80, 40]);
  draw(target, huge, order(3, 4, 5, 6, 7, 8), shades, -1);
  drawLines(target, huge, order(3, 4, 6, 8), shades, -1);
  assert.equal(drawn(target), 0);
  draw(target, huge, order(0, 1, 2), shades, -1);
  assert.equal(drawn(target), width * height, 'one that covers all');
});

test('lines are whole, as long as they should be, and hidden by what is clearly nearer', () => {
  const v = vertices([5.5, 10.5], [25.5, 10.5], [-1000, 20.5], [1000, 20.5], [30.5, 2.5], [30.5, 30.5]), target = blank();
  drawLines(target, v, order(0, 1, 2, 3, 4, 5), shades, 2);
  assert.equal(drawn(target), 20 + width + 28 - 1);
  assert.equal(target.colours[10 * width + 15], 2 << 8 | 10);
  for (const [near, seen] of [[1, true], [1.001, true], [1.1, false]]) {
    const covered = blank();
    draw(covered, vertices([0, 0, near], [64, 0, near], [0, 96, near]), order(0, 1, 2), shades, 9);
    drawLines(covered, v, order(0, 1), shades, 2);
    assert.equal(covered.colours[10 * width + 15] === (2 << 8 | 10), seen, `behind ${near}`);
  }
});

test('a triangle that reaches behind the eye is drawn as far as it is before it', async () => {
  const {Projected} = await load('draw/projected.ts'), projected = new Projected(), near = 0.5;
  // A camera at the origin that looks along -z, over a floor a unit below it, half the picture high
  const elements = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -2 * near, 0], identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const camera = {near, updateMatrixWorld() {}, projectionMatrix: {elements}, matrixWorld: {elements: identity}, matrixWorldInverse: {elements: identity}};
  const points = Float32Array.from([-900, -1, -300, 900, -1, -300, 0, -1, 300]), normals = Float32Array.from([0, 1, 0, 0, 1, 0, 0, 1, 0]), target = blank();
  projected.take({meshes: [{triangles: order(0, 1, 2)}]}, {points, normals, version: 0}, null, camera, target);
  assert.deepEqual(projected.box, everywhere);
  for (const {vertices: v, triangles} of projected.parts) draw(target, v, triangles, shades, 4);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) assert.equal(target.colours[y * width + x] !== background, y >= height / 2, `${x} ${y}`);
  }
  const depth = target.depth[(height - 1) * width + 30];
  assert.ok(Math.abs(depth - (height - 0.5 - height / 2) / (height / 2)) < 1e-4, `a floor is as far as it is below: ${depth}`);
});
