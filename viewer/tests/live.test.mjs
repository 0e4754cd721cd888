// The page as a live view, of a server that evaluates the made-up character.
import assert from 'node:assert/strict';
import {readFileSync, writeFileSync} from 'node:fs';
import {after, before, test} from 'node:test';
import {settled, startBrowser} from './support/browser.mjs';
import {difference} from './support/png.mjs';
import {coefficientsOf, startServer, token} from './support/server.mjs';

let browser, server, page, requests, complaints;

before(async () => {
  server = await startServer();
  browser = await startBrowser();
  ({page, requests, complaints} = await browser.open(server.url));
});
after(async () => {
  await browser?.stop();
  await server?.stop();
});

const picture = () => page.locator('.stage canvas').screenshot();
const idle = () => settled(page);

/** Waits for something that the server has seen. */
async function until(what) {
  const end = Date.now() + 120000;
  while (!what() && Date.now() < end) await new Promise((resolve) => setTimeout(resolve, 10));
  assert.ok(what(), what.toString());
}

/** The largest difference in metres of the full points to what the server means by a pose. */
async function off(set, clip = null, time = 0) {
  const got = await page.evaluate(() => [...window.kpsa.positions('full')]);
  const expected = server.character.place(coefficientsOf(server.character, set, clip, time));
  return Math.max(...got.map((x, i) => Math.abs(x - expected[i])));
}

test('a slider moves points, in state and picture, and the loop is timed', async () => {
  const before = await picture();
  assert.ok(await off({}) < 1e-6);
  const slider = page.getByRole('slider', {name: 'bend'});
  await slider.evaluate((element) => {
    element.value = '30';
    element.dispatchEvent(new Event('input', {bubbles: true}));
  });
  await page.waitForFunction(() => window.kpsa.loopMs !== null && window.kpsa.facts.max_error !== null);
  await idle();
  assert.ok(await off({'bend.rotateX': 30}) < 1e-6);
  assert.ok(difference(before, await picture()) > 0.01);
  const loop = await page.evaluate(() => window.kpsa.loopMs);
  assert.ok(loop > 0, `${loop} ms`);
  assert.match(await page.locator('.status').innerText(), /hit[\s\S]*max 0\.9 mm[\s\S]*accelerated 55 µs[\s\S]*loop \d/);
  assert.deepEqual(server.last.set, {'bend.rotateX': 30});
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 55));
  assert.match(await page.locator('.status').innerText(), /miss[\s\S]*outside its trained range/);
});

test('sides are what the server sent', async () => {
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 20));
  const [near, full] = await page.evaluate(() => [[...window.kpsa.positions('accelerated')], [...window.kpsa.positions('full')]]);
  const most = Math.max(...near.map((x, i) => Math.abs(x - full[i])));
  assert.ok(Math.abs(most - 0.0009) < 1e-6, `${most}`);
});

test('one request is in flight, and the newest state wins', async () => {
  let release;
  server.held = new Promise((resolve) => { release = resolve; });
  server.mostInFlight = 0;
  const count = () => server.log.filter((entry) => entry.path === '/evaluate').length, asked = count();
  await page.evaluate(async () => {
    const slider = document.querySelector('#panel-controls input[type=range]');
    for (let i = 0; i <= 40; ++i) {
      slider.value = String(i);
      slider.dispatchEvent(new Event('input', {bubbles: true}));
      await new Promise((resolve) => setTimeout(resolve, 1));
    }
  });
  await until(() => count() > asked);
  server.held = null;
  release();
  await settled(page);
  assert.equal(server.mostInFlight, 1);
  assert.equal(count() - asked, 2, 'the first of 41 states, which was held, and the newest');
  assert.equal(server.last.set['bend.rotateX'], 40);
  assert.ok(await off({'bend.rotateX': 40}) < 1e-6);
});

test('a double click goes to the default, reset to all of them', async () => {
  await page.getByRole('slider', {name: 'bend'}).dblclick();
  await until(() => !('bend.rotateX' in server.last.set));
  await page.evaluate(() => window.kpsa.setControl('twist.rotateY', 12));
  assert.equal(server.last.set['twist.rotateY'], 12);
  await page.getByRole('button', {name: 'Reset'}).click();
  await until(() => !Object.keys(server.last.set).length);
  await idle();
  assert.ok(await off({}) < 1e-6);
});

test('Delete and Backspace on a slider release it', async () => {
  for (const key of ['Delete', 'Backspace']) {
    await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 12));
    await page.getByRole('slider', {name: 'bend'}).focus();
    await page.keyboard.press(key);
    await until(() => !('bend.rotateX' in server.last.set));
    await idle();
  }
});

test('clips play, and the strip and plots remember what was seen', async () => {
  await page.getByLabel('Clip', {exact: true}).selectOption('bend (test)');
  await page.evaluate(() => window.kpsa.setFrame(12));
  assert.equal(server.last.clip, 'bend');
  assert.ok(Math.abs(server.last.time - 12 / 24) < 1e-9);
  assert.ok(await off({}, 'bend', 0.5) < 1e-6);
  await page.getByRole('button', {name: 'Play'}).click();
  await page.waitForFunction(() => window.kpsa.state.frame > 20);
  await page.getByRole('button', {name: 'Pause'}).click();
  await idle();
  const strip = page.locator('.strip'), box = await strip.boundingBox();
  await strip.hover({position: {x: (12.5 / 40) * box.width, y: 4}});
  assert.match(await page.locator('.track .hint').innerText(), /frame 12 - hit - max error 0\.9 mm/);
  await page.getByLabel('Clip', {exact: true}).selectOption('No clip');
  await until(() => server.last.clip === null);
});

test('problems are shown with their place, the last rig goes on, and they are cleared', async () => {
  server.setProblems([{file: 'sheet.yaml', line: 12, column: 5, message: 'there is no node spime', suggestion: 'did you mean spine?'}]);
  const panel = page.locator('.problems');
  await panel.waitFor();
  assert.match(await panel.innerText(), /sheet\.yaml:12:5[\s\S]*no node spime[\s\S]*did you mean spine/);
  assert.match(await panel.innerText(), /last good rig goes on/);
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 10));
  assert.ok(await off({'bend.rotateX': 10}) < 1e-6);
  server.setProblems([]);
  await panel.waitFor({state: 'hidden'});
});

test('an answer belongs to what was set when it was asked for', async () => {
  const hint = async (frame) => {
    const strip = page.locator('.strip'), box = await strip.boundingBox();
    await strip.hover({position: {x: (frame + 0.5) / 40 * box.width, y: 4}});
    return page.locator('.track .hint').innerText();
  };
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 0));
  await page.evaluate(() => window.kpsa.setFrame(30, 'bend'));
  let release;
  server.held = new Promise((resolve) => { release = resolve; });
  await page.evaluate(() => void window.kpsa.setControl('bend.rotateX', 55));
  await until(() => server.last.set['bend.rotateX'] === 55);
  await page.getByRole('button', {name: 'Reset'}).click();
  await page.evaluate(() => void window.kpsa.setFrame(31));
  server.held = null;
  release();
  await until(() => server.last.time > 30.5 / 24);
  await idle();
  assert.match(await hint(31), /frame 31 - hit/);
  assert.doesNotMatch(await hint(30), /miss/);
  await page.evaluate(() => window.kpsa.setFrame(0, null));
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 10));
});

test('a new version of the rig is loaded, what was moved is kept', async () => {
  await page.getByLabel('Compare').uncheck();
  await until(() => server.last.mode !== 'both');
  await idle();
  server.last = null;
  server.reload({title: 'Sheet, second version'});
  await page.waitForFunction(() => window.kpsa.state.generation === 2);
  await page.waitForFunction(() => document.querySelector('h1').textContent === 'Sheet, second version');
  await until(() => server.last);
  await idle();
  assert.deepEqual(server.last.set, {'bend.rotateX': 10});
  assert.notEqual(server.last.mode, 'both', 'Compare stays unticked');
  await page.getByLabel('Compare').check();
  await until(() => server.last.mode === 'both');
  await idle();
  assert.ok(await off({'bend.rotateX': 10}) < 1e-6);
  const before = await picture();
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', -30));
  assert.ok(difference(before, await picture()) > 0.01);
});

test('poses are saved and loaded', async () => {
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 25));
  const waiting = page.waitForEvent('download');
  await page.getByRole('button', {name: 'Save pose'}).click();
  const download = await waiting;
  assert.equal(download.suggestedFilename(), 'pose.json');
  const saved = JSON.parse(readFileSync(await download.path(), 'utf8'));
  assert.equal(saved['bend.rotateX'], 25);
  assert.equal(Object.keys(saved).length, server.meta.controls.length);
  const file = browser.folder + '/in.json';
  writeFileSync(file, JSON.stringify({'bend.rotateX': -15, 'twist.rotateY': 3}));
  await page.locator('input[type=file]').setInputFiles(file);
  await until(() => server.last.set['bend.rotateX'] === -15 && server.last.set['twist.rotateY'] === 3);
  writeFileSync(file, JSON.stringify({'bend.rotateX': 5, clip: 'wave', time: 0.5 + 7.4 / 30}));
  await page.locator('input[type=file]').setInputFiles(file);
  await until(() => server.last.set['bend.rotateX'] === 5 && server.last.clip === 'wave');
  assert.equal(await page.evaluate(() => window.kpsa.state.frame), 7);
  await page.evaluate(() => window.kpsa.setFrame(0, null));
  writeFileSync(file, 'not a pose');
  await page.locator('input[type=file]').setInputFiles(file);
  await page.getByText('pose.json:1:1 is not JSON').waitFor();
  complaints.splice(0, complaints.length, ...complaints.filter((text) => !/status of 400/.test(text)));
});

test('fields are asked for, vertices explained', async () => {
  const before = await picture();
  await page.getByLabel('Colours', {exact: true}).selectOption({label: 'spine'});
  await idle();
  assert.ok(difference(before, await picture()) > 0.05);
  const at = await page.evaluate(() => window.kpsa.project(44 * 30 + 20));
  await page.mouse.click(at.x, at.y);
  await page.locator('#panel-vertex .lines').waitFor();
  assert.match(await page.locator('#panel-vertex').innerText(), /bend[\s\S]*200 mm[\s\S]*twist[\s\S]*40 mm[\s\S]*vertex 1340 is a hit/);
});

test('a vertex is explained again when the pose has changed', async () => {
  const panel = page.locator('#panel-vertex');
  await page.evaluate(() => window.kpsa.setControl('bend.rotateX', 17));
  await panel.getByText('bent by 17').waitFor({timeout: 20000});
  assert.equal(await panel.locator('.lines').count(), 1);
  assert.deepEqual(await panel.locator('.bars button').evaluateAll((all) => all.map((b) => b.disabled)), [false, false, true], 'detail has no moves to show');
});

test('an answer about a vertex that was left and chosen again is taken once', async () => {
  const field = page.getByLabel('Vertex', {exact: true}).and(page.locator('input')), lines = page.locator('#panel-vertex .lines');
  let asked = 0, release;
  const held = new Promise((resolve) => { release = resolve; });
  await page.route('**/explain*', async (route) => {
    if (!asked++) await held;
    await route.continue();
  });
  for (const vertex of ['100', '200', '100']) {
    await field.fill(vertex);
    await field.press('Enter');
  }
  await lines.getByText('vertex 100 is a hit').waitFor();
  const answered = page.waitForResponse(/explain/);
  release();
  await answered;
  await idle();
  assert.equal(await lines.count(), 1);
  await page.unroute('**/explain*');
});

test('the page is ready when its rig was replaced before the first answer', async () => {
  let release;
  const other = await startServer();
  other.held = new Promise((resolve) => { release = resolve; });
  const asked = () => other.log.filter((entry) => entry.path === '/evaluate').length, shown = browser.open(other.url);
  await until(() => asked() === 1);
  other.reload({title: 'Replaced'});
  await until(() => asked() === 2);
  other.held = null;
  release();
  const opened = await Promise.race([shown, new Promise((resolve) => setTimeout(resolve, 20000, null))]);
  assert.ok(opened, 'ready resolves');
  await opened.page.close();
  await other.stop();
});

test('a server that goes away is noticed', async () => {
  const other = await startServer({accelerated: false}), shown = await browser.open(other.url);
  assert.equal(await shown.page.getByRole('button', {name: 'Difference'}).count(), 0);
  assert.equal(other.last.mode, 'full');
  await other.stop();
  await shown.page.locator('html.lost').waitFor({state: 'attached'});
  await shown.page.close();
});

test('a wrong token is refused, and said', async () => {
  const [first] = server.url.split('?');
  const other = await page.context().newPage();
  await other.route('**/page*', (route) => route.fulfill({path: new URL('../dist/viewer.html', import.meta.url).pathname, contentType: 'text/html'}));
  await other.goto(first + 'page?token=wrong');
  await other.locator('.failure').waitFor();
  assert.match(await other.locator('.failure').innerText(), /wrong token/);
  assert.ok(server.refused >= 1);
  await other.close();
});

test('all requests go to the server with the token, and nothing is complained of', async () => {
  const origin = new URL(server.url).origin;
  assert.ok(requests.every((url) => url.startsWith(origin) || url.startsWith('data:') || url.startsWith('blob:')), requests.join('\n'));
  const asked = server.log.filter((entry) => entry.token !== 'wrong');
  assert.ok(asked.length > 20);
  assert.deepEqual(asked.filter((entry) => entry.token !== token), []);
  assert.deepEqual(complaints, []);
  assert.deepEqual(await page.evaluate(() => window.kpsa.errors), []);
});
