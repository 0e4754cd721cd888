// A picture of the page, for the docs: node picture.mjs REPORT.html|ADDRESS OUT.png [--mode M] [--frame N] [--clip NAME] [--set PLUG=VALUE]...
//   [--tab NAME] [--press KEYS] [--hover HANDLE] [--span TOLERANCES] [--light] [--size WxH] [--wait TEXT]
// Keys are pressed one after the other; --wait waits until the page says TEXT. Colours are as few as a palette has, so that the file is small.
// Needs what the tests need (npm ci; chromium).
import {writeFileSync} from 'node:fs';
import {resolve} from 'node:path';
import {parseArgs} from 'node:util';
import {settled, startBrowser} from './tests/support/browser.mjs';
import {decode} from './tests/support/png.mjs';
import {encodePalette} from './tests/support/palette.mjs';

const {values, positionals: [what, out]} = parseArgs({
  allowPositionals: true,
  options: {
    mode: {type: 'string'}, frame: {type: 'string'}, clip: {type: 'string'}, set: {type: 'string', multiple: true, default: []}, tab: {type: 'string'}, press: {type: 'string', default: ''},
    hover: {type: 'string'}, span: {type: 'string'}, light: {type: 'boolean'}, size: {type: 'string', default: '1440x900'}, wait: {type: 'string'},
  },
});
const [width, height] = values.size.split('x').map(Number);
const browser = await startBrowser({width, height, dark: !values.light});
const {page} = await browser.open(what.startsWith('http') ? what : 'file://' + resolve(what));
if (values.mode) await page.evaluate((mode) => window.kpsa.setMode(mode), values.mode);
if (values.frame || values.clip) await page.evaluate(([frame, clip]) => window.kpsa.setFrame(frame, clip), [Number(values.frame ?? 0), values.clip]);
for (const one of values.set) {
  const [plug, value] = one.split('=');
  await page.evaluate(([name, number]) => window.kpsa.setControl(name, number), [plug, Number(value)]);
}
if (values.span) {
  const choice = page.getByLabel('What the colours span'), tops = await choice.locator('option').evaluateAll((all) => all.map((one) => Number(one.value)));
  await choice.selectOption(String(tops[2] * Number(values.span)));  // the third is one tolerance
}
if (values.tab) await page.getByRole('tab', {name: values.tab}).click();
await page.evaluate(() => document.activeElement?.blur());
for (const key of values.press) await page.keyboard.press(key);
if (values.wait) await page.getByText(values.wait).first().waitFor();
if (values.hover) {
  const at = await page.evaluate((handle) => window.kpsa.projectHandle(handle), Number(values.hover));
  await page.mouse.move(at.x, at.y);
}
await settled(page);
writeFileSync(out, encodePalette(decode(await page.screenshot())));
await browser.stop();
