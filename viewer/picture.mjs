// A picture of the page, for the docs: node picture.mjs REPORT.html|ADDRESS OUT.png [--mode M] [--frame N] [--tab NAME] [--light] [--size WxH]
// Needs what the tests need (npm ci; chromium).
import {writeFileSync} from 'node:fs';
import {resolve} from 'node:path';
import {parseArgs} from 'node:util';
import {settled, startBrowser} from './tests/support/browser.mjs';

const {values, positionals: [what, out]} = parseArgs({
  allowPositionals: true,
  options: {mode: {type: 'string'}, frame: {type: 'string'}, tab: {type: 'string'}, light: {type: 'boolean'}, size: {type: 'string', default: '1440x900'}},
});
const [width, height] = values.size.split('x').map(Number);
const browser = await startBrowser({width, height, dark: !values.light});
const {page} = await browser.open(what.startsWith('http') ? what : 'file://' + resolve(what));
if (values.mode) await page.evaluate((mode) => window.kpsa.setMode(mode), values.mode);
if (values.frame) await page.evaluate((frame) => window.kpsa.setFrame(frame), Number(values.frame));
if (values.tab) await page.getByRole('tab', {name: values.tab}).click();
await settled(page);
writeFileSync(out, await page.screenshot());
await browser.stop();
