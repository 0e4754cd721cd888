// The programs beside the page: what a frame costs, and pictures for the docs.
import assert from 'node:assert/strict';
import {execFile} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {test} from 'node:test';
import {promisify} from 'node:util';
import {startServer} from './support/server.mjs';

const run = async (program, ...words) => (await promisify(execFile)(process.execPath, [new URL(`../${program}`, import.meta.url).pathname, ...words])).stdout;
const row = (text, name) => {
  const found = new RegExp(`^ +${name} +([\\d.]+) +([\\d.]+)$`, 'm').exec(text);
  assert.ok(found, `${name} is not in:\n${text}`);
  const [median, most] = found.slice(1).map(Number);
  assert.ok(median <= most);
  return median;
};

test('frames of a generated report are measured', async () => {
  const text = await run('measure.mjs', '--points', '700', '--modes', '5', '--frames', '12');
  assert.match(text, /Large: .*7\d\d points|Large: .*6\d\d points/);
  assert.match(text, /drawn by the processor, \d+ x \d+ pixels in a window of 1440 x 900/);
  row(text, 'page');
  assert.ok(row(text, 'picture') > 0);
  assert.match(text, /^[\d.]+ pictures a second on the screen$/m);
});

test('a slider of a live view is measured, and a picture of it drawn', async () => {
  const server = await startServer(), folder = mkdtempSync(join(tmpdir(), 'kpsa-picture-'));
  try {
    const text = await run('measure.mjs', server.url, '--control', 'bend.rotateX', '--frames', '40');
    assert.ok(Math.abs(row(text, 'program: evaluation') - 0.695) < 0.01, 'as the server says');
    assert.ok(row(text, 'until the answer is in the page') > 0);
    for (const name of ['page', 'picture']) row(text, name);
    assert.ok(row(text, 'slider to the screen') > row(text, 'slider to the drawn picture'));
    assert.match(text, /^[\d.]+ pictures a second on the screen$/m);
    const picture = join(folder, 'live.png');
    await run('picture.mjs', server.url, picture, '--set', 'bend.rotateX=20', '--press', 'e', '--size', '800x600');
    const png = readFileSync(picture);
    assert.deepEqual([png.readUInt32BE(16), png.readUInt32BE(20), png[25]], [800, 600, 3], 'with a palette');
    assert.equal(server.last.set['bend.rotateX'], 20);
  } finally {
    await server.stop();
    rmSync(folder, {recursive: true, force: true});
  }
});
