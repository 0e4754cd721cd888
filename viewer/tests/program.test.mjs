// What the program writes and serves, in the page: the bundled column, trained, as a report and live. KPSA is the program,
// KPSA_SCENES the folder scenes/; without them these tests are skipped.
import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {settled, startBrowser} from './support/browser.mjs';
import {readNpz} from './support/npz.mjs';
import {difference} from './support/png.mjs';

const {KPSA, KPSA_SCENES} = process.env, skip = KPSA && KPSA_SCENES ? false : 'KPSA and KPSA_SCENES are not set';
let folder, browser, server;

const run = (...words) => execFileSync(KPSA, words, {cwd: folder, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe']});

/** Positions of a frame of `kpsa eval`, in the order in which the page stacks meshes. */
function evaluated(name, ...words) {
  run('eval', 'hello.yaml', ...words, '-o', name, '--force', '-q');
  const [mesh] = Object.entries(readNpz(readFileSync(join(folder, name)))).filter(([key]) => key !== 'times').map(([, array]) => array);
  const stride = mesh.shape[1] * 3;
  return {points: mesh.shape[1], frame: (f) => mesh.data.subarray(f * stride, (f + 1) * stride)};
}

function apart(got, expected) {
  assert.equal(got.length, expected.length);
  return got.reduce((most, x, i) => Math.max(most, Math.abs(x - expected[i])), 0);
}

before(async () => {
  if (skip) return;
  folder = mkdtempSync(join(tmpdir(), 'kpsa-program-'));
  for (const file of ['hello.yaml', 'hello.glb']) copyFileSync(join(KPSA_SCENES, 'hello', file), join(folder, file));
  run('train', 'hello.yaml', '--samples', '300', '--calibration', '100', '--force', '-q');
  browser = await startBrowser();
}, {timeout: 240000});
after(async () => {
  server?.kill('SIGINT');
  await browser?.stop();
  if (folder) rmSync(folder, {recursive: true, force: true});
});

test('a report shows what kpsa eval evaluates', {skip}, async () => {
  run('report', 'hello.yaml', '-o', 'report.html', '-q');
  const {page, requests, complaints} = await browser.open('file://' + join(folder, 'report.html'));
  const {clip, precision, step} = await page.evaluate(() => {
    const meta = JSON.parse(document.getElementById('kpsa-meta').textContent), [first] = meta.clips;
    return {clip: first.name, precision: meta.shape.precision, step: first.residual?.step ?? 0};
  });
  const full = evaluated('full.npz', '--clip', clip), fast = evaluated('fast.npz', '--clip', clip, '--accelerate');
  for (const f of [0, 7, 20]) {
    const at = (side) => page.evaluate(async ([frame, name, s]) => {
      await window.kpsa.setFrame(frame, name);
      return [...window.kpsa.positions(s)];
    }, [f, clip, side]);
    assert.ok(apart(await at('accelerated'), fast.frame(f)) <= precision * 1.01 + 1e-6, `frame ${f}`);
    assert.ok(apart(await at('full'), full.frame(f)) <= precision * 1.01 + step + 1e-6, `frame ${f}`);
  }
  assert.ok(apart(full.frame(0), full.frame(7)) > 10 * precision, 'frames differ by more than what is allowed');
  assert.deepEqual(complaints, []);
  assert.ok(requests.every((url) => url.startsWith('file:') || url.startsWith('data:') || url.startsWith('blob:')), requests.join());
  await page.close();
});

async function serve() {
  server = spawn(KPSA, ['view', 'hello.yaml', '--accelerate'], {cwd: folder, stdio: ['ignore', 'pipe', 'pipe']});
  let said = '';
  return new Promise((resolve, reject) => {
    const hear = (part) => {
      said += part;
      const address = /http:\/\/127\.0\.0\.1:\d+\/\?token=\w+/.exec(said);
      if (address) resolve(address[0]);
    };
    server.stdout.on('data', hear);
    server.stderr.on('data', hear);
    server.on('exit', () => reject(new Error(`kpsa view ended: ${said}`)));
  });
}

test('a live view moves points by sliders, and follows edits of the rig file', {skip}, async () => {
  const {page, requests, complaints} = await browser.open(await serve());
  const set = (name, value) => page.evaluate(async ([n, v]) => {
    await window.kpsa.setControl(n, v);
    return [...window.kpsa.positions('full')];
  }, [name, value]);
  const picture = () => page.locator('.stage canvas').screenshot();
  await page.evaluate(async () => {
    await window.kpsa.setMode('full');
    await window.kpsa.setFrame(0, null);
  });
  const before = await set('upper.rotateZ', 0), pictureBefore = await picture();
  const moved = await set('upper.rotateZ', -40), pictureAfter = await picture();
  const expected = evaluated('pose.npz', '--rest', '--set', 'upper.rotateZ=-40').frame(0);
  assert.ok(apart(moved, expected) < 1e-5, `${apart(moved, expected)} m from kpsa eval`);
  assert.ok(apart(moved, before) > 1e-2, 'the slider moves points');
  assert.ok(difference(pictureBefore, pictureAfter) > 0, 'and the picture');

  // Dragged in the picture, the column goes with the pointer, and its pose is that of the sliders
  await page.evaluate(() => window.kpsa.setControl('upper.rotateZ', 0));
  const from = await page.evaluate(() => window.kpsa.projectHandle(0)), to = {x: from.x + 70, y: from.y + 25};
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move(to.x, to.y, {steps: 12});
  await page.mouse.up();
  await settled(page);
  const at = await page.evaluate(() => window.kpsa.projectHandle(0));
  assert.ok(Math.hypot(at.x - to.x, at.y - to.y) < 2, `the handle is at ${at.x}, ${at.y}, the pointer at ${to.x}, ${to.y}`);
  const sliders = await page.evaluate(() => Object.fromEntries([...document.querySelectorAll('.control')].map((row) =>
    ['upper.' + row.querySelector('.name').textContent, Number(row.querySelector('input[type=range]').value)])));
  assert.ok(Math.abs(sliders['upper.rotateZ']) > 5);
  const posed = evaluated('dragged.npz', '--rest', ...Object.entries(sliders).flatMap(([plug, value]) => ['--set', `${plug}=${value}`])).frame(0);
  assert.ok(apart(await page.evaluate(() => [...window.kpsa.positions('full')]), posed) < 1e-5);
  await page.getByRole('button', {name: 'Reset'}).click();

  // A mistake in the file is told with its place, and the last good rig goes on
  const path = join(folder, 'hello.yaml'), good = readFileSync(path, 'utf8');
  writeFileSync(path, good.replace('type: deltaMush', 'type: deltaMash'));
  const problem = page.getByText(/hello\.yaml:\d+/).first();
  await problem.waitFor({timeout: 120000});
  assert.match(await page.locator('body').innerText(), /deltaMush/, 'with a suggestion');
  assert.ok(apart(await set('upper.rotateZ', -40), expected) < 1e-5, 'the last good rig goes on');
  writeFileSync(path, good);
  await problem.waitFor({state: 'hidden', timeout: 120000});
  assert.ok(requests.every((url) => url.startsWith('http://127.0.0.1:')), requests.join());
  assert.deepEqual(complaints, []);
});
