// Handles in the picture of a live view: what is held goes with the pointer.
import assert from 'node:assert/strict';
import {after, before, beforeEach, test} from 'node:test';
import {settled, startBrowser} from './support/browser.mjs';
import {share} from './support/png.mjs';
import {startServer} from './support/server.mjs';

let browser, server, page, complaints;

before(async () => {
  server = await startServer();
  browser = await startBrowser();
  ({page, complaints} = await browser.open(server.url));
});
after(async () => {
  await browser?.stop();
  await server?.stop();
});
beforeEach(async () => {
  await page.mouse.move(2, 2);
  await page.getByRole('tab', {name: 'Controls'}).click();
  await page.getByRole('button', {name: 'Reset'}).click();
  await settled(page);
});

const place = () => page.evaluate(() => window.kpsa.projectHandle(0));
const bent = () => server.last.set['bend.rotateX'] ?? 0;
const hint = () => page.locator('.stage > .hint:not(.cue-hint)');
const camera = () => page.evaluate(() => window.kpsa.project(100));

/** Presses on the handle, some pixels off its middle, and goes on to a place relative to it. */
async function drag(dx, dy, {off = 0, steps = 8} = {}) {
  const at = await place();
  await page.mouse.move(at.x + off, at.y + off);
  await page.mouse.down();
  await page.mouse.move(at.x + off + dx, at.y + off + dy, {steps});
  await settled(page);
  return at;
}

test('a handle goes with the pointer, and its slider with it', async () => {
  const eye = await camera(), before = await drag(0, -60, {off: 4});
  const held = await place();
  assert.ok(Math.abs(held.y - (before.y - 60)) < 1.5, `${held.y} of ${before.y - 60}`);
  await page.mouse.up();
  await settled(page);
  assert.ok(bent() !== 0 || server.last.drag, 'the program was asked');
  const told = Number(await page.getByRole('slider', {name: 'bend'}).inputValue());
  assert.ok(told > 3, `${told}`);
  assert.ok(Math.abs((await place()).y - held.y) < 0.5, 'it stays when it is let go');
  assert.deepEqual(await camera(), eye, 'the camera stays');
  assert.equal(await page.evaluate(() => window.kpsa.state.vertex), -1, 'no vertex was chosen');
  // what was dragged is moved: it is asked for by itself
  await page.evaluate(() => window.kpsa.setControl('twist.rotateY', 3));
  assert.ok(Math.abs(bent() - told) < 1e-3 && !server.last.drag);
});

test('it stops where its range ends', async () => {
  await drag(0, -400);
  await page.mouse.up();
  await settled(page);
  assert.equal(Number(await page.getByRole('slider', {name: 'bend'}).inputValue()), 60);
});

test('one place of the pointer is asked for at a time, and the newest one wins', async () => {
  let release;
  server.held = new Promise((resolve) => { release = resolve; });
  server.mostInFlight = 0;
  const asked = () => server.log.filter((entry) => entry.path === '/evaluate').length, begin = asked(), at = await place();
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x, at.y - 50, {steps: 25});
  server.held = null;
  release();
  await settled(page);
  await page.mouse.up();
  assert.equal(server.mostInFlight, 1);
  assert.ok(asked() - begin <= 3, `${asked() - begin} requests for 25 moves`);
  assert.ok(Math.abs((await place()).y - (at.y - 50)) < 1.5);
});

test('Escape takes a drag back', async () => {
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 10));
  await drag(0, -40);
  assert.ok(Number(await page.getByRole('slider', {name: 'bend'}).inputValue()) > 12);
  await page.keyboard.press('Escape');
  await settled(page);
  assert.equal(bent(), 10);
  await page.mouse.move(300, 300, {steps: 3});
  await page.mouse.up();
  await settled(page);
  assert.equal(bent(), 10, 'and is over');
});

test('a drag is one step to undo, and so is a slider; Escape leaves none', async () => {
  const undo = page.getByRole('button', {name: 'Undo'}), redo = page.getByRole('button', {name: 'Redo'});
  while (await undo.isEnabled()) {
    await undo.click();
    await settled(page);
  }
  assert.deepEqual(server.last.set, {});
  await page.getByRole('slider', {name: 'twist'}).focus();
  for (let i = 0; i < 5; ++i) await page.keyboard.press('ArrowRight');
  await settled(page);
  const {'twist.rotateY': twist} = server.last.set;
  await drag(0, -40, {steps: 12});
  await page.mouse.up();
  await settled(page);
  await page.evaluate(() => document.activeElement?.blur());
  const told = Number(await page.getByRole('slider', {name: 'bend'}).inputValue());
  await drag(0, 30);
  await page.keyboard.press('Escape');
  await page.mouse.up();
  await settled(page);
  assert.ok(Math.abs(bent() - told) < 1e-3);
  await page.keyboard.press('Control+z');
  await settled(page);
  assert.deepEqual(server.last.set, {'twist.rotateY': twist}, 'before the drag');
  await undo.click();
  await settled(page);
  assert.deepEqual(server.last.set, {}, 'before the slider');
  assert.ok(await undo.isDisabled());
  await page.evaluate(() => document.activeElement?.blur());
  await page.keyboard.press('Control+Shift+Z');
  await redo.click();
  await settled(page);
  assert.ok(Math.abs(bent() - told) < 1e-3 && server.last.set['twist.rotateY'] === twist);
  assert.ok(await redo.isDisabled());
  await page.keyboard.press('Control+y');
  assert.match(await page.locator('.toast').innerText(), /nothing to redo/);
});

test('a double click goes to the default', async () => {
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 20));
  const at = await place();
  await page.mouse.dblclick(at.x, at.y);
  await settled(page);
  assert.ok(!('bend.rotateX' in server.last.set));
});

test('the pointer over a handle is told its name and values, and a click shows its sliders', async () => {
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 12));
  await page.getByRole('tab', {name: 'Graph'}).click();
  const at = await place();
  await page.mouse.move(at.x + 3, at.y);
  await hint().waitFor();
  assert.equal(await hint().innerText(), 'Turn bend: bend 12 deg');
  assert.equal(await page.locator('.stage canvas').evaluate((canvas) => canvas.style.cursor), 'grab');
  await page.mouse.down();
  await page.mouse.up();
  assert.equal(await page.getByRole('tab', {name: 'Controls'}).getAttribute('aria-selected'), 'true');
  assert.match(await page.locator('.control.held').innerText(), /bend/);
  assert.equal(bent(), 12, 'a click moves nothing');
  await page.mouse.move(5, 300);
  await hint().waitFor({state: 'hidden'});
});

test('sliders show which handle is theirs', async () => {
  await page.keyboard.press('Escape');
  await page.getByRole('slider', {name: 'twist'}).focus();
  assert.equal(await page.evaluate(() => window.kpsa.state.handle), -1);
  await page.getByRole('slider', {name: 'bend'}).focus();
  assert.equal(await page.evaluate(() => window.kpsa.state.handle), 0);
});

test('H hides handles: nothing is held then, and nothing is asked of them', async () => {
  const violet = (r, g, b) => b > 200 && r > 150 && r < 225 && g > 110 && g < 190;
  const seen = async () => share(await page.locator('.stage canvas').screenshot(), violet);
  await page.keyboard.press('Escape');
  await page.locator('.stage canvas').focus();
  await settled(page);
  assert.ok(await seen() > 2e-5);
  await page.keyboard.press('h');
  await settled(page);
  assert.equal(await seen(), 0);
  assert.equal(await page.getByRole('button', {name: 'Handles'}).getAttribute('aria-pressed'), 'false');
  const at = await place();
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x + 30, at.y, {steps: 4});
  await page.mouse.up();
  await settled(page);
  assert.equal(bent(), 0);
  assert.ok((await place()).x !== at.x, 'the camera was turned instead');
  await page.evaluate(() => window.kpsa.setControl('twist.rotateY', 3));
  assert.ok(!server.last.handles);
  await page.keyboard.press('h');
  await settled(page);
  assert.ok(server.last.handles);
  await page.keyboard.press('f');
});

test('a finger drags, and need not be as exact', async () => {
  const phone = await startBrowser({width: 390, height: 844, touch: true});
  try {
    const {page: small} = await phone.open(server.url), cdp = await small.context().newCDPSession(small);
    const at = await small.evaluate(() => window.kpsa.projectHandle(0)), touch = (type, x, y) => cdp.send('Input.dispatchTouchEvent', {type, touchPoints: type === 'touchEnd' ? [] : [{x, y}]});
    await touch('touchStart', at.x + 14, at.y);
    for (let i = 1; i <= 5; ++i) await touch('touchMove', at.x + 14, at.y - 8 * i);
    await touch('touchEnd');
    // what a finger did may come to the page a picture later
    await small.waitForFunction((y) => Math.abs(window.kpsa.projectHandle(0).y - y) < 1.5, at.y - 40);
    assert.equal(await small.evaluate(() => scrollY), 0, 'the page stays');
  } finally {
    await phone.stop();
  }
});

test('nothing was complained of', () => assert.deepEqual(complaints, []));
