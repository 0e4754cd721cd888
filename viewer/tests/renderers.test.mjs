// Both ways to draw: they show the same, and each is used where it should be.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {pictureOf, settled, startBrowser} from './support/browser.mjs';
import {makeCharacter} from './support/character.mjs';
import {makeMeta} from './support/meta.mjs';
import {difference} from './support/png.mjs';
import {makeReport} from './support/report.mjs';

let browser, address;
before(async () => {
  browser = await startBrowser({width: 1000, height: 700});
  address = browser.write('report.html', makeReport(makeMeta(makeCharacter())));
});
after(async () => browser?.stop());

const open = (renderer) => browser.open(`${address}?renderer=${renderer}`);
const isWebGl = (page) => page.evaluate(() => document.querySelector('.stage canvas').getContext('webgl2') !== null);

test('the processor draws what a GPU draws', async () => {
  const pages = [await open('software'), await open('webgl')];
  assert.deepEqual(await Promise.all(pages.map(({page}) => isWebGl(page))), [false, true]);
  const pictures = {};
  const take = async (name, change) => {
    pictures[name] = [];
    for (const {page} of pages) {
      await page.bringToFront();  // what is behind another page draws once a second
      await page.evaluate(() => window.kpsa.setFrame(26, 'bend'));
      await change(page);
      await page.evaluate(() => document.activeElement?.blur());
      await settled(page);
      pictures[name].push(await pictureOf(page));
    }
  };
  for (const mode of ['full', 'accelerated', 'difference', 'overlay']) await take(mode, (page) => page.evaluate((m) => window.kpsa.setMode(m), mode));
  await take('field', async (page) => {
    await page.evaluate(() => window.kpsa.setMode('full'));
    await page.getByLabel('Colours', {exact: true}).selectOption('field:spine');
  });
  await take('cues', (page) => page.keyboard.press('c'));
  await take('turned', async (page) => {
    for (let i = 0; i < 12; ++i) await page.keyboard.press('Shift+ArrowLeft');  // its back
  });
  await take('near', async (page) => { for (let i = 0; i < 10; ++i) await page.keyboard.press('+'); });
  // edges of triangles are smoothed by one of them and not by the other, so lines are not compared
  // nor, in the overlay, which of two surfaces is nearer where they hardly differ
  for (const [name, [software, webgl]] of Object.entries(pictures)) {
    assert.ok(difference(software, webgl) < (name === 'overlay' ? 0.05 : 0.008), `${name}: ${difference(software, webgl)}`);
  }
  for (const name of ['accelerated', 'difference', 'field', 'turned', 'near']) assert.ok(difference(pictures[name][0], pictures.overlay[1]) > 0.03, `${name} is another picture`);
  assert.ok(difference(pictures.field[0], pictures.cues[1]) > 0.001, 'cues are another picture');
  const [one, other] = await Promise.all(pages.map(({page}) => page.evaluate(() => [...window.kpsa.positions('full')])));
  assert.deepEqual(one, other);
  for (const {page, complaints} of pages) {
    assert.deepEqual(complaints, []);
    await page.close();
  }
});

test('hidden edges are hidden', async () => {
  for (const renderer of ['software', 'webgl']) {
    const {page} = await open(renderer), shares = [];
    await page.evaluate(() => window.kpsa.setMode('full'));
    for (let i = 0; i < 2; ++i) {
      const before = await pictureOf(page);
      await page.keyboard.press('e');
      await settled(page);
      shares.push(difference(before, await pictureOf(page)));
      await page.keyboard.press('e');
      // nearer: the same edges, further apart
      for (let n = 0; n < 5; ++n) await page.keyboard.press('+');
      await settled(page);
    }
    assert.ok(shares[0] > 0.01 && shares[1] < 4 * shares[0], `${renderer}: ${shares}`);
    await page.close();
  }
});

test('without a GPU the processor draws, and without WebGL at all', async () => {
  const {page} = await browser.open(address);
  assert.equal(await isWebGl(page), false, 'this browser has SwiftShader');
  const context = page.context(), bare = await context.newPage();
  await bare.addInitScript(() => {
    const {getContext} = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) { return kind === '2d' ? getContext.call(this, kind, ...more) : null; };
  });
  await bare.goto(address);
  await bare.evaluate(() => window.kpsa.ready);
  assert.equal(difference(await pictureOf(page), await pictureOf(bare)), 0);
  await bare.close();
  await page.close();
});

test('a lost picture comes back', async () => {
  const {page} = await open('webgl');
  await page.evaluate(() => window.kpsa.setFrame(9));
  const before = await pictureOf(page), points = await page.evaluate(() => [...window.kpsa.positions()]);
  await page.evaluate(async () => {
    const canvas = document.querySelector('.stage canvas'), lose = canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
    const heard = (name) => new Promise((resolve) => canvas.addEventListener(name, () => setTimeout(resolve, 50), {once: true}));
    const lost = heard('webglcontextlost');
    lose.loseContext();
    await lost;
    const restored = heard('webglcontextrestored');
    lose.restoreContext();
    await restored;
  });
  await settled(page);
  assert.ok(difference(before, await pictureOf(page)) < 1e-4);
  assert.deepEqual(await page.evaluate(() => [...window.kpsa.positions()]), points);
  await page.close();
});
