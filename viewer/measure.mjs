// What a frame of the page costs, part by part: node measure.mjs [--points N] [--modes K] [--frames F]      a generated report
//                                                node measure.mjs REPORT.html [--frames F]                 any report, its first clip
//                                                node measure.mjs ADDRESS --control PLUG [--frames F]      `kpsa view`, as one slider moves
//   [--mode M] [--tab NAME] [--edges]
// For each part the median and the 95th percentile, milliseconds. "page" is the page's own work of a frame on its one thread; "picture" is from
// there until the GPU has drawn it: without a GPU (SwiftShader) the processor does that, too, and it says nothing of a machine that has one.
// Needs what the tests need (npm ci; chromium). A frame has 16.7 ms at 60 a second.
import {resolve} from 'node:path';
import {parseArgs} from 'node:util';
import {settled, startBrowser} from './tests/support/browser.mjs';
import {makeLargeReport} from './tests/support/large.mjs';

const {values, positionals: [what]} = parseArgs({
  allowPositionals: true,
  options: {
    points: {type: 'string', default: '30000'}, modes: {type: 'string', default: '65'}, frames: {type: 'string', default: '240'}, control: {type: 'string'},
    mode: {type: 'string'}, tab: {type: 'string'}, edges: {type: 'boolean'},
  },
});
const frames = Number(values.frames), browser = await startBrowser(), live = what?.startsWith('http') ?? false;
const {page} = what ? await browser.open(live ? what : 'file://' + resolve(what))
  : await browser.openReport(makeLargeReport({points: Number(values.points), modes: Number(values.modes), frames}));
if (values.mode) await page.evaluate((mode) => window.kpsa.setMode(mode), values.mode);
if (values.tab) await page.getByRole('tab', {name: values.tab}).click();
if (values.edges) await page.getByRole('button', {name: 'Edges'}).click();
await settled(page);
const facts = await page.evaluate(() => {
  const gl = document.createElement('canvas').getContext('webgl2'), info = gl.getExtension('WEBGL_debug_renderer_info');
  return {title: document.title, head: document.querySelector('.name p').textContent, renderer: info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : 'unknown'};
});
console.log(`${facts.title}: ${facts.head}\ndrawn by ${facts.renderer}; mode ${await page.evaluate(() => window.kpsa.state.mode)}`);

function tell(name, times) {
  const sorted = times.slice().sort((a, b) => a - b), at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
  console.log(`  ${name.padEnd(34)} ${at(0.5).toFixed(2).padStart(8)} ${at(0.95).toFixed(2).padStart(8)}`);
}
console.log(`  ${'ms'.padEnd(34)} ${'median'.padStart(8)} ${'95 %'.padStart(8)}`);

if (live) {
  if (!values.control) throw new Error('--control PLUG is the slider that moves');
  const rows = await page.evaluate(async ([name, count]) => {
    const slider = [...document.querySelectorAll('.control')].find((row) => row.querySelector('.name').title.startsWith(name)).querySelector('input[type=range]');
    const low = Number(slider.min), high = Number(slider.max), rows = [];
    for (let i = 0; i < count; ++i) {
      await window.kpsa.setControl(name, low + (high - low) * Math.abs(i / count * 6 % 2 - 1));
      const {full_us, accelerated_us} = window.kpsa.facts;
      rows.push({program: ((full_us ?? 0) + (accelerated_us ?? 0)) / 1000, ...window.kpsa.loopParts});
    }
    return rows.slice(5);
  }, [values.control, frames]);
  tell('program: evaluation', rows.map((row) => row.program));
  tell('until the answer is in the page', rows.map((row) => row.answer));
  tell('page', rows.map((row) => row.page));
  tell('all but the picture', rows.map((row) => row.answer + row.page));
  tell('picture', rows.map((row) => row.picture));
} else {
  const {page: own, picture} = await page.evaluate((count) => {
    const {state} = window.kpsa, all = JSON.parse(document.getElementById('kpsa-meta').textContent).clips[Math.max(0, state.clip)].frames;
    return window.kpsa.timeFrames(Array.from({length: count}, (_, i) => (i + 1) % all));
  }, frames);
  tell('page', own.slice(5));
  tell('picture', picture.slice(5));
}
await browser.stop();
