// What somebody reads who has never seen the rig: how far off, where and when, how often, what was skipped; and legends by keys.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {settled, startBrowser, stateOf} from './support/browser.mjs';
import {makeCharacter, makeErrors, residualStep} from './support/character.mjs';
import {makeMeta} from './support/meta.mjs';

const character = makeCharacter(), made = makeMeta(character);
let browser, page, complaints;

before(async () => {
  browser = await startBrowser();
  ({page, complaints} = await browser.openReport(made));
});
after(async () => browser?.stop());

/** The vertex that is farthest off in a frame of a clip. */
function worstOf(clip, frame) {
  const {residual} = makeErrors(character, clip), n = character.points * 3;
  let most = 0, found = -1;
  for (let v = 0; v < character.points; ++v) {
    const size = Math.hypot(...residual.subarray(frame * n + 3 * v, frame * n + 3 * v + 3)) * residualStep;
    if (size > most + 1e-12) [most, found] = [size, v];
  }
  return {vertex: found, metres: most};
}

test('the summary is what is seen first, and says it in words', async () => {
  assert.equal(await page.getByRole('tab', {selected: true}).innerText(), 'Summary');
  const panel = page.getByRole('tabpanel', {name: 'Summary'});
  await panel.getByText(/vertex \d+ of/).waitFor();
  const said = await panel.ariaSnapshot(), text = await panel.innerText();
  const errors = made.meta.clips.flatMap((clip, c) => clip.max_error.map((metres, frame) => ({clip, c, frame, metres}))), worst = errors.reduce((a, b) => b.metres > a.metres ? b : a);
  const {vertex} = worstOf(worst.c, worst.frame), mesh = vertex < character.sheet.count ? ['sheet', vertex] : ['knob', vertex - character.sheet.count];
  const mm = (metres) => `${Number((metres * 1000).toPrecision(3))} mm`;
  assert.ok(text.includes(`At most ${mm(worst.metres)}`), text);
  assert.ok(text.includes(`vertex ${mesh[1]} of ${mesh[0]}, in frame ${worst.frame} of ${worst.clip.name}`), text);
  const rms = Math.sqrt(made.meta.clips.flatMap((clip) => clip.rms_error).reduce((sum, e, _, all) => sum + e * e / all.length, 0));
  assert.ok(text.includes(`RMS ${mm(rms)}`), text);
  const verdicts = made.meta.clips.flatMap((clip) => clip.verdicts), hits = verdicts.filter((v) => v === 0).length, misses = verdicts.filter((v) => v === 2).length;
  assert.ok(text.includes(`${hits} of ${verdicts.length} frames`) && text.includes(`${misses} were misses`), text);
  assert.match(text, /frames?: bend\.rotateX is outside its trained range/);
  const state = (name) => made.meta.nodes.filter((node) => node.state === name).length;
  assert.ok(text.includes(`${state('never run')} nodes never run on a hit`), text);
  assert.ok(text.includes(`${state('switched off')} nodes are switched off`));
  assert.ok(said.includes('delta_mush_final'), 'what never ran is named');
  assert.match(said, /heading "What was skipped"/);
});

test('it shows what it tells of', async () => {
  await page.getByRole('button', {name: 'Show it'}).click();
  await settled(page);
  const {mode, vertex, clipName, frame} = await stateOf(page), {vertex: worst} = worstOf(made.meta.clips.findIndex((clip) => clip.name === clipName), frame);
  assert.equal(mode, 'difference');
  assert.equal(vertex, worst);
  assert.equal(await page.evaluate(() => window.kpsa.facts.max_error), Math.max(...made.meta.clips.flatMap((clip) => clip.max_error)));
  await page.getByRole('button', {name: 'delta_mush_final'}).click();
  assert.equal(await page.getByRole('tab', {selected: true}).innerText(), 'Graph');
  assert.match(await page.locator('.graph-panel .details').innerText(), /delta_mush_final/);
});

test('without errors, reasons or states there is no sentence about them', async () => {
  const {meta, arrays} = makeMeta(character), bare = structuredClone(meta);
  for (const clip of bare.clips) for (const key of ['max_error', 'rms_error', 'residual', 'verdicts', 'reasons']) delete clip[key];
  for (const node of bare.nodes) delete node.state;
  const other = await browser.openReport({meta: bare, arrays}, 'bare.html');
  const text = await other.page.getByRole('tabpanel', {name: 'Summary'}).innerText();
  assert.ok(text.includes('times as fast') && !/How far|How often|skipped/.test(text), text);
  for (const clip of bare.clips) Object.assign(clip, {max_error: new Array(clip.frames).fill(0), rms_error: new Array(clip.frames).fill(0)});
  const exact = await browser.openReport({meta: bare, arrays}, 'exact.html');
  assert.match(await exact.page.getByRole('tabpanel', {name: 'Summary'}).innerText(), /no point of any frame differs/);
  await other.page.close();
  await exact.page.close();
});

test('lines of plots are hidden and shown by keys', async () => {
  await page.getByRole('tab', {name: 'Plots'}).click();
  const chart = page.getByRole('figure', {name: /^Error/}), line = chart.getByRole('button', {name: 'rms, shown'});
  const picture = () => chart.locator('canvas').screenshot();
  await line.waitFor();
  await settled(page);
  const before = await picture();
  await line.focus();
  await page.keyboard.press('Space');
  assert.equal(await line.getAttribute('aria-pressed'), 'false');
  assert.ok(!(await picture()).equals(before));
  assert.equal(await page.evaluate(() => window.kpsa.state.playing), false, 'Space is the legend\'s');
  await page.keyboard.press('Enter');
  assert.equal(await line.getAttribute('aria-pressed'), 'true');
});

test('the line at the frame is over the plot, and the legend has its values', async () => {
  const chart = page.getByRole('figure', {name: /^Error/}), line = chart.locator('.chart-line');
  const at = async (frame) => {
    await page.evaluate((f) => window.kpsa.setFrame(f, 'bend'), frame);
    await settled(page);
    return [(await chart.locator('.chart-line').boundingBox()).x, await chart.locator('.u-legend').innerText()];
  };
  const box = await chart.locator('.u-over').boundingBox(), [left, first] = await at(0), [middle] = await at(20), [right, last] = await at(39);
  assert.ok(Math.abs(left + 1 - box.x) < 2 && Math.abs(right + 1 - box.x - box.width) < 2, `${left} ${right} ${box.x} ${box.width}`);
  assert.ok(Math.abs((middle - left) / (right - left) - 20 / 39) < 0.01);
  assert.notEqual(first, last);
  assert.match(last, /39/);
  assert.equal(await line.count(), 1);
});

test('nothing was complained of', () => assert.deepEqual(complaints, []));
