// The panels of a report, and what they have to do with the picture.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {pictureOf, settled, startAfresh, startBrowser, stateOf} from './support/browser.mjs';
import {makeCharacter} from './support/character.mjs';
import {makeMeta} from './support/meta.mjs';
import {difference} from './support/png.mjs';

const made = makeMeta(makeCharacter());
let browser, page, complaints;

before(async () => {
  browser = await startBrowser();
  ({page, complaints} = await browser.openReport(made));
});
after(async () => browser?.stop());

const picture = () => pictureOf(page), state = () => stateOf(page), fresh = () => startAfresh(page);

test('a click on a vertex lists what moves it, largest first, and its error', async () => {
  await fresh();
  const vertex = 44 * 34 + 22, at = await page.evaluate((v) => window.kpsa.project(v), vertex);
  await page.mouse.click(at.x, at.y);
  assert.equal((await state()).vertex, vertex);
  const panel = page.locator('#panel-vertex');
  await panel.getByText(`Vertex ${vertex} of sheet, at`).waitFor();
  await panel.locator('.bars li').first().waitFor();
  const names = await panel.locator('.bars .name').allInnerTexts();
  assert.deepEqual(names.slice(0, 1), ['bend']);
  assert.ok(names.includes('squash.weight') && !names.some((name) => name.includes('finger')));
  await panel.locator('canvas').first().waitFor();
  assert.match(await panel.locator('.chart').innerText(), /Error of vertex/);
});

test('picked vertices are a YAML list', async () => {
  await fresh();
  await page.keyboard.press('p');
  const vertices = [44 * 20 + 10, 44 * 25 + 30];
  for (const vertex of vertices) {
    const at = await page.evaluate((v) => window.kpsa.project(v), vertex);
    await page.mouse.click(at.x, at.y);
  }
  assert.equal(await page.getByLabel('Picked vertices as YAML').inputValue(), `vertices: [${vertices.join(', ')}]`);
  const field = page.getByLabel('Vertex', {exact: true}).and(page.locator('input'));
  await field.fill('1900');
  await field.press('Enter');
  assert.equal(await page.getByLabel('Picked vertices as YAML').inputValue(), `vertices: [${[...vertices, 1900].join(', ')}]`);
  await page.getByRole('button', {name: 'Clear'}).click();
  assert.equal(await page.getByLabel('Picked vertices as YAML').inputValue(), 'vertices: []');
  await page.getByRole('button', {name: 'Pick vertices'}).click();
});

test('the graph is searched by name', async () => {
  await page.getByRole('tab', {name: 'Graph'}).click();
  const panel = page.locator('#panel-graph');
  assert.equal(await panel.locator('tbody tr:visible').count(), 260);
  await panel.getByRole('searchbox').fill('mush');
  assert.equal(await panel.locator('tbody tr:visible').count(), 1);
  assert.equal(await panel.locator('.graph .node:not(.faint)').count(), 1);
  await panel.getByRole('searchbox').press('Enter');
  assert.match(await panel.locator('.details').innerText(), /delta_mush_final \(deltaMush\).*only a miss needs it/);
  await panel.getByRole('searchbox').fill('');
});

test('a drag of the graph that begins at a node chooses nothing', async () => {
  await page.evaluate(() => document.activeElement.blur());  // fields keep Escape
  await fresh();
  await page.locator('#panel-graph').getByRole('button', {name: 'Fit'}).click();
  const node = page.locator('#panel-graph .graph .node').nth(200), box = await node.boundingBox(), at = [box.x + box.width / 2, box.y + box.height / 2];
  const drag = async (by) => {
    await page.mouse.move(...at);
    await page.mouse.down();
    // back to where it began, over the same node
    for (const x of [by, 0]) await page.mouse.move(at[0] + x, at[1]);
    await page.mouse.up();
  };
  await drag(40);
  assert.equal((await state()).node, -1);
  await drag(2);
  assert.equal((await state()).node, 200);
  await page.keyboard.press('Escape');
});

test('where a vertex is follows the side that is shown', async () => {
  await fresh();
  await page.evaluate(() => window.kpsa.setFrame(26));
  await page.getByRole('tab', {name: 'Vertex'}).click();
  await page.getByLabel('Vertex', {exact: true}).and(page.locator('input')).fill('1650');
  await page.keyboard.press('Enter');
  for (const side of ['accelerated', 'full']) {
    await page.evaluate((mode) => window.kpsa.setMode(mode), side);
    const [x, y, z] = (await page.evaluate((s) => [...window.kpsa.positions(s)], side)).slice(4950, 4953).map((c) => c.toFixed(4));
    await page.getByText(`at ${x}, ${y}, ${z} m`).waitFor({timeout: 10000});
  }
});

test('tables sort, cues are marked', async () => {
  await page.getByRole('tab', {name: 'Tables'}).click();
  const table = page.locator('#panel-tables table').first();
  await table.getByRole('button', {name: 'speedup'}).click();
  assert.deepEqual(await table.locator('tbody tr td:first-child').allInnerTexts(), ['wave', 'all', 'bend']);
  await table.getByRole('button', {name: 'speedup'}).click();
  assert.deepEqual(await table.locator('tbody tr td:first-child').allInnerTexts(), ['bend', 'all', 'wave']);
  await fresh();
  await page.keyboard.press('z');
  await settled(page);
  const before = await picture();
  await page.getByRole('tab', {name: 'Cues'}).click();
  await page.locator('#panel-cues tbody tr').nth(4).click();
  await settled(page);
  assert.ok(difference(before, await picture()) > 1e-4);
  assert.match(await page.locator('#panel-cues .details').innerText(), /point, at sheet@skin, 0\.6 µs of a frame, the bend of the spine/);
  const vertex = made.meta.cues[6].vertex, at = await page.evaluate((v) => window.kpsa.project(v), vertex);
  await page.mouse.move(at.x, at.y);
  await page.locator('.cue-hint:visible').waitFor();
  assert.match(await page.locator('.cue-hint').innerText(), new RegExp(`points\\[${vertex}\\]`));
});

test('fields and moves are colours', async () => {
  await fresh();
  const before = await picture();
  await page.getByLabel('Colours', {exact: true}).selectOption({label: 'spine'});
  await settled(page);
  const field = await picture();
  assert.ok(difference(before, field) > 0.05);
  await page.getByLabel('Colours', {exact: true}).selectOption({label: 'twist'});
  await settled(page);
  assert.ok(difference(field, await picture()) > 0.05);
});

test('a vertex is chosen by its index, without a mouse', async () => {
  await fresh();
  await page.getByRole('tab', {name: 'Vertex'}).click();
  await page.getByLabel('Vertex', {exact: true}).and(page.locator('input')).fill('1900');
  await page.keyboard.press('Enter');
  assert.equal((await state()).vertex, 1900);
  const [x, y, z] = (await page.evaluate(() => [...window.kpsa.positions()])).slice(5700, 5703).map((c) => c.toFixed(4));
  await page.getByText(`Vertex 1900, 96 of knob, at ${x}, ${y}, ${z} m`).waitFor();
});

test('nothing is complained of', async () => {
  assert.deepEqual(complaints, []);
  assert.deepEqual(await page.evaluate(() => window.kpsa.errors), []);
});
