// What a picture of the page costs, part by part, until it is on the screen: node measure.mjs [--points N] [--modes K]    a generated report
//                                                                           node measure.mjs REPORT.html                 its first clip
//                                                                           node measure.mjs ADDRESS --control PLUG      `kpsa view`, as one slider moves
//   [--frames F] [--mode M] [--tab NAME] [--edges] [--size WxH] [--renderer webgl|software]
// The slider goes on by one step at each refresh of the screen (60 a second), as it does under a hand; the clip plays likewise. For each part the
// median and the 95th percentile, milliseconds. "page" is state, texts and panels; "picture" is from there until it is drawn: points, normals and
// triangles, by the processor or a GPU. What is left until it is presented is waiting for the screen and the browser's compositor. Chromium is
// as it is installed: without a GPU its compositor, too, is the processor, and nobody listens to its requests. Needs what the tests need (npm ci; chromium).
import {resolve} from 'node:path';
import {parseArgs} from 'node:util';
import {makeLargeReport} from './tests/support/large.mjs';
import {startPlainBrowser} from './tests/support/plain_browser.mjs';
import {notePresented} from './tests/support/presented.mjs';
import {makeReport} from './tests/support/report.mjs';

const {values, positionals: [what]} = parseArgs({
  allowPositionals: true,
  options: {
    points: {type: 'string', default: '30000'}, modes: {type: 'string', default: '65'}, frames: {type: 'string', default: '240'}, control: {type: 'string'},
    mode: {type: 'string'}, tab: {type: 'string'}, edges: {type: 'boolean'}, size: {type: 'string', default: '1440x900'}, renderer: {type: 'string'},
  },
});
const frames = Number(values.frames), [width, height] = values.size.split('x').map(Number), live = what?.startsWith('http') ?? false;
if (live && !values.control) throw new Error('--control PLUG is the slider that moves');
const browser = await startPlainBrowser({width, height});
const address = new URL(live ? what : what ? 'file://' + resolve(what)
  : browser.write('report.html', makeReport(makeLargeReport({points: Number(values.points), modes: Number(values.modes), frames}))));
if (values.renderer) address.searchParams.set('renderer', values.renderer);
const page = await browser.open(address.href);
const settled = (mode = null) => page.evaluate((wanted) => window.kpsa.setMode(wanted ?? window.kpsa.state.mode), mode);
const press = (role, name) => page.evaluate((r, n) => {
  const found = [...document.querySelectorAll(r)].find((one) => one.textContent === n);
  if (!found) throw new Error(`there is no ${n}`);
  found.click();
}, role, name);
await settled(values.mode);
if (values.tab) await press('[role=tab]', values.tab);
if (values.edges) await press('button', 'Edges');
await settled();
const facts = await page.evaluate(() => {
  const {width, height} = document.querySelector('.stage canvas');
  return {title: document.title, head: document.querySelector('.name p').textContent, renderer: window.kpsa.renderer, mode: window.kpsa.state.mode, size: `${width} x ${height}`};
});
console.log(`${facts.title}: ${facts.head}\ndrawn by ${facts.renderer}, ${facts.size} pixels in a window of ${width} x ${height}; mode ${facts.mode}`);

function tell(name, times) {
  const sorted = times.slice().sort((a, b) => a - b), at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
  console.log(`  ${name.padEnd(34)} ${at(0.5).toFixed(2).padStart(8)} ${at(0.95).toFixed(2).padStart(8)}`);
}
/** How many of those times are different ones, a second. */
function rate(times) {
  const different = [...new Set(times)];
  console.log(`${((different.length - 1) / (different.at(-1) - different[0]) * 1000).toFixed(1)} pictures a second on the screen`);
}
console.log(`  ${'ms'.padEnd(34)} ${'median'.padStart(8)} ${'95 %'.padStart(8)}`);

const warm = 10, afterWarming = (all) => all.slice(Math.min(warm, all.length >> 2));
if (live) {
  const {low, high} = await page.evaluate((name) => {
    const slider = [...document.querySelectorAll('.control')].find((row) => row.querySelector('.name').title.startsWith(name)).querySelector('input[type=range]');
    return {low: Number(slider.min), high: Number(slider.max)};
  }, values.control);
  const steps = Array.from({length: frames + warm}, (_, i) => low + (high - low) * Math.abs(i / frames * 6 % 2 - 1)), stop = await notePresented(page);
  const all = await page.evaluate((name, to) => window.kpsa.timeControl(name, to), values.control, steps), {marked} = await stop();
  const answered = all.map((row, i) => ({...row, presented: marked[i]})), rows = afterWarming(answered.filter((row) => Number.isFinite(row.presented)));
  tell('program: evaluation', rows.map((row) => row.program));
  tell('until the answer is in the page', rows.map((row) => row.answer));
  tell('page', rows.map((row) => row.page));
  tell('picture', rows.map((row) => row.picture));
  tell('slider to the drawn picture', rows.map((row) => row.answer + row.page + row.picture));
  tell('slider to the screen', rows.map((row) => row.presented - row.asked));
  rate(rows.map((row) => row.presented));
} else {
  const numbers = await page.evaluate((count) => {
    const {state} = window.kpsa, all = JSON.parse(document.getElementById('kpsa-meta').textContent).clips[Math.max(0, state.clip)].frames;
    return Array.from({length: count}, (_, i) => (i + 1) % all);
  }, frames + warm);
  const {page: own, picture} = await page.evaluate((list) => window.kpsa.timeFrames(list), numbers);
  tell('page', own.slice(warm));
  tell('picture', picture.slice(warm));
  const stop = await notePresented(page);
  await page.evaluate(async (list) => {
    for (const frame of list) {
      await new Promise((next) => requestAnimationFrame(next));
      void window.kpsa.setFrame(frame);
    }
  }, numbers);
  await settled();
  rate(afterWarming((await stop()).all));
}
await browser.stop();
