// What the program writes and serves, in the page: the bundled column, trained, as a report and live. KPSA is the program,
// KPSA_SCENES the folder scenes/; without them these tests are skipped.
import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {copyFileSync, cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
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
  return evaluatedOf('hello.yaml', name, ...words);
}

/** Of the mesh that has most points. */
function evaluatedOf(rig, name, ...words) {
  run('eval', rig, ...words, '-o', name, '--force', '-q');
  const [mesh] = Object.entries(readNpz(readFileSync(join(folder, name)))).filter(([key]) => key !== 'times').map(([, array]) => array).sort((a, b) => b.shape[1] - a.shape[1]);
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

async function serve(...words) {
  server = spawn(KPSA, ['view', ...words], {cwd: folder, stdio: ['ignore', 'pipe', 'pipe']});
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
  const {page, requests, complaints} = await browser.open(await serve('hello.yaml', '--accelerate'));
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

// Of scenes/face, as accessibility tools read it: whoever opens the report has no code and no picture to go by
test('a report says in words what was skipped, how large the error is, where and when', {skip, timeout: 600000}, async () => {
  cpSync(join(KPSA_SCENES, 'face'), folder, {recursive: true});
  run('train', 'face.yaml', '--samples', '150', '--calibration', '60', '--force', '-q');
  run('report', 'face.yaml', '-o', 'face.html', '--runs', '1', '-q');
  const {page, complaints} = await browser.open('file://' + join(folder, 'face.html'));
  const panel = page.getByRole('tabpanel', {name: 'Summary'});
  await panel.getByText(/vertex \d+ of/).waitFor();
  const said = (await panel.innerText()).replace(/\s+/g, ' '), tree = await panel.ariaSnapshot();
  const {nodes, clips, tolerance} = await page.evaluate(() => JSON.parse(document.getElementById('kpsa-meta').textContent));

  const never = nodes.filter((node) => node.state === 'never run');
  assert.ok(never.length > 0, 'something is skipped');
  assert.ok(said.includes(`${never.length} node`), said);
  for (const {name} of never.slice(0, 20)) assert.ok(tree.includes(name), `${name} never runs, and is not named`);

  const [clip] = clips, most = Math.max(...clip.max_error), frame = clip.max_error.indexOf(most);
  const [, told, vertex, inFrame, inClip] = /At most ([\d.]+) mm.* at vertex (\d+) of \S+, .*in frame (\d+) of (\w+)\./.exec(said);
  assert.ok(Math.abs(Number(told) / 1000 - most) < 0.006 * most, `${told} mm of ${most}`);
  assert.deepEqual([Number(inFrame), inClip], [frame, clip.name]);
  const [, rms] = /RMS ([\d.]+) mm/.exec(said);
  assert.ok(Number(rms) > 0 && Number(rms) / 1000 < most);
  assert.ok(said.includes(`tolerance of ${Number((tolerance * 1000).toPrecision(3))} mm`));
  // and it is so
  const full = evaluatedOf('face.yaml', 'full.npz', '--clip', clip.name).frame(frame), fast = evaluatedOf('face.yaml', 'fast.npz', '--clip', clip.name, '--accelerate').frame(frame);
  const off = (v) => Math.hypot(full[3 * v] - fast[3 * v], full[3 * v + 1] - fast[3 * v + 1], full[3 * v + 2] - fast[3 * v + 2]);
  assert.ok(Math.abs(off(Number(vertex)) - most) < tolerance / 8, `${off(Number(vertex))} m there, ${most} at most`);
  assert.match(said, /where the joint \S+ has most weight/);
  assert.match(said, /\d+ of \d+ frames \([\d.]+ %\) were hits/);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a face is posed by sliders alone, by keys', {skip, timeout: 240000}, async () => {
  cpSync(join(KPSA_SCENES, 'face'), folder, {recursive: true});
  server?.kill('SIGINT');
  const {page, complaints} = await browser.open(await serve('face.yaml'));
  await page.evaluate(() => window.kpsa.setFrame(0, null));
  const before = await page.evaluate(() => [...window.kpsa.positions('full')]);
  const slider = page.getByRole('slider', {name: 'jaw.rotateX'});
  await slider.focus();
  for (let i = 0; i < 30; ++i) await page.keyboard.press('ArrowRight');
  await settled(page);
  const value = Number(await slider.inputValue()), after = await page.evaluate(() => [...window.kpsa.positions('full')]);
  assert.ok(value > 6, `${value}`);
  assert.ok(apart(after, before) > 5e-3, 'the jaw opens');
  const expected = evaluatedOf('face.yaml', 'jaw.npz', '--rest', '--set', `jaw.rotateX=${value}`).frame(0);
  assert.ok(apart(after.slice(0, expected.length), expected) < 1e-5);
  assert.deepEqual(complaints, []);
});
