// The page as a report: one file from disk.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {pictureOf, settled, startAfresh, startBrowser, stateOf} from './support/browser.mjs';
import {makeCharacter, makeErrors, residualStep} from './support/character.mjs';
import {makeMeta} from './support/meta.mjs';
import {difference, share} from './support/png.mjs';

const character = makeCharacter(), made = makeMeta(character);
let browser, page, requests, complaints;

before(async () => {
  browser = await startBrowser();
  ({page, requests, complaints} = await browser.openReport(made));
});
after(async () => browser?.stop());

const picture = () => pictureOf(page), state = () => stateOf(page), fresh = () => startAfresh(page);

/** The largest difference of two lists of places, relative to their size. */
function apart(got, expected) {
  assert.equal(got.length, expected.length);
  let most = 0, size = 0;
  for (let i = 0; i < got.length; ++i) {
    most = Math.max(most, Math.abs(got[i] - expected[i]));
    size = Math.max(size, Math.abs(expected[i]));
  }
  return most / size;
}

async function positionsAt(on, frame, clip, side) {
  return on.evaluate(async ([f, c, s]) => {
    await window.kpsa.setFrame(f, c);
    return [...window.kpsa.positions(s)];
  }, [frame, clip, side]);
}

test('positions are those of the subspace', async () => {
  for (const [frame, clip, row] of [[0, 'bend', 0], [17, 'bend', 17], [22, 'bend', 22], [29, 'wave', 69]]) {
    const got = await positionsAt(page, frame, clip, 'accelerated'), expected = character.place(character.rowOf(row));
    const off = apart(got, expected);
    assert.ok(off < 1e-6, `frame ${frame} of ${clip}: ${off}`);
    assert.ok(apart(got, character.rest) > 1e-2, 'it is not just the rest pose');
  }
});

test('full positions are the accelerated ones and the residual', async () => {
  const {residual} = makeErrors(character, 0), frame = 7, n = character.points * 3;
  const expected = character.place(character.rowOf(frame)).map((x, i) => x + residual[frame * n + i] * residualStep);
  assert.ok(apart(await positionsAt(page, frame, 'bend', 'full'), expected) < 1e-6);
  const miss = await positionsAt(page, 21, 'bend', 'full');
  assert.ok(apart(miss, character.place(character.rowOf(21))) < 1e-6, 'a miss is exact');
});

test('a basis of 16 bits, and rows of the residual that are absent', async () => {
  const wide = makeCharacter({wide: true, modes: 11}), report = makeMeta(wide);
  const clip = report.meta.clips[0], n = wide.points * 3;
  clip.residual.rows = clip.verdicts.map((v, f) => f === 5 ? 0 : -1);
  clip.max_error[7] = 0;
  report.arrays['residual-0'] = Int16Array.from(report.arrays['residual-0'].subarray(5 * n, 6 * n));
  report.meta.blobs['residual-0'] = {type: 'i16', count: n, deflate: true};
  const other = await browser.openReport(report, 'wide.html');
  const expected = wide.place(wide.rowOf(5));
  assert.ok(apart(await positionsAt(other.page, 5, 'bend', 'accelerated'), expected) < 1e-6);
  const full = expected.map((x, i) => x + report.arrays['residual-0'][i] * residualStep);
  assert.ok(apart(await positionsAt(other.page, 5, 'bend', 'full'), full) < 1e-6);
  assert.equal(await other.page.evaluate(() => window.kpsa.facts.unknown), false);
  await positionsAt(other.page, 6, 'bend', 'full');
  assert.equal(await other.page.evaluate(() => window.kpsa.facts.unknown), true);
  await positionsAt(other.page, 7, 'bend', 'full');
  assert.equal(await other.page.evaluate(() => window.kpsa.facts.unknown), false, 'its error is 0');
  await other.page.close();
});

test('a residual of 8 bits, one of 16, and the first again', async () => {
  const report = makeMeta(character), n = character.points * 3;
  const wide = Int16Array.from({length: 30 * n}, (_, i) => 200 + i % 1000);
  report.arrays['residual-1'] = wide;
  report.meta.blobs['residual-1'].type = 'i16';
  const other = await browser.openReport(report, 'both.html');
  const narrow = report.arrays['residual-0'];
  for (const [clip, row, values] of [['bend', 0, narrow], ['wave', 40, wide], ['bend', 0, narrow]]) {
    await other.page.waitForFunction(async (name) => {
      await window.kpsa.setFrame(5, name);
      return !window.kpsa.facts.unknown;
    }, clip);
    const expected = character.place(character.rowOf(row + 5)).map((x, i) => x + values[5 * n + i] * residualStep);
    const off = apart(await positionsAt(other.page, 5, clip, 'full'), expected);
    assert.ok(off < 1e-6, `${clip}: ${off}`);
  }
  assert.deepEqual(other.complaints, []);
  await other.page.close();
});

test('the clock of playing', async () => {
  await fresh();
  const seen = await page.evaluate(() => {
    const {requestAnimationFrame: ask, cancelAnimationFrame: cancel} = window, waiting = new Map();
    let last = 0;
    window.requestAnimationFrame = (call) => waiting.set(++last, call) && last;
    window.cancelAnimationFrame = (id) => waiting.delete(id);
    const picture = (now) => {
      const due = [...waiting.values()];
      waiting.clear();
      for (const call of due) call(now);
      return window.kpsa.state.frame;
    };
    const press = (key) => document.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
    const began = performance.now(), found = {};
    press(' ');
    found.early = picture(began - 100);
    found.third = picture(began + 1000 * 40 / 24 * 2.5);
    press('l');
    found.unlooped = picture(began + 1000 * 40 / 24 * 2.5 + 1);
    found.playing = window.kpsa.state.playing;
    press('l');
    press(' ');
    press(' ');
    for (let i = 0; i < 3; ++i) picture(began);
    found.ticks = waiting.size;
    press(' ');
    while (waiting.size) picture(began);
    Object.assign(window, {requestAnimationFrame: ask, cancelAnimationFrame: cancel});
    return found;
  });
  assert.ok(seen.early === 0 && seen.third >= 17 && seen.third <= 20, JSON.stringify(seen));
  assert.ok(seen.playing && seen.unlooped >= 17 && seen.unlooped <= 20, `looping ends at the end of a round: ${JSON.stringify(seen)}`);
  assert.equal(seen.ticks, 1);
});

test('the slider moves points, in state and picture', async () => {
  await fresh();
  const before = await picture(), points = await page.evaluate(() => [...window.kpsa.positions()]);
  assert.ok(difference(before, await picture()) < 1e-4, 'nothing changes by itself');
  await page.getByRole('slider', {name: 'Frame'}).fill('13');
  assert.equal((await state()).frame, 13);
  await settled(page);
  assert.ok(difference(before, await picture()) > 0.01);
  assert.ok(apart(await page.evaluate(() => [...window.kpsa.positions()]), points) > 1e-3);
});

test('modes are different pictures; the heat map shows what is over the tolerance', async () => {
  await fresh();
  await page.evaluate(() => window.kpsa.setFrame(26));
  const pictures = {};
  for (const mode of ['full', 'accelerated', 'difference', 'overlay']) {
    await page.getByRole('button', {name: mode, exact: false}).first().click();
    await page.mouse.move(5, 5);
    await settled(page);
    pictures[mode] = await picture();
    assert.equal((await state()).mode, mode);
  }
  const modes = Object.keys(pictures);
  for (const a of modes) for (const b of modes) if (a < b) assert.ok(difference(pictures[a], pictures[b]) > 0.002, `${a} and ${b}`);
  const hot = (r, g, b) => r > 150 && g < 0.72 * r && b < 0.55 * r;
  await page.evaluate(async () => {
    await window.kpsa.setMode('difference');
    await window.kpsa.setFrame(26);
  });
  const over = share(await picture(), hot);
  await page.evaluate(() => window.kpsa.setFrame(22));
  const exact = share(await picture(), hot);
  assert.ok(over > exact + 0.002, `${over} of a bad frame is hot, ${exact} of an exact one`);
  assert.match(await page.locator('.legend').innerText(), /tolerance 2 mm/);
  assert.ok(await page.locator('.legend-line').isVisible());
  await page.getByLabel('What the colours span').selectOption({index: 0});
  assert.ok(await page.locator('.legend-line').isHidden(), 'the tolerance is beyond the scale');
  await page.getByLabel('What the colours span').selectOption({index: 3});
});

test('keys', async () => {
  await fresh();
  await page.keyboard.press('3');
  assert.equal((await state()).mode, 'difference');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowLeft');
  assert.equal((await state()).frame, 1);
  await page.keyboard.press('End');
  assert.equal((await state()).frame, 39);
  await page.keyboard.press(']');
  assert.equal((await state()).clipName, 'wave');
  await page.keyboard.press('[');
  await page.keyboard.press('Home');
  await page.keyboard.press(' ');
  await page.waitForFunction(() => window.kpsa.state.playing && window.kpsa.state.frame > 2);
  await page.keyboard.press(' ');
  assert.equal((await state()).playing, false);
  await page.keyboard.press('1');
  const before = await picture();
  await page.keyboard.press('Shift+ArrowLeft');
  await settled(page);
  assert.ok(difference(before, await picture()) > 0.01, 'turned');
  const was = await page.evaluate(() => document.documentElement.dataset.theme);
  await page.keyboard.press('t');
  assert.notEqual(await page.evaluate(() => document.documentElement.dataset.theme), was);
  await page.keyboard.press('t');
  await page.keyboard.press('?');
  assert.ok(await page.getByRole('dialog').isVisible());
  await page.keyboard.press('?');
  assert.ok(await page.locator('dialog').isHidden());
  await page.keyboard.press('z');
  await page.keyboard.press('f');
  const {loop} = await state();
  await page.keyboard.press('L');  // as Caps Lock makes it
  assert.equal((await state()).loop, !loop);
  await page.keyboard.press('L');
});

test('the strip says hit, blend or miss, and why', async () => {
  await fresh();
  const strip = page.locator('.strip'), box = await strip.boundingBox();
  await strip.hover({position: {x: (21.5 / 40) * box.width, y: 5}});
  assert.match(await page.locator('.track .hint').innerText(), /frame 21 - miss - bend.rotateX is outside/);
  await strip.click({position: {x: (18.5 / 40) * box.width, y: 5}});
  assert.equal((await state()).frame, 18);
  assert.match(await page.locator('.status').innerText(), /blend[\s\S]*bent farther than the trained poses/);
  await page.evaluate(() => window.kpsa.setFrame(3));
  assert.match(await page.locator('.status').innerText(), /hit[\s\S]*max 1\.\d+ mm/);
});

test('the title is text, not markup', async () => {
  assert.equal(await page.title(), made.meta.title);
  assert.equal(await page.locator('h1').innerText(), made.meta.title);
});

test('a rig without acceleration shows full only, and no empty panel', async () => {
  const report = makeMeta(makeCharacter(), {accelerated: false});
  const other = await browser.openReport(report, 'full.html');
  assert.deepEqual(await other.page.getByRole('tab').allInnerTexts(), ['Controls', 'Graph', 'Tables', 'Vertex']);
  assert.equal(await other.page.getByRole('button', {name: 'Difference'}).count(), 0);
  assert.ok(await other.page.locator('.strip').isHidden());
  const bare = {format: 1, points: report.meta.points, blobs: report.meta.blobs, meshes: report.meta.meshes, rest: 'rest'};
  const least = await browser.openReport({meta: bare, arrays: report.arrays}, 'bare.html');
  assert.deepEqual(await least.page.getByRole('tab').allInnerTexts(), ['Vertex']);
  assert.equal(await least.page.getByRole('slider').count(), 0);
  assert.deepEqual([...other.complaints, ...least.complaints], []);
  await other.page.close();
  await least.page.close();
});

test('what does not keep to the contract is refused with a message', async () => {
  const faults = [
    [(meta) => { meta.format = 2; }, /format 2/],
    [(meta) => { meta.clips[1].first_row = 41; }, /clip wave asks for rows beyond the 70/],
    [(meta) => { meta.blobs.rest.count += 1; }, /blob rest has \d+ bytes, not \d+/],
    [(meta) => { meta.blobs.rest.count -= 1; }, /blob rest has more than \d+ bytes/],
    [(meta) => { meta.blobs.rest.count = 1e12; }, /blob rest cannot have \d+ bytes/],
    [(meta) => { meta.blobs.rest.count = -1; }, /blob rest has no type or count/],
    [(meta) => { meta.shape.basis = 'gone'; }, /there is no blob gone/],
    [(meta) => { meta.clips[0].frames = 1e9; }, /clip bend has 1000000000 frames/],
    [(meta) => { meta.clips[0].frames = 2.5; }, /clip bend has 2.5 frames/],
    [(meta) => { meta.clips[0].fps = 0; }, /clip bend has 0 frames a second/],
    [(meta) => { meta.clips[0].first_row = -1; }, /clip bend has first_row -1/],
    [(meta) => { meta.clips[0].residual.rows = [0]; }, /clip bend has 1 rows of a residual for 40 frames/],
    [(meta) => { meta.clips[0].residual.rows = meta.clips[0].verdicts.map(() => 40); }, /clip bend has row 40 of a residual that has 40/],
    [(meta) => { meta.clips[0].residual.rows = meta.clips[0].verdicts.map(() => -2); }, /clip bend has row -2/],
    [(meta) => { meta.clips[0].residual.blob = 'residual-1'; }, /clip bend has 40 frames, and its residual has 30/],
  ];
  for (const [change, message] of faults) {
    const report = makeMeta(makeCharacter());
    change(report.meta);
    await assert.rejects(browser.openReport(report, 'other.html'), message);
  }
});

test('no request leaves the page, and nothing is complained of', async () => {
  assert.ok(requests.length >= 1 && requests.every((url) => url.startsWith('file://') || url.startsWith('data:')), requests.join('\n'));
  assert.deepEqual(complaints, []);
  assert.deepEqual(await page.evaluate(() => window.kpsa.errors), []);
});
